# SPDX-License-Identifier: Apache-2.0
"""The live page of a run that the command starts: served in a process of its own, which the run waits for."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from functools import partial
from typing import TYPE_CHECKING

from fivebar_bringup.cli.viewing import PAGE_TIMEOUT, LivePage
from fivebar_bringup.executables import viewer as executable
from fivebar_bringup.runs.domain import private_domain
from fivebar_bringup.runs.namespace import remapping
from fivebar_bringup.runs.parent_death import end_with_parent
from fivebar_description.errors import InputError
from fivebar_description.interrupts import STOP_SIGNALS
from fivebar_live.ending import ended_text

if TYPE_CHECKING:
    from fivebar_bringup.recorded.run_directory import RunDirectory
    from fivebar_bringup.recorded.summary import Summary

START_TIMEOUT = 120.0
"""Longest time (s) until the page is served."""

STOP_TIMEOUT = 10.0

ADDRESS, OPENED, TOLD = "view: http", "view: a page is open", "view: the pages have been told"
"""Lines of the viewer: once it serves the page, once somebody looks, and once it has sent the end of the run."""


def _tell(viewer: subprocess.Popen[bytes], directory: RunDirectory, summary: Summary) -> None:
    """Tell the open pages what became of the run, with its report; a viewer that has ended is told nothing."""
    assert viewer.stdin is not None
    report = directory.page if directory.page.exists() else None
    with suppress(BrokenPipeError):
        viewer.stdin.write(ended_text(summary, report).encode("utf-8"))
        viewer.stdin.flush()
        _wait_for_line(viewer, TOLD, STOP_TIMEOUT)


@contextmanager
def live_page(domain: int | None, namespace: str = "", interface: str | None = None) -> Iterator[LivePage]:
    """Serve the live page of a graph that is started meanwhile; yield it, with the domain to start the graph in.

    The faults of drives are those of `interface`.

    Raises:
        InputError: the page cannot be served.
    """
    with nullcontext(domain) if domain is not None else private_domain() as chosen:
        parameters = ["-p", "told_on_input:=true"]
        if interface is not None:
            parameters += ["-p", f"drives_interface:='{interface}'"]
        viewer = subprocess.Popen(
            [*executable.command, "--ros-args", *remapping(namespace), *parameters],
            env={**os.environ, "ROS_DOMAIN_ID": str(chosen)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            # Ctrl-C is for the run, at whose end the page ends
            start_new_session=True,
            preexec_fn=_begin_viewer,
        )
        try:
            address = _wait_for_line(viewer, ADDRESS, START_TIMEOUT)
            if address is None:
                raise InputError("--view: the live page could not be served")
            print(f"{address}\nview: waiting until the page is open", file=sys.stderr)
            _wait_for_line(viewer, OPENED, PAGE_TIMEOUT)
            yield LivePage(chosen, partial(_tell, viewer))
        finally:
            viewer.send_signal(signal.SIGINT)
            try:
                viewer.wait(STOP_TIMEOUT)
            except subprocess.TimeoutExpired:
                viewer.kill()
                viewer.wait()


def _begin_viewer() -> None:
    """End with the run; signals wait until the viewer hears them, see `Executable`."""
    end_with_parent()
    signal.pthread_sigmask(signal.SIG_BLOCK, STOP_SIGNALS)


def _wait_for_line(process: subprocess.Popen[bytes], beginning: str, seconds: float) -> str | None:
    """Return the next line of a process that begins in this way; None where none comes in time, or the process ends."""
    assert process.stdout is not None
    output, end, text = process.stdout.fileno(), time.monotonic() + seconds, ""
    while (left := end - time.monotonic()) > 0.0:
        if not select.select([output], [], [], left)[0]:
            return None
        data = os.read(output, 4096)
        if not data:
            return None
        text += data.decode("utf-8", "replace")
        for line in text.splitlines():
            if line.startswith(beginning):
                return line
    return None
