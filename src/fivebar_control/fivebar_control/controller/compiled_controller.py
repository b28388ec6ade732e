# SPDX-License-Identifier: Apache-2.0
"""The controller of a motion with law, guard and filter as machine code: the same torques, in a tenth of the time."""

from __future__ import annotations

import numpy as np

from fivebar_control.compiling import compiled_and_kept
from fivebar_control.controller.answering import (
    CLEARED,
    EVENT,
    FIRST_OF_PLAN,
    GIVEN,
    RESULTS,
    SAMPLE,
    STOPPED,
    FloatArray,
    answering,
)
from fivebar_control.controller.estimator import estimator_of
from fivebar_control.controller.motion_controller import NOWHERE, KnownJoints, LoopAnswer, MotionController
from fivebar_control.estimation.compiled_estimator import CompiledEstimator
from fivebar_control.estimation.estimator import StateEstimator
from fivebar_control.laws.torque import Torque
from fivebar_control.loop.cycle import CycleMemory
from fivebar_control.loop.sampled_plan import plan_row, sampled
from fivebar_control.model.state import Platform
from fivebar_control.planning.motion_queue import Goal
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_description.errors import InputError


class CompiledController(MotionController):
    """As `MotionController`, of a law that numba compiles.

    The first one of a law in an installation compiles for a minute; then the code is loaded from disk.
    """

    def __init__(self, scenario: ControlScenario, longest_hold: int | None = None) -> None:
        """Make a controller before its first sample, and load its machine code.

        Raises:
            InputError: as `MotionController`, or the law cannot be compiled.
        """
        law = scenario.scheme()
        if not law.compiles:
            raise InputError(f"compiled: controller {law.name} cannot be compiled: expected False")
        self._inputs, self._out = np.zeros(GIVEN), np.zeros(RESULTS)
        super().__init__(scenario, longest_hold)

    def _new_estimator(self) -> StateEstimator:
        estimator = estimator_of(self._scenario, kind=CompiledEstimator)
        estimator.warm_up()
        return estimator

    def _begin_loop(self, memory: CycleMemory) -> None:
        plan = sampled(self._control.robot, self._plan, self._rate_hz, self._settings.lead)
        self._rows, self._first_row, self._row = plan.rows, 0, plan.rows[0]
        answers = compiled_and_kept(answering, **self._of_laws)
        self._answers = answers(self._settings, memory, plan.references, self._inputs, self._out)

    def request(self, goal: Goal) -> None:
        """Plan a motion from where the robot rests and begin it, as `MotionController` does."""
        super().request(goal)
        queue = self._motions()
        self._tabulate(queue.resting_from() - self._moment + 1)

    def _rest(self, x: float, y: float) -> None:
        super()._rest(x, y)
        self._tabulate(1)

    def _tabulate(self, samples: int) -> None:
        """Keep the rows of so many samples from the next one on, at whose end the reference rests."""
        queue, first = self._motions(), self._moment
        moments = range(first, first + samples)
        self._rows = np.array([plan_row(self._plan, moment / self._rate_hz, queue.at(moment)) for moment in moments])
        self._first_row = first

    def _row_at(self, moment: int) -> FloatArray:
        row: FloatArray = self._rows[min(moment - self._first_row, len(self._rows) - 1)]
        return row

    def _clear_loop(self) -> None:
        self._inputs[EVENT] = CLEARED
        next(self._answers)

    def _answered(self, number: int, sensed: KnownJoints) -> LoopAnswer:
        moment = number + self._settings.lead
        row, inputs = self._row_at(moment), self._inputs
        inputs[:FIRST_OF_PLAN] = (
            number,
            moment,
            SAMPLE,
            *sensed.disturbance,
            sensed.trip,
            *sensed.position,
            *sensed.velocity,
        )
        inputs[FIRST_OF_PLAN:] = row
        next(self._answers)
        return self._response_with(row)

    def _stopped(self, number: int) -> LoopAnswer:
        self._inputs[0], self._inputs[EVENT] = number, STOPPED
        next(self._answers)
        return self._unanswered(number)

    def _unanswered(self, number: int) -> LoopAnswer:
        return self._response_with(self._row_at(number + self._settings.lead))._replace(place=NOWHERE)

    def _response_with(self, row: FloatArray) -> LoopAnswer:
        x, y, vx, vy, sigma, kappa, n1, n2, c1, c2, r1, r2, tau1, tau2, detected, fault, latched = self._out.tolist()
        return LoopAnswer(
            place=(x, y, vx, vy),
            reference=Platform(*row[:6].tolist()),
            sigma=sigma,
            kappa=kappa,
            nominal=Torque(n1, n2),
            constraint=Torque(c1, c2),
            requested=Torque(r1, r2),
            command=Torque(tau1, tau2),
            found=int(detected),
            fault=int(fault),
            latched=latched > 0.0,
        )
