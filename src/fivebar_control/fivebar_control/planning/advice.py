# SPDX-License-Identifier: Apache-2.0
"""Changes that would make a motion safe that is refused for the robot's tolerances: one at a time, tried out."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

from fivebar_control.estimation.settings import Sensing
from fivebar_control.laws.registry import TunedController
from fivebar_control.planning.feasibility import with_sensing
from fivebar_control.planning.figures import UNCERTAINTY, WRONG_MODE, Feasibility
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.planning.predicted_run import predict_run
from fivebar_control.trajectory.path import Path
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar
from fivebar_description.sensors import PassiveEncoder
from fivebar_description.tolerances import Tolerances

QUICKER = (1.25, 1.5, 2.0)
"""Factors on the speed that are tried."""

HALVINGS = 5
"""How often a tolerance is halved."""

MEASURED = {"length": ("lengths", "mm"), "base": ("base joints", "mm"), "zero": ("encoder zeros", "mrad")}
"""Fields of `Tolerances` that one calibrates, in words, and the unit that is a thousandth of theirs."""

Judge = Callable[[Sensing], bool]
"""Whether a motion is feasible with a sensing."""


def concerns_tolerances(verdict: Feasibility) -> bool:
    """Return whether a motion is refused for what the robot's tolerances make of it, and for nothing else."""
    beyond = {figure.name for figure in verdict.figures if not figure.kept}
    return bool(beyond) and beyond <= {WRONG_MODE, UNCERTAINTY}


def judge_of(robot: FiveBar, plan: Plan, rate_hz: int, follower: TunedController, limits: MotionLimits) -> Judge:
    """Return what judges a plan with other sensings, where nothing but tolerances speaks against it."""
    predicted = predict_run(robot, plan, rate_hz, follower, limits.torque, limits.judge)
    return lambda sensing: with_sensing(Feasibility(()), predicted, robot, plan, limits, sensing).feasible


def advice(
    verdict: Feasibility,
    path: Path,
    sensing: Sensing,
    judge: Judge,
    possible: Callable[[float], bool] = lambda factor: False,
) -> str:
    """Return what would make a motion feasible: the least change of each kind that does, "" where none is found.

    Args:
        verdict: which refuses the motion.
        path: of the motion.
        sensing: with which it was judged.
        judge: whether it would be feasible otherwise.
        possible: whether it would be feasible so many times as fast; by default that is not tried.
    """
    kinds = (
        _gyroscope(sensing, judge),
        _passive_encoder(sensing, judge),
        _speed(verdict, path, possible),
        _calibration(sensing, judge),
    )
    suggestions = [next(kind, "") for kind in kinds]
    return ", or ".join(words for words in suggestions if words)


def _gyroscope(sensing: Sensing, judge: Judge) -> Iterator[str]:
    settings = sensing.settings
    if not settings.gyro and judge(sensing._replace(settings=settings._replace(gyro=True))):
        yield "a gyroscope on the distal link of leg 2 (ekf: {gyro: true})"


def _passive_encoder(sensing: Sensing, judge: Judge) -> Iterator[str]:
    for leg in (1, 2) if sensing.passive.leg == 0 else ():
        if judge(sensing._replace(passive=PassiveEncoder(leg))):
            yield f"an encoder on the passive joint of leg {leg} (sensors: {{passive_encoder: {{leg: {leg}}}}})"


def _speed(verdict: Feasibility, path: Path, possible: Callable[[float], bool]) -> Iterator[str]:
    worst = next(figure for figure in verdict.figures if figure.name in (WRONG_MODE, UNCERTAINTY) and not figure.kept)
    there = path.at(min(worst.time, path.duration))
    for factor in QUICKER:
        if possible(factor):
            speed = factor * math.hypot(there.vx, there.vy)
            yield f"{factor:g} times the speed (there {speed:.2g} m/s)"


def _calibration(sensing: Sensing, judge: Judge) -> Iterator[str]:
    declared = [field for field in MEASURED if getattr(sensing.tolerances, field) > 0.0]
    for fields in (*([field] for field in declared), declared):
        if not judge(_within(sensing, fields, 0.0)):
            continue
        for halvings in range(1, HALVINGS + 1):
            changed = _within(sensing, fields, 0.5**halvings)
            if judge(changed):
                yield " and ".join(_known_to(changed.tolerances, field) for field in fields)
                break


def _within(sensing: Sensing, fields: Sequence[str], share: float) -> Sensing:
    changed = {field: share * getattr(sensing.tolerances, field) for field in fields}
    return sensing._replace(tolerances=sensing.tolerances._replace(**changed))


def _known_to(tolerances: Tolerances, field: str) -> str:
    words, unit = MEASURED[field]
    return f"{words} known to ±{1e3 * getattr(tolerances, field):.2g} {unit}"
