# SPDX-License-Identifier: Apache-2.0
"""The option `--view`: the live page of a run, which the package `fivebar_live` serves."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from fivebar_description.optional import LIVE_PAGE, optional_part

if TYPE_CHECKING:
    from fivebar_bringup.recorded.run_directory import RunDirectory
    from fivebar_bringup.recorded.summary import Summary

PAGE_TIMEOUT = 30.0
"""How long (s) a run waits for someone to open the page."""

ViewOption = Annotated[
    bool,
    typer.Option(
        "--view",
        help=f"Serve a live page on this machine; the run begins once it is open, or after {PAGE_TIMEOUT:g} s.",
    ),
]


class LivePage(NamedTuple):
    """The live page of a run, if there is one.

    Attributes:
        domain: in which the run's nodes are to be started; None for a free one.
        tell: tells the open pages what became of the run.
    """

    domain: int | None
    tell: Callable[[RunDirectory, Summary], None] = lambda directory, summary: None


@contextmanager
def live_page(
    wanted: bool, domain: int | None, namespace: str = "", interface: str | None = None
) -> Iterator[LivePage]:
    """Serve the live page of a graph that is started meanwhile; yield it, with the domain to start the graph in.

    Without `wanted` there is no page, and the domain is the given one. The faults of drives are those of `interface`.

    Raises:
        InputError: the page cannot be served, or what serves it is not installed.
    """
    if not wanted:
        yield LivePage(domain)
        return
    with optional_part(LIVE_PAGE, "--view")(domain, namespace, interface) as page:
        yield page
