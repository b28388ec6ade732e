# SPDX-License-Identifier: Apache-2.0
"""Runs a law over the samples of a run, bound to its robot, plan and settings, with its memory."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fivebar_control.laws.blend import blending_weight
from fivebar_control.laws.law import Instant, TunedLaw
from fivebar_control.laws.reference import Reference
from fivebar_control.laws.torque import Torque
from fivebar_control.loop.plan_sample import planned_references, reference_ahead
from fivebar_control.model.line import Line
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.model.state import Platform, State
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar
from fivebar_description.settings import as_numbers

FloatArray = NDArray[np.float64]


class LawRunner:
    """Computes a law's torque sample by sample."""

    def __init__(self, law: TunedLaw, robot: FiveBar, plan: Plan, rate_hz: int, memory: Any = None) -> None:
        """Bind a law to its nominal robot, a plan and a sampling rate (Hz); by default with its first memory."""
        self._law = law.law
        self._ahead = law.samples_ahead
        self._settings = as_numbers(law.settings)
        self._robot = robot
        self._plan = plan
        self._rate_hz = rate_hz
        if memory is None:
            memory = self._law.first_memory(
                robot, plan.mode, lambda: planned_references(plan, rate_hz), 1.0 / rate_hz, self._settings
            )
        self.memory = memory
        """Memory of the law before the next sample."""
        self._last: int | None = None

    def carry(self, robot: FiveBar) -> None:
        """Go on with another mass of the platform."""
        self._robot = robot

    def follow(self, references: FloatArray) -> None:
        """Go on with a motion that begins, or changes, with the next sample: float64[n, 6], its references."""
        if self._law.follow is not None:
            self.memory = self._law.follow(self.memory, references)

    def __call__(
        self, sample: int, state: State, reference: Reference, ahead: tuple[Platform, ...] | None = None
    ) -> Torque:
        """Return the torque (Nm) for a sample, NaN where the law is undefined; call it once for every sample.

        The constraint's line runs through the reference: during the motion that is the path segment itself, and after a
        fault, where the reference stays at the robot, no feedback acts towards the path. A law that looks ahead
        is given `ahead`, or else the plan.
        """
        if self._last is not None and sample != self._last + 1:
            self.memory = self._law.after_gap(self.memory)
        self._last = sample
        plan, t = self._plan, sample / self._rate_hz
        if ahead is None and self._ahead:
            ahead = reference_ahead(plan, sample, self._rate_hz, self._ahead)
        segment = plan.path.line_at(t)
        instant = Instant(
            state,
            reference,
            Line(reference.state.x, reference.state.y, segment.direction_x, segment.direction_y),
            plan.mode,
            blending_weight(inverse_condition(state), plan.epsilon_at(t)),
            1.0 / self._rate_hz,
            ahead,
        )
        torque, self.memory = self._law.step(self._robot, instant, self.memory, self._settings)
        return torque
