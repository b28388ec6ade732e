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
def progress_bar(name: str, quiet: bool = False) -> Iterator[Progress]:
    """Show how much of some work is done, or only for how long it is under way, and which stage it has come to.

    Args:
        name: of the work.
        quiet: print no lines where there is no terminal.
    """
    console = Printer(stderr=True)
    if console.is_terminal:
        with _bar(name, console) as update:
            yield update
    elif quiet or os.environ.get(SWITCH) == OFF:
        yield lambda done, total: None
    else:
        with _lines(name) as update:
            yield update


def _count(done: int, total: int) -> str:
    """Return how much is done in words, nothing while it is not known how much there is."""
    return f"{done} of {total}" if total else ""


@contextmanager
def _bar(name: str, console: Printer) -> Iterator[Progress]:
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    description = TextColumn("{task.description}", markup=False)
    columns = (description, BarColumn(), TextColumn("{task.fields[count]}", markup=False), TimeElapsedColumn())
    # standard output is for results
    with Progress(*columns, console=console, transient=True, redirect_stdout=False) as progress:
        task = progress.add_task(name, total=None, count="")

        def told(words: str) -> None:
            progress.update(task, description=f"{name}: {words}" if words else name)

        with stages_told(told):
            yield lambda done, total: progress.update(task, completed=done, total=total, count=_count(done, total))


@contextmanager
def _lines(name: str) -> Iterator[Progress]:
    state = {"stage": "", "done": ""}
    ended, began = threading.Event(), time.monotonic()

    def tell() -> None:
        pause = FIRST_LINE
        while not ended.wait(pause):
            words = ", ".join(
                one for one in (state["stage"], state["done"], f"{time.monotonic() - began:.0f} s") if one
            )
            print(printable(f"{name}: {words}"), file=sys.stderr, flush=True)
            pause = NEXT_LINES

    teller = threading.Thread(target=tell, name="progress", daemon=True)
    teller.start()
    try:
        with stages_told(lambda words: state.update(stage=words)):
            yield lambda done, total: state.update(done=_count(done, total))
    finally:
        ended.set()
        teller.join()
