# SPDX-License-Identifier: Apache-2.0
"""Ends a process at a time even while a library's call does not return and holds the interpreter's lock.

Neither a Python thread nor a Python signal handler runs then, so the C library's timers call C functions, each in a
thread that the C library starts.
"""

from __future__ import annotations

import ctypes
import time

_SIGEV_THREAD = 2
_LIBC = ctypes.CDLL(None, use_errno=True)

PRINTED_BEFORE = 0.1
"""Time (s) between the line and the end of the process."""


class _SignalEvent(ctypes.Structure):
    """`struct sigevent` of 64-bit Linux: 64 bytes."""

    _fields_ = (
        ("value", ctypes.c_void_p),
        ("signo", ctypes.c_int),
        ("notify", ctypes.c_int),
        ("function", ctypes.c_void_p),
        ("attribute", ctypes.c_void_p),
        ("padding", ctypes.c_char * 32),
    )


class _TimerSetting(ctypes.Structure):
    """`struct itimerspec`: the period and the first time, each as seconds and nanoseconds."""

    _fields_ = (
        ("interval_s", ctypes.c_long),
        ("interval_ns", ctypes.c_long),
        ("value_s", ctypes.c_long),
        ("value_ns", ctypes.c_long),
    )


def end_process_after(seconds: float, status: int, line: str) -> None:
    """End this process after so many seconds, unless it has ended by itself before.

    Args:
        seconds: from now on, more than `PRINTED_BEFORE`.
        status: exit status of the process.
        line: printed to standard error just before, after the name of the program.

    Raises:
        OSError: there are no more timers.
    """
    # as the text of a format, which stays in memory for as long as the process
    _KEPT.append(ctypes.create_string_buffer(line.replace("%", "%%").encode()))
    _call_after(seconds - PRINTED_BEFORE, _LIBC.warnx, ctypes.addressof(_KEPT[-1]))
    _call_after(seconds, _LIBC._exit, status)


_KEPT: list[ctypes.Array[ctypes.c_char]] = []


def _call_after(seconds: float, function: object, argument: int) -> None:
    """Have a C function called with one argument."""
    event = _SignalEvent(value=argument, notify=_SIGEV_THREAD, function=ctypes.cast(function, ctypes.c_void_p))  # type: ignore[arg-type]
    timer = ctypes.c_void_p()
    whole, part = divmod(seconds, 1.0)
    setting = _TimerSetting(0, 0, int(whole), int(part * 1e9))
    if _LIBC.timer_create(time.CLOCK_MONOTONIC, ctypes.byref(event), ctypes.byref(timer)) or _LIBC.timer_settime(
        timer, 0, ctypes.byref(setting), None
    ):
        raise OSError(ctypes.get_errno(), "no timer for the end of the process")
