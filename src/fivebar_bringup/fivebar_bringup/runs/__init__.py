"""One run of the node graph: its nodes and processes, the launcher, the rehearsal, its directory and its bag."""
