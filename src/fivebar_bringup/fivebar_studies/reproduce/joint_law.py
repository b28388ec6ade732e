# SPDX-License-Identifier: Apache-2.0
"""How stiffly the joint-space law, as 3.18 asks for it, holds a path where it crosses the locus."""

from __future__ import annotations

import math

from fivebar_bringup.scenario import Scenario
from fivebar_control.laws.vhc_joint import JointConstraint, path_constraints
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.line import Line
from fivebar_studies.reproduce.cases import JOINT

STEP = 1e-4
"""Distance (m) for differences along the path."""

OBLIQUE = Scenario(
    name="oblique",
    controller=JOINT,
    working_mode=(1, 1),
    waypoints=((0.067, -0.086), (0.0195, 0.1207)),
    segment_duration=2.4,
)
"""A crossing with |n . v1| = 0.35 that the planner accepts."""


def shares_as_printed(scenario: Scenario) -> list[float]:
    """Return for each crossing of a scenario the stiffness across the path over Kp, with the gains on h of 3.18.

    It is 1 + (Kd mu sdot + nu sdot^2) / Kp with mu = p . p' / p . p and nu = p . p'' / p . p, p the change of the
    motors' angles across the path: docs/theory.md, section 12.
    """
    robot, plan, gains = scenario.five_bar(), scenario.plan(), scenario.gains
    shares = []
    for crossing in plan.crossings:
        at = plan.path.at(crossing.time)
        speed = math.hypot(at.vx, at.vy)
        d_x, d_y = at.vx / speed, at.vy / speed

        def ahead(
            s: float, x: float = at.x, y: float = at.y, d_x: float = d_x, d_y: float = d_y
        ) -> tuple[JointConstraint, JointConstraint]:
            state = state_from_platform(robot, scenario.working_mode, x + s * d_x, y + s * d_y, d_x, d_y)
            return path_constraints(robot, scenario.working_mode, state, Line(x, y, d_x, d_y))

        square = product = bend = 0.0
        for before, here, after in zip(ahead(-STEP), ahead(0.0), ahead(STEP), strict=True):
            square += here.across**2
            product += here.across * here.across_rate
            bend += here.across * (after.across_rate - before.across_rate) / (2.0 * STEP)
        stiffness = gains.kp_vhc + (gains.kd_vhc * speed * product + speed**2 * bend) / square
        shares.append(stiffness / gains.kp_vhc)
    return shares
