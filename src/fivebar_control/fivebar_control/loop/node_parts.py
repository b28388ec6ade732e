# SPDX-License-Identifier: Apache-2.0
"""Parts of the control cycle, as the nodes of the graph have them: each answers the joints of a sample with its part.

A node takes its part plain, or by the clock the same as machine code (`part_choice`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from fivebar_control.loop.shared_results import Values, shared_state
from fivebar_control.loop.supervisor import Supervisor, SupervisorState
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar

if TYPE_CHECKING:
    from fivebar_control.laws.law import TunedLaw
    from fivebar_control.laws.torque import Torque
    from fivebar_control.model.state import Platform

FloatArray = NDArray[np.float64]

Pair = tuple[float, float]

JointValues = tuple[Values, Values]
"""Angles and rates (rad, rad/s) of q11, q12, q21, q22, as `joint_states` has them."""

PlannedValues = tuple[Values, Values]
"""`position` and `velocity` of `reference`: x, y, vx, vy and vx, vy, ax, ay."""

NO_DISTURBANCE = 0.0, 0.0


class SupervisorPart(Supervisor):
    """The supervisor of a robot."""

    def __init__(self, robot: FiveBar, plan: Plan, rate_hz: int, lead_samples: int, weighting: str) -> None:
        """Bind it to a robot, and to the plan so many samples ahead of the joints."""
        super().__init__(plan, rate_hz, weighting)
        self._robot = robot
        self._lead = lead_samples

    def answer(self, sample: int, joints: JointValues) -> SupervisorState:
        """Return sigma and kappa for the joints of a sample."""
        return self.at((sample + self._lead) / self._rate_hz, shared_state(sample, self._robot, *joints))


class LawPart(Protocol):
    """A law that answers samples."""

    def __init__(self, law: TunedLaw, robot: FiveBar, plan: Plan, rate_hz: int, lead_samples: int) -> None:
        """Bind a law to its robot, and to the plan so many samples ahead of the joints."""

    def carry(self, robot: FiveBar) -> None:
        """Go on with another mass of the platform."""

    def follow(self, references: FloatArray) -> None:
        """Go on with a motion that begins, or changes, with the next sample: float64[n, 6], its references."""

    def expect(self, sample: int, planned: PlannedValues) -> None:
        """Work out what follows from the reference of a sample, which comes before its joints."""

    def answer(
        self,
        sample: int,
        joints: JointValues,
        planned: PlannedValues,
        disturbance: Pair = NO_DISTURBANCE,
        ahead: tuple[Platform, ...] | None = None,
    ) -> Torque:
        """Return the torque (Nm) for the joints of a sample, NaN where the law is undefined.

        Args:
            sample: its number; once for every sample.
            joints: its joints.
            planned: its reference.
            disturbance: torques (Nm) on the motors that are to be compensated.
            ahead: the references of the samples that follow, for a law that looks ahead.
        """
