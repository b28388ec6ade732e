# SPDX-License-Identifier: Apache-2.0
"""Loaded last by the server that nodes are forked from: does once what every node would do at its start."""

import gc
import inspect
import sys

# see run_nodes: a look at every module that is loaded
inspect.getframeinfo(sys._getframe())
# what nodes share is neither visited nor copied
gc.collect()
gc.freeze()
