# SPDX-License-Identifier: Apache-2.0
"""The signals that ask for a stop, as KeyboardInterrupt, which waits until no foreign code is running.

A handler runs between any two steps of Python, also where a library calls Python from C++. An exception that it raises
there is lost, or becomes another one: rclpy makes a RuntimeError of it while it converts a message, and LLVM goes on
without the machine code that it was handing over.
"""

from __future__ import annotations

import _thread
import math
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from types import FrameType

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

REPEAT_PERIOD = 0.5
"""Time (s) in which a further signal is the same request: a terminal and `ros2 launch` may both pass Ctrl-C on."""


class ResumableInterrupt(KeyboardInterrupt):
    """An interrupt of work that can be resumed; the message says what is kept, and how to resume."""


@contextmanager
def resumable(words: str) -> Iterator[None]:
    """Give an interrupt of the block these words.

    Raises:
        ResumableInterrupt: the block has been interrupted.
    """
    try:
        yield
    except KeyboardInterrupt as interrupt:
        raise ResumableInterrupt(words) from interrupt


CALLED_BACK = ("_raw_object_cache_notify", "_raw_object_cache_getbuffer")
"""Functions that LLVM calls in the middle of a compilation: without what they do it goes on with half of a program."""

AGAIN = 0.02
"""Time (s) after which an interrupt that could not come is tried again."""


def end_at_once(number: int, frame: FrameType | None) -> None:
    """End the process with exit status 0, as a signal does before a service has begun."""
    os._exit(0)


class _Interrupts:
    """Whether an interrupt is to wait, and whether one does; Python handles signals in the main thread alone."""

    deferred = False
    pending = False
    blocks = 0
    """How many blocks that defer or allow interrupts are within each other."""
    raised = False
    """Whether one has been raised since the outermost of them began."""
    raised_at = -math.inf
    """Time of the last interrupt (monotonic, s)."""
    number: int = signal.SIGINT
    """The signal that it came by."""


def heard_signals() -> tuple[signal.Signals, ...]:
    """Return the signals that a stop is asked for with, except those that whoever started this process has ignored."""
    return tuple(number for number in STOP_SIGNALS if signal.getsignal(number) is not signal.SIG_IGN)


def service_signals() -> tuple[signal.Signals, ...]:
    """Return the signals that end a node or another service: a shell's background job hears Ctrl-C too.

    Only a hangup that `nohup` has ignored stays so.
    """
    return tuple(number for number in STOP_SIGNALS if number in (*heard_signals(), signal.SIGINT, signal.SIGTERM))


@contextmanager
def keyboard_interrupts() -> Iterator[None]:
    """Make these signals raise KeyboardInterrupt, within `interrupts_deferred` at its end; an ignored one stays so."""
    previous = {number: signal.signal(number, _interrupt) for number in heard_signals()}
    _Interrupts.raised_at = -math.inf
    hook = sys.unraisablehook

    def unraisable(unraised: sys.UnraisableHookArgs) -> None:
        """Repeat an interrupt that was lost, as in `__del__`, since nothing called the function it was raised in."""
        if not issubclass(unraised.exc_type, KeyboardInterrupt):
            hook(unraised)
            return
        _Interrupts.raised_at, _Interrupts.raised = -math.inf, False
        _send_again(_Interrupts.number)

    sys.unraisablehook = unraisable
    try:
        yield
    finally:
        sys.unraisablehook = hook
        for number, handler in previous.items():
            signal.signal(number, handler)


def interrupts_deferred() -> AbstractContextManager[None]:
    """Let an interrupt by `keyboard_interrupts` wait until the block has ended; none comes but in the main thread.

    One that comes after another has been raised within the block repeats it, and is dropped.

    Raises:
        KeyboardInterrupt: at the end, if one has come.
    """
    return _deferring(True)


def interrupts_allowed() -> AbstractContextManager[None]:
    """Let interrupts come in a part of a block that defers them.

    Raises:
        KeyboardInterrupt: one has come, in the block or before.
    """
    return _deferring(False)


@contextmanager
def _deferring(deferred: bool) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before, _Interrupts.deferred = _Interrupts.deferred, deferred
    _Interrupts.blocks += 1
    try:
        _raise_pending()
        yield
    finally:
        _Interrupts.blocks -= 1
        _Interrupts.deferred = before
        if not _Interrupts.blocks:
            _Interrupts.raised = False
        _raise_pending()


def _raise_pending() -> None:
    if _Interrupts.pending and not _Interrupts.deferred:
        _Interrupts.pending = False
        _raise()


def _raise() -> None:
    _Interrupts.raised = _Interrupts.blocks > 0
    _Interrupts.raised_at = time.monotonic()
    raise KeyboardInterrupt


def _interrupt(number: int, frame: FrameType | None) -> None:
    if time.monotonic() - _Interrupts.raised_at < REPEAT_PERIOD:
        return
    _Interrupts.number = number
    if not _Interrupts.deferred:
        if _is_called_back(frame):
            _send_again(number)
        else:
            _raise()
    elif not _Interrupts.raised:
        _Interrupts.pending = True


def _is_called_back(frame: FrameType | None) -> bool:
    """Return whether a library waits for the function of a frame, which must not end by an exception."""
    while frame is not None:
        if frame.f_code.co_name in CALLED_BACK:
            return True
        frame = frame.f_back
    return False


def _send_again(number: int) -> None:
    """Send a signal to this process a little later."""

    def send() -> None:
        time.sleep(AGAIN)
        os.kill(os.getpid(), number)

    # not of `threading`, whose locks the interrupted function may hold
    _thread.start_new_thread(send, ())
