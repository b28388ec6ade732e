# SPDX-License-Identifier: Apache-2.0
"""Time that rounding the corners of a path saves against a rest at each via point: the shortest durations that pass.

Run as `python docs/studies/corner_study.py`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from fivebar_bringup.runs.screening import screened
from fivebar_bringup.scenario import Scenario
from fivebar_control.planning.figures import ERROR
from fivebar_control.trajectory.planner import PlanRefused
from fivebar_control.trajectory.time_laws import OPTIMAL, QUINTIC
from fivebar_description.rounding import in_millimetres

Point = tuple[float, float]

PATHS: dict[str, tuple[Point, ...]] = {
    "one via point, crossed after it": ((0.0, 0.15), (0.04, 0.13), (0.03, 0.02)),
    "two via points, crossed between them": ((0.0, 0.15), (0.05, 0.13), (0.04, 0.03), (0.0, 0.02)),
    "crossed in the corner": ((0.0, 0.15), (0.02, 0.075), (0.03, 0.02)),
    "through the locus and back": ((0.0, 0.15), (-0.03, 0.02), (0.03, 0.02), (0.0, 0.15)),
}
"""m, in the working mode (+, -) of DexTAR."""

RADII = (0.005, 0.01, 0.02)
"""m."""

LIMIT = 0.68
"""Torque limit (Nm) of the screen, which keeps its reserve of it."""

SHORTEST, LONGEST, ACCURACY = 0.1, 5.0, 1.005
"""Durations (s) between which the shortest one is sought, and the factor up to which it is found."""


def motion(points: Sequence[Point], duration: float, time_law: str, radius: float) -> Scenario:
    """Return the motion through points (m) in a duration (s), in proportion to its legs."""
    ways = [math.dist(*pair) for pair in pairwise(points)]
    return Scenario.model_validate(
        {
            "name": "study",
            "controller": "unified",
            "waypoints": points,
            "segment_duration": [duration * way / sum(ways) for way in ways],
            "time_law": time_law,
            "blend_radius": radius,
            "plant": {"torque_limit": LIMIT},
        }
    )


def predicted_error(points: Sequence[Point], duration: float, time_law: str, radius: float) -> float:
    """Return the predicted distance from the reference (m) of a motion, infinite where the screen refuses it."""
    scenario = motion(points, duration, time_law, radius)
    try:
        verdict = screened(scenario, scenario.plan())
    except PlanRefused:
        return math.inf
    return next(figure.value for figure in verdict.figures if figure.name == ERROR) if verdict.feasible else math.inf


def shortest(points: Sequence[Point], time_law: str, radius: float) -> float:
    """Return the shortest duration (s) that the screen lets pass; NaN where not even the longest does."""
    low, high = SHORTEST, LONGEST
    if math.isinf(predicted_error(points, high, time_law, radius)):
        return math.nan
    while high > ACCURACY * low:
        middle = math.sqrt(low * high)
        if math.isinf(predicted_error(points, middle, time_law, radius)):
            low = middle
        else:
            high = middle
    return high


def main() -> None:
    """Print the table."""
    print("| path | time law | with rests | " + " | ".join(f"{1e3 * radius:g} mm" for radius in RADII) + " |")
    print("|---|---|---|" + "---|" * len(RADII))
    for name, points in PATHS.items():
        for time_law in (QUINTIC, OPTIMAL):
            rests = sum(shortest(leg, time_law, 0.0) for leg in pairwise(points))
            cells = []
            for radius in RADII:
                duration = shortest(points, time_law, radius)
                error = predicted_error(points, duration, time_law, radius)
                cells.append("none" if math.isnan(duration) else f"{duration:.2f} s, {in_millimetres(error, 3)}")
            print(f"| {name} | {time_law} | {rests:.2f} s | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
