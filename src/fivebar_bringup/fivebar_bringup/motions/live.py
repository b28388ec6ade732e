# SPDX-License-Identifier: Apache-2.0
"""Sends a goal to a running graph and follows it."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Sequence
from typing import Any

from fivebar_bringup.motions.request import ASSEMBLY_MODES
from fivebar_bringup.nodes.goal_client import GoalClient
from fivebar_control.model.state import WorkingMode
from fivebar_control.planning.line_of_sight import Point
from fivebar_control.planning.motion_queue import via_fields
from fivebar_control.planning.timed_points import TimedPoints
from fivebar_description.strict_yaml import InputError

ENDS = ("arrived", "cancelled", "refused", "stopped")
"""Final states of a goal."""

POINT = re.compile(r"points\[(\d+)\]")
"""How a graph names a point of a trajectory, of whose file it does not know."""

Report = Callable[[dict[str, Any]], None]


def goal_fields(
    x: float,
    y: float,
    assembly: str | None,
    working_mode: WorkingMode | None,
    duration: float | None,
    via: Sequence[Point] = (),
    blend_radius: Sequence[float] = (),
) -> dict[str, float]:
    """Return the fields of a goal message; those that are None are left out. Each via point has a blend radius (m).

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
    return fields | via_fields(via, blend_radius)


def request_live(
    asked: dict[str, float] | TimedPoints, domain: int, timeout: float, report: Report, namespace: str = ""
) -> dict[str, Any]:
    """Send a goal or a trajectory to the graph in a DDS domain and a namespace; return the last status.

    `report` is called with every status on the way.

    Raises:
        InputError: no graph there accepts goals, or the goal does not end within the timeout (s).
    """
    with GoalClient(domain, namespace) as client:
        if not client.find():
            raise InputError(f"--domain: {domain}: no graph there accepts goals")
        if isinstance(asked, TimedPoints):
            client.follow(asked)
        else:
            client.request(asked)
        end = time.monotonic() + timeout
        while True:
            status = client.next_status(max(0.0, end - time.monotonic()))
            if status is None:
                raise InputError(f"--domain: {domain}: the motion was not over within {timeout:g} s")
            if isinstance(asked, TimedPoints) and "reason" in status:
                status = {**status, "reason": POINT.sub(lambda match: asked.labels.of(int(match[1])), status["reason"])}
            report(status)
            if status["state"] in ENDS:
                return status
