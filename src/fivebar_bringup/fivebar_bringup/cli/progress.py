# SPDX-License-Identifier: Apache-2.0
"""Progress of long work on standard error: a bar in a terminal, elsewhere a line now and then."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from fivebar_bringup.cli.printing import Printer
from fivebar_description.errors import printable
from fivebar_description.stages import stages_told

FIRST_LINE, NEXT_LINES = 2.0, 10.0
"""Times (s) after which a line is printed where there is no terminal, and between further ones."""

SWITCH, OFF = "FIVEBAR_PROGRESS", "off"
"""Environment variable, and its value by which no lines are printed."""

Progress = Callable[[int, int], None]
"""Called with how much is done, and how much there is."""


@contextmanager
def progress_bar(name: str, quiet: bool = False, until_begun: bool = False) -> Iterator[Progress]:
    """Show how much of some work is done, or only for how long it is under way, and which stage it has come to.

    Args:
        name: of the work.
        quiet: print no lines where there is no terminal.
        until_begun: print lines only until something is done, for what then waits for its user.
    """
    console = Printer(stderr=True)
    if console.is_terminal:
        with _bar(name, console) as update:
            yield update
    elif quiet or os.environ.get(SWITCH) == OFF:
        yield lambda done, total: None
    else:
        with _lines(name, until_begun) as update:
            yield update


def _count(done: int, total: int) -> str:
    """Return how much is done in words, nothing while it is not known how much there is."""
    return f"{done} of {total}" if total else ""


class TimeLeft:
    """How long work still takes, by how fast it went on since it began to count."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Begin to count with the first report; `clock` returns seconds."""
        self._clock = clock
        self._first: tuple[float, int] | None = None
        self._last = (0.0, 0, 0)

    def report(self, done: int, total: int) -> None:
        """Take how much is done and how much there is, which is 0 while that is not known."""
        if not total:
            return
        now = self._clock()
        if self._first is None:
            self._first = now, done
        if done != self._last[1] or total != self._last[2]:
            self._last = now, done, total

    @property
    def words(self) -> str:
        """The time left in words, nothing while it cannot be told or all is done."""
        if self._first is None:
            return ""
        (began, before), (now, done, total) = self._first, self._last
        if done <= before or done >= total or now <= began:
            return ""
        left = (now - began) / (done - before) * (total - done) - (self._clock() - now)
        return f"about {_duration(max(1.0, left))} left"


def _duration(seconds: float) -> str:
    """Return a time, as exactly as an estimate is."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


@contextmanager
def _bar(name: str, console: Printer) -> Iterator[Progress]:
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    description = TextColumn("{task.description}", markup=False)
    fields = [TextColumn(f"{{task.fields[{name}]}}", markup=False) for name in ("count", "left")]
    columns = (description, BarColumn(), fields[0], TimeElapsedColumn(), fields[1])
    left = TimeLeft()
    # standard output is for results
    with Progress(*columns, console=console, transient=True, redirect_stdout=False) as progress:
        task = progress.add_task(name, total=None, count="", left="")

        def told(words: str) -> None:
            progress.update(task, description=f"{name}: {words}" if words else name)

        def update(done: int, total: int) -> None:
            left.report(done, total)
            count = _count(done, total)
            progress.update(task, completed=done, total=total or None, count=count, left=left.words)

        with stages_told(told):
            yield update


@contextmanager
def _lines(name: str, until_begun: bool) -> Iterator[Progress]:
    state = {"stage": "", "done": ""}
    left = TimeLeft()
    ended, begun, began = threading.Event(), threading.Event(), time.monotonic()

    def tell() -> None:
        pause = FIRST_LINE
        while not ended.wait(pause):
            if begun.is_set() and until_begun:
                return
            parts = (state["stage"], state["done"], f"{time.monotonic() - began:.0f} s", left.words)
            words = ", ".join(part for part in parts if part)
            print(printable(f"{name}: {words}"), file=sys.stderr, flush=True)
            pause = NEXT_LINES

    teller = threading.Thread(target=tell, name="progress", daemon=True)
    teller.start()
    try:

        def update(done: int, total: int) -> None:
            left.report(done, total)
            if done:
                begun.set()
            state.update(done=_count(done, total))

        with stages_told(lambda words: state.update(stage=words)):
            yield update
    finally:
        ended.set()
        teller.join()
