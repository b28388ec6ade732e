# SPDX-License-Identifier: Apache-2.0
"""The time law of the quickest passage under equal limits of the motors' whole torques, friction included.

Each motor's friction hinders it to accelerate and helps it to brake, and so much the more the larger its share in the
limit is. So the quickest passage depends on the duration: it is that of the least limit under which it takes no
longer.

What the average over a window changes at the Type 2 locus may be much, and then the bump that corrects it is costly.
So a passage is found besides that is held to the dynamic criterion, s'' = rho s'^2, about every crossing, for longer
than the window: that one is slower, but leaves next to nothing to correct. The law is the one that needs less torque.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fivebar_control.model.dynamics import inverse_dynamics_of_platform
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.state import WorkingMode
from fivebar_control.trajectory.optimal import (
    POINTS,
    CrossedWay,
    OptimalLaw,
    QuickPassage,
    bent_at_crossings,
    crossed_way,
    optimal_law,
    quickest_passage,
    with_law,
)
from fivebar_control.trajectory.path import Segment, Way
from fivebar_control.trajectory.rounded import RoundedSegment
from fivebar_control.trajectory.time_laws import OPTIMAL_WITH_FRICTION, Untimed
from fivebar_control.trajectory.time_scaling import progress
from fivebar_description.parameters import FiveBar, friction_torque, largest_friction

FloatArray = NDArray[np.float64]

SHARES = 100
"""Steps of the share that the larger friction has in the torque limit."""

MOST_SHARE = 90
"""The most of them: with a limit closer to friction a motion would creep, and brake by friction alone."""

INSTANTS = 200
"""At which the torque of a law is looked at, less one."""

HELD = 0.04
"""Share of the way on either side of a crossing within which the criterion holds, on a path of one leg."""

HELD_WITHIN = 1.0 / 300.0
"""Remainder of s'' - rho s'^2 there, as a share of what 1 Nm gives to s'' along the way."""


def optimal_law_with_friction(
    robot: FiveBar, mode: WorkingMode, path: CrossedWay, duration: float
) -> OptimalLaw | None:
    """Return the time law of a path that needs the least torque for a duration (s), in a working mode.

    None where there is none that keeps going forwards and meets the criterion.
    """
    laws = [optimal_law(robot, mode, path)]
    for held in (False, True):
        share = _share(robot, mode, path, held, duration)
        passage = _passage(robot, mode, path, held, share)
        laws.append(None if passage is None else bent_at_crossings(passage.law, path))
    return min(
        (law for law in laws if law is not None),
        key=lambda law: _torque(robot, mode, path.way, law, duration),
        default=None,
    )


def _torque(robot: FiveBar, mode: WorkingMode, way: Way, law: OptimalLaw, duration: float) -> float:
    """Return the largest torque (Nm) along a way that is passed by a law in a duration (s), friction included."""
    largest = 0.0
    for instant in range(1, INSTANTS):
        s, ds, dds = progress(law.__call__, instant / INSTANTS * duration, duration)
        x, y, d_x, d_y, b_x, b_y = way.at(s)
        state = state_from_platform(robot, mode, x, y, d_x * ds, d_y * ds)
        f1, f2 = friction_torque(robot.leg1, state.leg1.dq1), friction_torque(robot.leg2, state.leg2.dq1)
        a_x, a_y = d_x * dds + b_x * ds * ds, d_y * dds + b_y * ds * ds
        torques = inverse_dynamics_of_platform(robot, state, a_x, a_y, f1, f2)
        # on the locus itself there is none
        largest = max(largest, *(abs(torque) for torque in torques if math.isfinite(torque)))
    return largest


def _share(robot: FiveBar, mode: WorkingMode, path: CrossedWay, held: bool, duration: float) -> int:
    """Return the share, in steps, of the larger friction in the least limit under which a path takes a duration (s)."""
    friction = largest_friction(robot)

    def too_slow(share: int) -> bool:
        passage = _passage(robot, mode, path, held, share)
        return passage is None or passage.duration * math.sqrt(share / SHARES / friction) > duration

    if friction == 0.0:
        return 0
    # the less torque there is beyond friction, the longer it takes
    return bisect_left(range(1, MOST_SHARE + 1), True, key=too_slow)


@lru_cache(maxsize=128)
def _passage(robot: FiveBar, mode: WorkingMode, path: CrossedWay, held: bool, share: int) -> QuickPassage | None:
    """Return the quickest passage under a limit of which the larger friction takes a share, in steps."""
    # loaded by plans with this time law only
    from fivebar_control.trajectory.passage_torques import friction_along, torques_along

    torques = torques_along(robot, mode, path.way, POINTS)
    if share > 0:
        torques[0] += share / SHARES / largest_friction(robot) * friction_along(robot, mode, path.way, POINTS)
    if held:
        torques = np.concatenate((torques, _held(path, float(np.nanmedian(np.abs(torques[1]))))), axis=2)
    return quickest_passage(path.way, torques)


def _held(path: CrossedWay, torque: float) -> FloatArray:
    """Return the row that holds a path to the criterion about its crossings, [3, N, 1].

    `torque` (Nm s^2) is that for sddot = 1 along the way.
    """
    row = np.zeros((3, len(POINTS), 1))
    between = min((after - before for before, after in pairwise(path.crossed)), default=1.0)
    for share, ratio in zip(path.crossed, path.ratios, strict=True):
        reach = min(HELD / path.way.legs, 0.5 * share, 0.5 * (1.0 - share), 0.5 * between)
        near = np.abs(POINTS - share) <= reach
        row[1, near], row[2, near] = torque / HELD_WITHIN, -ratio * torque / HELD_WITHIN
    return row


def least_torque_with_friction(untimed: Untimed) -> Segment | RoundedSegment:
    """Return a segment with the time law that takes the least torque for its duration, friction included.

    Raises:
        PlanRefused: gravity or a constant force acts on the robot, or there is no such time law.
    """
    robot, mode, segment, *_ = untimed
    way = crossed_way(untimed, OPTIMAL_WITH_FRICTION)
    return with_law(untimed, optimal_law_with_friction(robot, mode, way, segment.duration))
