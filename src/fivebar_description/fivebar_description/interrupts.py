"""SIGINT and SIGTERM as KeyboardInterrupt, which waits until no foreign code is running.

A handler runs between any two steps of Python, also where a library calls Python from C++. An exception that it raises
there is lost, or becomes another one: rclpy makes a RuntimeError of it while it converts a message.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)


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


class _Interrupts:
    """Whether an interrupt is to wait, and whether one does; Python handles signals in the main thread alone."""

    deferred = False
    pending = False


@contextmanager
def keyboard_interrupts() -> Iterator[None]:
    """Make both signals raise KeyboardInterrupt, within `interrupts_deferred` at its end; an ignored one stays so."""
    heard = [number for number in STOP_SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
    previous = {number: signal.signal(number, _interrupt) for number in heard}
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


@contextmanager
def interrupts_deferred() -> Iterator[None]:
    """Let an interrupt by `keyboard_interrupts` wait until the block has ended; none comes but in the main thread.

    Raises:
        KeyboardInterrupt: at the end, if one has come.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    _Interrupts.pending, _Interrupts.deferred = False, True
    try:
        yield
    finally:
        _Interrupts.deferred = False
        if _Interrupts.pending:
            raise KeyboardInterrupt


def _interrupt(number: int, frame: FrameType | None) -> None:
    if not _Interrupts.deferred:
        raise KeyboardInterrupt
    _Interrupts.pending = True
