# SPDX-License-Identifier: Apache-2.0
"""Runs of the whole graph in the background, each in a domain of its own; nothing of them outlives its test."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from fivebar_command import FivebarCommand, GraphRun
from graph_probe import Bench


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("system")


@pytest.fixture(scope="module")
def fivebar(folder: Path) -> Iterator[Callable[..., FivebarCommand]]:
    """Start `fivebar` with some arguments, in a folder of its own."""
    with ExitStack() as stack:
        calls: list[FivebarCommand] = []

        def start(*arguments: str) -> FivebarCommand:
            command = FivebarCommand(folder / f"call{len(calls)}", *arguments)
            calls.append(command)
            stack.callback(command.close)
            return command

        yield start


@pytest.fixture(scope="module")
def graph_run(folder: Path) -> Iterator[Callable[..., GraphRun]]:
    """Start a crossing in the background with a probe beside it."""
    with ExitStack() as stack:
        runs: list[GraphRun] = []

        def start(*arguments: str, **sections: Any) -> GraphRun:
            bench = stack.enter_context(Bench(folder / f"run{len(runs)}"))
            run = GraphRun(bench.folder, bench.domain, bench.probe(), *arguments, **sections)
            runs.append(run)
            stack.callback(run.command.close)
            return run

        yield start
