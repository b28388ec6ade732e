# SPDX-License-Identifier: Apache-2.0
"""A run of the node graph: nodes and processes, launcher, rehearsal on emulated drives, directory and bag."""
