"""A requested motion on a graph that runs already."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from fivebar_bringup.nodes.goal_client import GoalClient
from fivebar_bringup.studies.goto.request import ASSEMBLY_MODES
from fivebar_description.strict_yaml import InputError

ENDS = ("arrived", "refused", "stopped")
"""States after which nothing more comes."""

Tell = Callable[[dict[str, Any]], None]


def goal_fields(
    x: float, y: float, assembly: str | None, working_mode: tuple[int, int] | None, duration: float | None
) -> dict[str, float]:
    """Return the fields of a request; what is None stays as it comes.

    Raises:
        InputError: there is no such assembly mode.
    """
    if assembly is not None and assembly not in ASSEMBLY_MODES:
        raise InputError(f"--mode: {assembly!r}: expected + or -, the sign of det A")
    fields = {"x": x, "y": y}
    if assembly is not None:
        fields["assembly_mode"] = float(ASSEMBLY_MODES[assembly])
    if working_mode is not None:
        fields["mode1"], fields["mode2"] = float(working_mode[0]), float(working_mode[1])
    if duration is not None:
        fields["duration"] = duration
    return fields


def request_live(fields: dict[str, float], domain: int, timeout: float, tell: Tell) -> dict[str, Any]:
    """Ask the graph in a DDS domain for a motion and follow it to its end; return the last status.

    `tell` is called with every status on the way.

    Raises:
        InputError: nobody takes requests there, or nothing comes back within the timeout (s).
    """
    with GoalClient(domain) as client:
        if not client.find():
            raise InputError(f"--domain: {domain}: no graph there takes requests")
        client.request(fields)
        end = time.monotonic() + timeout
        while True:
            status = client.next_status(max(0.0, end - time.monotonic()))
            if status is None:
                raise InputError(f"--domain: {domain}: the motion was not over within {timeout:g} s")
            tell(status)
            if status["state"] in ENDS:
                return status
