# SPDX-License-Identifier: Apache-2.0
"""Nodes in processes of their own that need not load what all nodes load: forked from a server that has done so."""

from __future__ import annotations

import ctypes
import importlib
import multiprocessing
import os
import signal
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from multiprocessing import forkserver, resource_tracker
from multiprocessing.context import ForkServerContext
from pathlib import Path

import pytest

from fivebar_description.ros.run import MIDDLEWARE_LEFT

PR_SET_PDEATHSIG = 1

DEADLINE = 120.0
"""Longest wait (s) for a condition that takes a second or two on an idle machine, the start of a process included."""


def fork_context(modules: Sequence[str]) -> ForkServerContext:
    """Return the context of a server that has loaded some modules; none of them starts threads before its `main`."""
    context = multiprocessing.get_context("forkserver")
    # with what runs in the fork before that `main`
    context.set_forkserver_preload([*modules, "pytest.__main__", __name__, "fork_ready"])
    with pytest.MonkeyPatch.context() as patch:
        # the server does not take the path of this process
        patch.setenv("PYTHONPATH", str(Path(__file__).parent), prepend=os.pathsep)
        forkserver.ensure_running()
    return context


class ForkedNode:
    """The `main` of a module in a process and session of its own, with what it prints in files."""

    def __init__(
        self,
        context: ForkServerContext,
        module: str,
        arguments: Sequence[str],
        folder: Path,
        environment: Mapping[str, str],
        program: str = "",
    ) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        number = len(list(folder.glob("*.stderr")))
        self._out, self._err = folder / f"{number}.stdout", folder / f"{number}.stderr"
        self._out.touch()
        self._err.touch()
        self._words = [program or module, *arguments]
        self._process = context.Process(
            target=_run_main, args=(module, self._words, self._out, self._err, dict(environment), folder)
        )
        self._process.start()
        assert self._process.pid is not None
        self.pid = self._process.pid

    @property
    def status(self) -> int | None:
        """Exit status, None while the process runs."""
        return self._process.exitcode

    @property
    def stdout(self) -> str:
        return self._out.read_text(encoding="utf-8")

    @property
    def stderr(self) -> str:
        return self._err.read_text(encoding="utf-8")

    @property
    def complaints(self) -> list[str]:
        """The lines on standard error that do not tell of the node's regular course.

        That a process ended without its middleware is none: see `fivebar_description.ros.run.TEARDOWN_TIME`.
        """
        lines = self.stderr.splitlines()
        return [line for line in lines if not line.startswith("[INFO]") and not line.endswith(MIDDLEWARE_LEFT)]

    def send(self, number: signal.Signals) -> None:
        if self.status is None:
            os.kill(self.pid, number)

    def wait(self, deadline: float = DEADLINE) -> int:
        """Return the exit status; fail where the process does not end in time."""
        self._process.join(deadline)
        status = self.status
        if status is None:
            pytest.fail(f"still running after {deadline} s: {' '.join(self._words)}\n{self.stderr}")
        return status

    def close(self) -> None:
        if self.status is None:
            os.kill(self.pid, signal.SIGKILL)
            self._process.join()


_LIBC = ctypes.CDLL(None)


def end_with_parent() -> None:
    """Have this process killed when its parent ends: a node of a killed test must not stay in the next one's domain."""
    _LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def close_inherited(*kept: int) -> None:
    """Close all but standard input and output and some descriptors, as the start of a program does.

    Among them is the pipe by which the server of forks learns that the tests have ended: it stays while anyone holds
    it, and with it all that it has forked. The pipe to multiprocessing's resource tracker is kept: its number is
    remembered, and would be that of another file.
    """
    kept = (*kept, resource_tracker.getfd())
    for descriptor in map(int, os.listdir("/proc/self/fd")):
        with suppress(OSError):
            if descriptor > 2 and descriptor not in kept:
                os.close(descriptor)


def _run_main(module: str, words: list[str], out: Path, err: Path, environment: dict[str, str], folder: Path) -> None:
    """Make this process what `python -m MODULE ARGUMENTS` would be, and run it."""
    os.setsid()
    end_with_parent()
    close_inherited()
    for path, descriptor in ((out, 1), (err, 2)):
        opened = os.open(path, os.O_WRONLY | os.O_APPEND)
        os.dup2(opened, descriptor)
        os.close(opened)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    sys.argv = words
    importlib.import_module(module).main()
