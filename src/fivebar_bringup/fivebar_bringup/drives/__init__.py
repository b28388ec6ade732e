# SPDX-License-Identifier: Apache-2.0
"""A run on drives, emulated or real: the registered interfaces, and the files that bridge and emulation read."""
