# SPDX-License-Identifier: Apache-2.0
"""Appendix A and section 3.3 in numbers: the free dynamics on the locus by Pinocchio, and the matrices of 3.45."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fivebar_bringup.bag.recording import FloatArray
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.model.state import State
from fivebar_description.closed_loop import ClosedLoop
from fivebar_studies.reproduce.cases import ReproductionCase

TORQUES = 40
"""Random torques per state."""

LARGEST_TORQUE = 10.0
"""Their range on either side of zero (Nm)."""

DISTANCES = tuple(10.0**exponent for exponent in np.arange(-9.0, -1.9, 0.5).tolist())
"""How far (m) from the locus, along the path, the figure looks."""

PRINTED = ((1.0, 1.0), (0.0, 0.0))
"""The result that 3.45 prints."""

Q11, Q12, Q21, Q22, BETA = 3.1218, -2.6846, 2.0933, -4.7977, 0.4373
"""The angles (rad) that 3.45 prints."""


class FreeDynamics(NamedTuple):
    """Pinocchio's accelerations under arbitrary torques in the states of planned crossings.

    Attributes:
        states: number of states on the locus.
        torques: number of random torques in each.
        along: largest |m t_s^T xddot| of all of them (N).
        force: largest |m xddot| (N).
        distance: [n], distances from the locus along one path (m).
        along_at_distance: [n], the largest |m t_s^T xddot| there (N).
    """

    states: int
    torques: int
    along: float
    force: float
    distance: FloatArray
    along_at_distance: FloatArray


def free_dynamics(cases: Sequence[ReproductionCase], seed: int = 1) -> FreeDynamics:
    """Try random torques at every planned crossing of the cases, moving as the reference does there."""
    random = np.random.default_rng(seed)
    along = force = 0.0
    states = 0
    for case in cases:
        scenario = case.scenario()
        robot, plan = scenario.five_bar(), scenario.plan()
        loop = ClosedLoop(robot)
        for crossing in plan.crossings:
            motion = plan.path.at(crossing.time)
            state = state_from_platform(robot, plan.mode, *motion[:4])
            here_along, here_force = _largest(loop, state, robot.mass, random)
            along, force, states = max(along, here_along), max(force, here_force), states + 1
    return FreeDynamics(states, TORQUES, along, force, *_beside_the_locus(cases[0], random))


def _beside_the_locus(case: ReproductionCase, random: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    scenario = case.scenario()
    robot, plan = scenario.five_bar(), scenario.plan()
    loop, crossing = ClosedLoop(robot), plan.crossings[0]
    motion = plan.path.at(crossing.time)
    line = plan.path.line_at(crossing.time)
    largest_forces = []
    for distance in DISTANCES:
        x, y = motion.x + distance * line.direction_x, motion.y + distance * line.direction_y
        state = state_from_platform(robot, plan.mode, x, y, motion.vx, motion.vy)
        largest_forces.append(_largest(loop, state, robot.mass, random)[0])
    return np.array(DISTANCES), np.array(largest_forces)


def _largest(loop: ClosedLoop, state: State, mass: float, random: np.random.Generator) -> tuple[float, float]:
    """Return the largest |m t_s^T xddot| and |m xddot| (N) that random torques cause in a state."""
    leg1, leg2 = state.leg1, state.leg2
    q = np.array([leg1.q1, leg1.q2, leg2.q1, leg2.q2])
    v = np.array([leg1.dq1, leg1.dtheta - leg1.dq1, leg2.dq1, leg2.dtheta - leg2.dq1])
    svd = parallel_svd(state)
    along = force = 0.0
    for tau1, tau2 in random.uniform(-LARGEST_TORQUE, LARGEST_TORQUE, (TORQUES, 2)).tolist():
        acceleration = loop.acceleration(q, v, np.array([tau1, 0.0, tau2, 0.0]))
        ax, ay = loop.platform(q, v, acceleration)[2].tolist()
        along = max(along, mass * abs(svd.t_x * ax + svd.t_y * ay))
        force = max(force, mass * math.hypot(ax, ay))
    return along, force


class Rotated(NamedTuple):
    """The matrix A^T of 3.45, turned as printed and turned back, and how far either is from the printed result."""

    as_printed: FloatArray
    transposed: FloatArray
    difference_as_printed: float
    difference_transposed: float
    second_row: float


def rotated() -> Rotated:
    """Work 3.45 out from its own angles, with R(beta) and with its transpose."""
    rotation = np.array([[math.cos(BETA), -math.sin(BETA)], [math.sin(BETA), math.cos(BETA)]])
    theta1, theta2 = Q11 + Q12, Q21 + Q22
    a_transposed = np.array([[math.cos(theta1), math.cos(theta2)], [math.sin(theta1), math.sin(theta2)]])
    forward, backward = rotation @ a_transposed, rotation.T @ a_transposed
    printed = np.array(PRINTED)
    return Rotated(
        forward,
        backward,
        float(np.abs(forward - printed).max()),
        float(np.abs(backward - printed).max()),
        float(np.abs(backward[1]).max()),
    )
