"""A run on drives, emulated or real: the registered interfaces, and the files that bridge and emulation read."""
