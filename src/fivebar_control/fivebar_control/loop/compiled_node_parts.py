# SPDX-License-Identifier: Apache-2.0
"""Parts of the control cycle as machine code, for nodes by the clock: the interpreter's answers, to the last bit.

Each is a generator that keeps its constants and its memory. A sample's numbers are put into one array and taken out of
another: to hand over states and references would take longer than to work out the answer.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from fivebar_control.compiling import compiled_and_kept
from fivebar_control.laws.blend import blend, blending_weight, forecast_width
from fivebar_control.laws.law import Instant, Law, TunedLaw, no_step, unchanged
from fivebar_control.laws.reference import against_disturbance, reference_from_platform
from fivebar_control.laws.torque import Torque
from fivebar_control.loop.guard_part import GuardPart
from fivebar_control.loop.node_parts import (
    NO_DISTURBANCE,
    FloatArray,
    JointValues,
    Pair,
    PlannedValues,
    SupervisorPart,
)
from fivebar_control.loop.plan_sample import planned_references
from fivebar_control.loop.shared_results import shared_desired
from fivebar_control.loop.supervisor import SupervisorState
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.model.line import Line
from fivebar_control.model.singularity import inverse_condition, inverse_condition_rate
from fivebar_control.model.state import Platform, State, WorkingMode
from fivebar_control.safety.guard import Decision
from fivebar_control.safety.settings import SafetySettings
from fivebar_control.safety.stages import NO_FAULT, Limits, excess_samples, first_fault, limited_torque
from fivebar_control.trajectory.desired import REFERENCE_VALUES, reference_of, write_reference
from fivebar_control.trajectory.joint_segment import JointSegment
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar, with_floats
from fivebar_description.settings import as_numbers

JOINT_VALUES = 8
"""Numbers with which all that is given begins: angles and rates of the joints."""


def state_given(robot: FiveBar, joints: FloatArray) -> State:
    """Return the state of the joints that are given."""
    return state_from_joints(
        robot, joints[0], joints[1], joints[2], joints[3], joints[4], joints[5], joints[6], joints[7]
    )


def weighing(robot: FiveBar, forecasts: bool, zone_time: float, inputs: FloatArray, out: FloatArray) -> Iterator[int]:
    """Weigh a sample at each step of the iterator.

    Args:
        robot: nominal robot.
        forecasts, zone_time: whether the zone is as wide as the state's speed makes it, for so long (s).
        inputs: float64[9]: joints, width of the zone.
        out: float64[2], filled by each step: sigma by the zone, kappa.
    """
    while True:
        state, epsilon = state_given(robot, inputs), inputs[8]
        kappa = inverse_condition(state)
        if forecasts:
            epsilon = forecast_width(inverse_condition_rate(state), zone_time, epsilon)
        out[0], out[1] = blending_weight(kappa, epsilon), kappa
        yield 0


step, after_gap = no_step, unchanged
"""The law, to be bound before."""


class LawConstants(NamedTuple):
    """The constants of a law: robot, working mode, sampling period (s) and its settings as numbers."""

    robot: FiveBar
    mode: WorkingMode
    period: float
    settings: Any


OF_SAMPLE = struct.Struct(f"{JOINT_VALUES + 3}d")
"""A law's sample: joints, disturbance (Nm), and whether samples before it are missing."""

OF_PLAN = struct.Struct("10d")
"""Its reference: x, y, vx, vy, ax, ay, direction and width of the zone, and whether its desired
instant follows, which is that of a motion in the motors' angles."""

FIRST_OF_PLAN = JOINT_VALUES + 3
FIRST_OF_INSTANT = FIRST_OF_PLAN + 10


