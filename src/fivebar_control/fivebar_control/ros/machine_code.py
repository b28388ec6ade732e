# SPDX-License-Identifier: Apache-2.0
"""Machine code in a node of the control chain: a start that takes long for it is said."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from threading import Timer

PATIENCE = 2.0
"""Time (s) after which a start says why it takes long."""

COMPILES = "loads its machine code, or makes it, which takes a minute or more the first time"


@contextmanager
def said_if_long(say: Callable[[str], object], words: str, after: float = PATIENCE) -> Iterator[None]:
    """Say some words where a block takes longer than a time (s), while it runs."""
    timer = Timer(after, say, [words])
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def loading(compiled: bool, say: Callable[[str], object]) -> AbstractContextManager[None]:
    """Return a context in which a node loads what it has as machine code, if it has any."""
    return said_if_long(say, COMPILES) if compiled else nullcontext()
