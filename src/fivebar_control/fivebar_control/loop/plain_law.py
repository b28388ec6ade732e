# SPDX-License-Identifier: Apache-2.0
"""A law's part of the control cycle, in the interpreter."""

from __future__ import annotations

from fivebar_control.laws.law import TunedLaw
from fivebar_control.laws.reference import against_disturbance
from fivebar_control.laws.torque import Torque
from fivebar_control.loop.law_runner import LawRunner
from fivebar_control.loop.node_parts import NO_DISTURBANCE, FloatArray, JointValues, Pair, PlannedValues
from fivebar_control.loop.shared_results import shared_desired, shared_state
from fivebar_control.model.state import Platform
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar


class PlainLaw:
    """The law in the interpreter."""

    def __init__(self, law: TunedLaw, robot: FiveBar, plan: Plan, rate_hz: int, lead_samples: int) -> None:
        """As `LawPart`."""
        self._runner = LawRunner(law, robot, plan, rate_hz)
        self._robot, self._plan, self._rate_hz, self._lead = robot, plan, rate_hz, lead_samples

    def carry(self, robot: FiveBar) -> None:
        """As `LawPart`."""
        self._robot = robot
        self._runner.carry(robot)

    def follow(self, references: FloatArray) -> None:
        """As `LawPart`."""
        self._runner.follow(references)

    def expect(self, sample: int, planned: PlannedValues) -> None:
        """As `LawPart`."""
        shared_desired((sample + self._lead) / self._rate_hz, self._robot, self._plan, *planned)

    def answer(
        self,
        sample: int,
        joints: JointValues,
        planned: PlannedValues,
        disturbance: Pair = NO_DISTURBANCE,
        ahead: tuple[Platform, ...] | None = None,
    ) -> Torque:
        """As `LawPart`."""
        moment = sample + self._lead
        state = shared_state(sample, self._robot, *joints)
        reference = shared_desired(moment / self._rate_hz, self._robot, self._plan, *planned)
        if disturbance is not NO_DISTURBANCE:
            reference = against_disturbance(reference, *disturbance)
        return self._runner(moment, state, reference, ahead)