def law_answering(constants: LawConstants, first: Any, inputs: FloatArray, out: FloatArray) -> Iterator[Any]:
    """Answer a sample at each step of the iterator, and yield the memory after it.

    Args:
        constants: of the law.
        first: its memory before the first sample.
        inputs: float64[FIRST_OF_INSTANT + REFERENCE_VALUES], as `OF_SAMPLE` and `OF_PLAN` say.
        out: float64[2], filled by each step: torques (Nm).
    """
    robot, memory = constants.robot, first
    while True:
        state, plan = state_given(robot, inputs), inputs[FIRST_OF_PLAN:]
        if plan[9] != 0.0:
            desired = reference_of(inputs[FIRST_OF_INSTANT:])
        else:
            platform = Platform(plan[0], plan[1], plan[2], plan[3], plan[4], plan[5])
            desired = reference_from_platform(robot, constants.mode, platform)
        reference = against_disturbance(desired, inputs[8], inputs[9])
        if inputs[10] != 0.0:
            memory = after_gap(memory)
        instant = Instant(
            state,
            reference,
            Line(reference.state.x, reference.state.y, plan[6], plan[7]),
            constants.mode,
            blending_weight(inverse_condition(state), plan[8]),
            constants.period,
            None,
        )
        torque, memory = step(robot, instant, memory, constants.settings)
        out[0], out[1] = torque.tau1, torque.tau2
        yield memory


OF_GUARD = struct.Struct(f"{JOINT_VALUES + 10}d")
"""The guard's sample: joints, where the platform should be (m), sigma, torques of the laws, the last
command (Nm), and for how many samples the request has been excessive."""

GUARDED = struct.Struct("6d")
"""Its answer: torques requested and commanded (Nm), excessive samples, number of the fault that is detected."""


def guarding(limits: Limits, robot: FiveBar, mode: WorkingMode, inputs: FloatArray, out: FloatArray) -> Iterator[int]:
    """Guard a sample at each step of the iterator.

    Args:
        limits: of the stages.
        robot, mode: nominal robot and its working mode.
        inputs: float64[18], as `OF_GUARD` says.
        out: float64[6], filled by each step as `GUARDED` says.
    """
    while True:
        state = state_given(robot, inputs)
        requested = blend(inputs[10], Torque(inputs[11], inputs[12]), Torque(inputs[13], inputs[14]))
        excess = excess_samples(limits, requested, int(inputs[17]))
        fault = first_fault(limits, robot, mode, state, inputs[8], inputs[9], requested, excess)
        command = limited_torque(limits, requested, Torque(inputs[15], inputs[16]))
        out[0], out[1], out[2], out[3] = requested.tau1, requested.tau2, command.tau1, command.tau2
        out[4], out[5] = excess, fault
        yield 0


_weighing = cache(lambda: compiled_and_kept(weighing))
_guarding = cache(lambda: compiled_and_kept(guarding))


@cache
def _law_answering(step: Callable[..., Any], after_gap: Callable[[Any], Any]) -> Any:
    return compiled_and_kept(law_answering, step=step, after_gap=after_gap)


class CompiledSupervisor(SupervisorPart):
    """The supervisor as machine code."""

    def __init__(self, robot: FiveBar, plan: Plan, rate_hz: int, lead_samples: int, weighting: str) -> None:
        """As `SupervisorPart`."""
        super().__init__(robot, plan, rate_hz, lead_samples, weighting)
        self._inputs, self._out = np.zeros(JOINT_VALUES + 1), np.zeros(2)
        self._steps = _weighing()(with_floats(robot), self.forecasts, float(plan.zone_time), self._inputs, self._out)

    def answer(self, sample: int, joints: JointValues) -> SupervisorState:
        """As `SupervisorPart`."""
        t = (sample + self._lead) / self._rate_hz
        position, velocity = joints
        self._inputs[:] = (*position, *velocity, self._plan.epsilon_at(t))
        next(self._steps)
        sigma, kappa = self._out.tolist()
        return SupervisorState(self.weight(t, kappa, 0.0) if self._in_time else sigma, kappa)


