# SPDX-License-Identifier: Apache-2.0
"""Ties a process to its parent: the kernel ends it when the parent is gone, however that comes about."""

from __future__ import annotations

import ctypes
import os
import signal

PR_SET_PDEATHSIG = 1


def end_with_parent() -> None:
    """Have the kernel end this process when its parent ends."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


def interrupt_with(parent: int) -> None:
    """Send this process SIGTERM when its parent ends; at once where that is not the process of this number any more."""
    end_with_parent()
    if os.getppid() != parent:
        signal.raise_signal(signal.SIGTERM)
