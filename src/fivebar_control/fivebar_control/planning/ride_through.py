# SPDX-License-Identifier: Apache-2.0
"""How long the last torque may be held when a sample or a command is missing, known from the plan.

A held torque is wrong by as much as the planned one has changed since. What that difference does to the platform
follows from the direct dynamics, which are linear in the torque and regular on the Type 2 locus: G(t) = d xddot / d
tau along the reference, and the displacement is the double integral of G(t) (tau(t0) - tau(t)). That is of the first
order: what the displacement changes in turn, in G, in the inertial forces and in the friction of a joint that is
nearly at rest, is left out. Simulated holds displace the platform by up to a third less.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.laws.registry import TunedController
from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.state import State
from fivebar_control.planning.reference_scan import ReferenceTorque
from fivebar_control.trajectory.desired import desired_at
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar

DISPLACEMENT = 2e-3
"""Displacement (m) that a held torque may cause."""

LONGEST = 0.02
"""Longest time (s) for which a torque is held by default; common robot arms bear as much."""

GRID_HZ = 500
"""Rate (Hz) at which the plan is looked at, whatever the rate of the controllers."""


class HeldTorque(NamedTuple):
    """The effect of holding the torque of an earlier moment.

    Attributes:
        time: longest time (s) for which every torque of the motion may be held.
        displacement: of the platform at the end of that time, at the worst moment of the motion (m).
        worst: moment (s since sample 0) whose torque displaces the platform most.
    """

    time: float
    displacement: float
    worst: float


def longest_hold(
    robot: FiveBar,
    plan: Plan,
    follower: TunedController,
    torque_limit: float = math.inf,
    displacement: float = DISPLACEMENT,
    longest: float = LONGEST,
) -> HeldTorque:
    """Return for how long any torque of a plan may be held before the platform is displaced too far.

    Args:
        robot: of the controllers.
        plan: of the motion.
        follower: its controller.
        torque_limit: of both motors (Nm), infinite for none.
        displacement: that is allowed (m).
        longest: time (s) beyond which no torque is held in any case.
    """
    torques, effects = _along(robot, plan, follower, torque_limit)
    moments = np.arange(len(torques))
    speed, place = np.zeros((2, len(torques), 2))
    far = np.zeros(len(torques))
    held, most = 0, round(longest * GRID_HZ)
    for step in range(1, most + 1):
        # after its end the plan is at rest
        now = np.minimum(moments + step, len(torques) - 1)
        # no torque is known where the controller has none
        push = np.einsum("nij,nj->ni", effects[now], np.nan_to_num(torques - torques[now]))
        place = place + (speed + 0.5 * push / GRID_HZ) / GRID_HZ
        speed = speed + push / GRID_HZ
        reached = np.hypot(place[:, 0], place[:, 1])
        if np.max(reached) > displacement:
            break
        held, far = step, reached
    worst = int(np.argmax(far))
    return HeldTorque(longest if held == most else held / GRID_HZ, float(far[worst]), worst / GRID_HZ)


def _along(
    robot: FiveBar, plan: Plan, follower: TunedController, torque_limit: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return [n, 2], the planned torques (Nm), and [n, 2, 2], what they do to the platform (m/s^2 per Nm)."""
    needed = ReferenceTorque(robot, plan, GRID_HZ, follower)
    torques, effects = [], []
    for sample in range(plan.path.samples(GRID_HZ) + 1):
        t = sample / GRID_HZ
        reference = desired_at(robot, plan, t, plan.path.at(t))
        torques.append(needed(sample, reference))
        effects.append(_effect(robot, reference.state))
    return np.clip(np.array(torques), -torque_limit, torque_limit), np.array(effects)


def _effect(robot: FiveBar, state: State) -> list[list[float]]:
    """Return d xddot / d tau (1/(kg m)), rows x and y, columns motor 1 and 2."""
    none = direct_dynamics(robot, state, 0.0, 0.0, 0.0, 0.0)
    by_motor1 = direct_dynamics(robot, state, 1.0, 0.0, 0.0, 0.0)
    by_motor2 = direct_dynamics(robot, state, 0.0, 1.0, 0.0, 0.0)
    return [[by_motor1.ax - none.ax, by_motor2.ax - none.ax], [by_motor1.ay - none.ay, by_motor2.ay - none.ay]]
