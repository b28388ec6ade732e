# SPDX-License-Identifier: Apache-2.0
"""Every test carries the mark of the folder it is in: `pytest -m unit` runs tests/unit."""

import gc
import os
import signal
from pathlib import Path

import pytest

TESTS = Path(__file__).parent

# as the command and its nodes have it; read when numpy is loaded
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# standard error has what is wrong alone, however long a command takes on a busy machine
os.environ["FIVEBAR_PROGRESS"] = "off"

# a shell has its background jobs ignore Ctrl-C, nohup has all that it starts ignore the end of the terminal; here
# processes are interrupted by both
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)


MARKERS = (
    "unit: plain Python, no ROS (tests/unit)",
    "ros: nodes in this process or beside it (tests/ros)",
    "launch: launch files under ROS' own launch, skipped where that is not installed (tests/launch)",
    "system: what a user does, from outside (tests/system)",
    "browser: pages in a real browser (tests/browser)",
    "clock: follows the clock, so nothing else should run beside it",
    "extra: confirms a study and takes long; `make test-extra` runs it, `make test` does not",
)


def pytest_configure(config: pytest.Config) -> None:
    """Declare the marks here, for runs from the root and from a package alike."""
    for marker in MARKERS:
        config.addinivalue_line("markers", marker)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if TESTS not in item.path.parents:
            # the test of a package, in its own folder
            continue
        folder, *rest = item.path.relative_to(TESTS).parts
        if rest:
            item.add_marker(folder)
        if folder == "unit" and item.get_closest_marker("clock"):
            raise pytest.UsageError(f"{item.nodeid}: unit tests do not follow the clock, and would not be run")
    items[:] = in_good_order(items)


FIRST = ("test_odds.py", "test_engine.py")
"""Files that compile for long what others need, which would wait for it."""

WAITING = ("launch", "ros", "system")
"""Folders whose tests mostly wait for nodes, so that a processor has time for others beside them."""


def in_good_order(items: list[pytest.Item]) -> list[pytest.Item]:
    """Return tests in the order in which several workers keep all processors busy, those of a file side by side."""
    files: dict[Path, list[pytest.Item]] = {}
    for item in items:
        files.setdefault(item.path, []).append(item)
    waiting = [path for path in files if any(TESTS / folder in path.parents for folder in WAITING)]
    # those of bringup last, which need most of what is compiled first
    others = [path for path in reversed(files) if path not in waiting]
    # both kinds spread evenly, whatever their numbers
    place = {path: (n + 0.5) / len(kind) for kind in (waiting, others) for n, path in enumerate(kind)}
    place |= {path: FIRST.index(path.name) - len(FIRST) for path in files if path.name in FIRST}
    return [item for path in sorted(files, key=place.__getitem__) for item in files[path]]


def pytest_collection_finish() -> None:
    """Have no garbage collection look at modules and tests again: that takes a quarter of a second each time."""
    gc.collect()
    gc.freeze()
    # what numba makes while it compiles is looked at a hundred times less often, a seventh of its time
    gc.set_threshold(70_000, 20, 20)
