# SPDX-License-Identifier: Apache-2.0
"""Stages of long work, such as compiling, told to whoever shows progress; where nobody does they go unheard."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

COMPILING = "compiling machine code"

Listener = Callable[[str], None]
"""Takes the words of the stage that has begun, or none where the work goes on without one."""

_listeners: list[Listener] = []
_words: list[str] = []


@contextmanager
def stage(words: str) -> Iterator[None]:
    """Tell what is done within a block; the words of a stage around it hold again afterwards."""
    _words.append(words)
    _tell()
    try:
        yield
    finally:
        _words.pop()
        _tell()


@contextmanager
def stages_told(listener: Listener) -> Iterator[None]:
    """Have a listener told of all stages within a block."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


def _tell() -> None:
    for listener in _listeners:
        listener(_words[-1] if _words else "")
