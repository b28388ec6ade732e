"""Subcommand about the live page: view; and the page of a run that this command starts."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from fivebar_bringup import executables
from fivebar_bringup.cli.app import Group, NamespaceOption, command, input_errors
from fivebar_bringup.cli.status import DomainOption, graph_domain
from fivebar_bringup.runs.domain import private_domain
from fivebar_bringup.runs.namespace import read_namespace, remapping
from fivebar_bringup.runs.parent_death import end_with_parent
from fivebar_description.errors import InputError
from fivebar_description.interrupts import STOP_SIGNALS
from fivebar_description.ros_environment import check_ros_environment

if TYPE_CHECKING:
    from fivebar_bringup.recorded.run_directory import RunDirectory
    from fivebar_bringup.recorded.summary import Summary

START_TIMEOUT = 120.0
"""Longest time (s) until the page is served."""

PAGE_TIMEOUT = 30.0
"""How long (s) a run waits for someone to open the page."""

STOP_TIMEOUT = 10.0

ADDRESS, OPENED, TOLD = "view: http", "view: a page is open", "view: the pages have been told"
"""Lines of the viewer: once it serves the page, once somebody looks, and once it has sent the end of the run."""

ViewOption = Annotated[
    bool,
    typer.Option(
        "--view",
        help=f"Serve a live page on this machine; the run begins once it is open, or after {PAGE_TIMEOUT:g} s.",
    ),
]


@command(Group.RUN)
def view(
    domain: DomainOption = None,
    namespace: NamespaceOption = "",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port on 127.0.0.1, 0 for a free one.")] = 0,
) -> None:
    """Show a running robot on a live page in the browser.

    It prints the address of the page, and serves it until Ctrl-C.

    Example: `fivebar view --domain 7`
    """
    with input_errors():
        check_ros_environment()
        remapped = remapping(read_namespace(namespace))
        os.environ["ROS_DOMAIN_ID"] = str(graph_domain(domain))
    sys.argv = ["viewer", "--ros-args", *remapped, "-p", f"port:={port}"]
    executables.viewer()


class LivePage(NamedTuple):
    """The live page of a run, if there is one.

    Attributes:
        domain: in which the run's nodes are to be started; None for a free one.
        viewer: the process that serves the page; None where there is none.
    """

    domain: int | None
    viewer: subprocess.Popen[bytes] | None = None

    def tell(self, directory: RunDirectory, summary: Summary) -> None:
        """Tell the open pages what became of the run, with its report; a viewer that has ended is told nothing."""
        from fivebar_bringup.live.ending import ended_text

        if self.viewer is None:
            return
        assert self.viewer.stdin is not None
        report = directory.page if directory.page.exists() else None
        with suppress(BrokenPipeError):
            self.viewer.stdin.write(ended_text(summary, report).encode("utf-8"))
            self.viewer.stdin.flush()
            _wait_for_line(self.viewer, TOLD, STOP_TIMEOUT)


@contextmanager
def live_page(
    wanted: bool, domain: int | None, namespace: str = "", interface: str | None = None
) -> Iterator[LivePage]:
    """Serve the live page of a graph that is started meanwhile; yield it, with the domain to start the graph in.

    Without `wanted` there is no page, and the domain is the given one. The faults of drives are those of `interface`.

    Raises:
        InputError: the page cannot be served.
    """
    if not wanted:
        yield LivePage(domain)
        return
    with nullcontext(domain) if domain is not None else private_domain() as chosen:
        parameters = ["-p", "told_on_input:=true"]
        if interface is not None:
            parameters += ["-p", f"drives_interface:='{interface}'"]
        viewer = subprocess.Popen(
            [*executables.viewer.command, "--ros-args", *remapping(namespace), *parameters],
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
            yield LivePage(chosen, viewer)
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