class CompiledLaw:
    """A law as machine code, see `LawPart`."""

    def __init__(self, law: TunedLaw, robot: FiveBar, plan: Plan, rate_hz: int, lead_samples: int) -> None:
        """As `LawPart`; the machine code is loaded, or made.

        Raises:
            numba.core.errors.NumbaError: the law is none that numba can compile.
        """
        self._law: Law = law.law
        self._robot, self._plan, self._rate_hz, self._lead = robot, plan, rate_hz, lead_samples
        self._settings = as_numbers(law.settings)
        self._by_motors = bool(plan.modes) or any(isinstance(segment, JointSegment) for segment in plan.path.segments)
        self._inputs, self._out = np.zeros(FIRST_OF_INSTANT + REFERENCE_VALUES), np.zeros(2)
        self._expected: tuple[int, PlannedValues | None] = -1, None
        self._last: int | None = None
        first = law.law.first_memory(
            robot, plan.mode, lambda: planned_references(plan, rate_hz), 1.0 / rate_hz, self._settings
        )
        # a sample that does not count, with the memory before it and that after it: whatever their types are
        self._begin(first)
        self._begin(next(self._steps))
        next(self._steps)
        self._begin(first)

    def _begin(self, memory: Any) -> None:
        self._memory = memory
        constants = LawConstants(with_floats(self._robot), self._plan.mode, 1.0 / self._rate_hz, self._settings)
        answers = _law_answering(self._law.step, self._law.after_gap)
        self._steps = answers(constants, memory, self._inputs, self._out)

    def carry(self, robot: FiveBar) -> None:
        """As `LawPart`."""
        self._robot = robot
        self._begin(self._memory)

    def follow(self, references: FloatArray) -> None:
        """As `LawPart`."""
        if self._law.follow is not None:
            self._begin(self._law.follow(self._memory, references))

    def expect(self, sample: int, planned: PlannedValues) -> None:
        """As `LawPart`."""
        (x, y, vx, vy), (_, _, ax, ay) = planned
        t = (sample + self._lead) / self._rate_hz
        _, _, direction_x, direction_y = self._plan.path.line_at(t)
        epsilon, by_motors = self._plan.epsilon_at(t), 0.0
        if self._by_motors:
            desired = shared_desired(t, self._robot, self._plan, *planned)
            write_reference(desired, self._inputs[FIRST_OF_INSTANT:])
            by_motors = 1.0
        numbers = (x, y, vx, vy, ax, ay, direction_x, direction_y, epsilon, by_motors)
        OF_PLAN.pack_into(self._inputs.data, 8 * FIRST_OF_PLAN, *numbers)
        self._expected = sample, planned

    def answer(
        self,
        sample: int,
        joints: JointValues,
        planned: PlannedValues,
        disturbance: Pair = NO_DISTURBANCE,
        ahead: tuple[Platform, ...] | None = None,
    ) -> Torque:
        """As `LawPart`, of a law that does not look ahead."""
        number, expected = self._expected
        if number != sample or expected is not planned:
            self.expect(sample, planned)
        missing = 0.0 if self._last is None or sample == self._last + 1 else 1.0
        self._last = sample
        position, velocity = joints
        OF_SAMPLE.pack_into(self._inputs.data, 0, *position, *velocity, *disturbance, missing)
        self._memory = next(self._steps)
        return Torque(*self._out.tolist())


class CompiledGuard(GuardPart):
    """The guard as machine code; a sample that shows a fault, and those after it, are the interpreter's."""

    def __init__(
        self, robot: FiveBar, working_mode: WorkingMode, rate_hz: int, settings: SafetySettings | None = None
    ) -> None:
        """As `Guard`."""
        super().__init__(robot, working_mode, rate_hz, settings)
        self._inputs, self._out = np.zeros(OF_GUARD.size // 8), np.zeros(GUARDED.size // 8)
        self._begin()

    def _begin(self) -> None:
        self._steps = _guarding()(self._limits, with_floats(self._robot), self._mode, self._inputs, self._out)

    def carry(self, robot: FiveBar) -> None:
        """As `Guard`."""
        super().carry(robot)
        self._begin()

    def answer(
        self,
        sample: int,
        joints: JointValues,
        desired: Pair,
        sigma: float,
        nominal: Torque,
        constraint: Torque,
    ) -> Decision:
        """As `GuardPart`."""
        if self.fault is None:
            position, velocity = joints
            torques = *nominal, *constraint, *self._last_command
            OF_GUARD.pack_into(self._inputs.data, 0, *position, *velocity, *desired, sigma, *torques, self._excess)
            next(self._steps)
            r1, r2, tau1, tau2, excess, fault = self._out.tolist()
            if fault == NO_FAULT:
                requested, command = Torque(r1, r2), Torque(tau1, tau2)
                self._excess = int(excess)
                self._last_command = command
                self._limited_samples += command != requested
                return Decision(requested, command)
        return super().answer(sample, joints, desired, sigma, nominal, constraint)
