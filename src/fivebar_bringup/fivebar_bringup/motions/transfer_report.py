# SPDX-License-Identifier: Apache-2.0
"""A planned transfer as text for a person and as JSON for a script."""

from __future__ import annotations

from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table

from fivebar_bringup.motions.request import Request
from fivebar_bringup.odds.planned_motion import PlannedMotion
from fivebar_bringup.recorded.summary import planned_crossings
from fivebar_control.model.singularity import FOLDED
from fivebar_control.planning.postures import mode_name, sign_name
from fivebar_control.planning.transfer import Transfer
from fivebar_control.trajectory.refusal import ELBOWS_UNKNOWN, place
from fivebar_description.robot_file import UNKNOWN, read_robot


def as_json(request: Request, likely: PlannedMotion[Transfer], planning_s: float) -> dict[str, Any]:
    """Return a transfer as plain lists, numbers and texts; m, s, Nm, rad/s."""
    transfer = likely.motion
    start, goal = transfer.waypoints[0], transfer.waypoints[-1]
    crossings = planned_crossings(transfer.plan, read_robot(request.robot).elbows_pass)
    return {
        "robot": request.robot,
        "controller": request.controller,
        "working_mode": list(request.start.working_mode),
        "start": {"x": start[0], "y": start[1], "assembly_mode": sign_name(transfer.assembly_start)},
        "goal": {"x": goal[0], "y": goal[1], "assembly_mode": sign_name(transfer.assembly_goal)},
        "waypoints": [list(point) for point in transfer.waypoints],
        "durations_s": list(transfer.durations),
        "blend_radius": list(transfer.course.blend_radius),
        "time_law": None if request.trajectory else transfer.course.time_law,
        "duration_s": sum(transfer.durations),
        "crossings": [
            {
                "time_s": planned.time_s,
                "x": planned.x,
                "y": planned.y,
                "distal_links": planned.distal_links,
                "elbows_pass": planned.elbows_pass,
                "speed_m_s": transfer.speed_at(crossing),
                "direction": crossing.authority,
            }
            for planned, crossing in zip(crossings, transfer.crossings, strict=True)
        ],
        "figures": [
            {
                "name": figure.name,
                "value": figure.value,
                "limit": figure.limit,
                "limit_is": "most" if figure.at_most else "least",
                "unit": figure.unit,
                "time_s": figure.time,
                "x": figure.x,
                "y": figure.y,
            }
            for figure in transfer.feasibility.figures
        ],
        "odds": likely.known_odds,
        "planning_s": planning_s,
    }


def as_text(request: Request, likely: PlannedMotion[Transfer], planning_s: float) -> RenderableType:
    """Return a transfer as lines and tables."""
    transfer = likely.motion
    start, goal = transfer.waypoints[0], transfer.waypoints[-1]
    parts = transfer.course.between_rests()
    unknown = read_robot(request.robot).elbows_pass == UNKNOWN
    how = f"in {len(parts)} segments, time law {transfer.course.time_law}"
    if request.trajectory:
        how = "through the rows of its file"
    lines = [
        f"from {place(*start)}, assembly mode {sign_name(transfer.assembly_start)}",
        f"to   {place(*goal)}, assembly mode {sign_name(transfer.assembly_goal)}",
        f"in working mode {mode_name(request.start.working_mode)} by {request.controller},"
        f" {sum(transfer.durations):.3f} s {how}; planned in {planning_s:.2f} s",
    ]
    for index, (part, segment) in enumerate(zip(parts, transfer.plan.path.segments, strict=True)):
        points = " to ".join(place(*point) for point in part.waypoints)
        rounded = f", corners rounded within {', '.join(f'{r:g}' for r in part.blend_radius)} m" if part.rounded else ""
        lines.append(f"segment {index + 1}: {points}{rounded} in {segment.duration:.3f} s")
        lines += [
            f"  crosses the Type 2 locus at {place(crossing.x, crossing.y)} after"
            f" {crossing.time:.3f} s at {transfer.speed_at(crossing):.3f} m/s, distal links {crossing.distal_links}"
            + (f": {ELBOWS_UNKNOWN}" if unknown and crossing.distal_links == FOLDED else "")
            for crossing in transfer.crossings
            if crossing.segment == index
        ]
    if likely.odds is not None:
        lines.append(f"odds: {likely.odds}")
    if likely.chosen:
        lines.append(f"chosen for its odds: {likely.chosen}")
    if likely.better is not None:
        lines.append(f"better: in {likely.better.duration:.3g} s{likely.better.chosen} {likely.better.odds}")
    figures = Table("figure", "value", "limit", "at time", box=None)
    for figure in transfer.feasibility.figures:
        unit = f" {figure.unit}" if figure.unit else ""
        bound = "most" if figure.at_most else "least"
        figures.add_row(
            figure.name, f"{figure.value:.3g}{unit}", f"at {bound} {figure.limit:.3g}{unit}", f"{figure.time:.3f} s"
        )
    return Group(*lines, figures)
