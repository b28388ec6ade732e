# SPDX-License-Identifier: Apache-2.0
"""The controller of a motion: answers each sample's readings with a torque, and owns neither robot nor clock.

It estimates, refers, supervises, lets the laws answer, blends and guards, by the functions that the nodes of the graph
and the engine call.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fivebar_control.controller.settings import cycle_settings
from fivebar_control.fault import Fault
from fivebar_control.laws.registry import goal_controllers
from fivebar_control.laws.torque import ZERO, Torque
from fivebar_control.loop.closed_loop import (
    Answered,
    Known,
    LoopSettings,
    answer,
    cleared,
    first_memory,
    law_functions,
    stopped,
    unanswered,
)
from fivebar_control.loop.cycle import CycleMemory
from fivebar_control.loop.plan_sample import PlanSample, plan_sample, planned_references, reference_ahead
from fivebar_control.model.kinematics import assembly_mode, state_from_joints, working_mode
from fivebar_control.model.state import JointAngles, Platform, State
from fivebar_control.safety.stages import NO_FAULT, fault_of, first_fault
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_description.errors import InputError
from fivebar_description.readings import Pair, Quadruple, SensorReadings

if TYPE_CHECKING:
    from fivebar_control.estimation.estimator import StateEstimator, Vector6
    from fivebar_control.planning.motion_queue import Goal, MotionQueue

NOWHERE = (math.nan,) * 4

OFF_GRID = 0.01
"""Distance (samples) of a time from a sample's up to which it names that sample."""


class StillFaulty(RuntimeError):
    """A latched fault that cannot be cleared, and the reason."""


class StateEstimate(NamedTuple):
    """The robot as the laws see it, at the moment at which the answering torque begins to act.

    Attributes:
        position, velocity: of q11, q12, q21, q22 (rad, rad/s), measured or estimated.
        effort: torques applied over the period before the sample (Nm), 0 for the passive joints.
        x, y, vx, vy: of the platform (m, m/s).
        deviations: standard deviations of x, y (m), vx, vy (m/s), d1, d2 (Nm); None where all joints are measured.
        disturbance: torques on the motors besides the commanded ones (Nm), 0 where all joints are measured.
    """

    position: Quadruple
    velocity: Quadruple
    effort: Quadruple
    x: float
    y: float
    vx: float
    vy: float
    deviations: Vector6 | None = None
    disturbance: Pair = (0.0, 0.0)


class ControlOutput(NamedTuple):
    """The answer to a sample.

    Attributes:
        sample: its number.
        torque: to be applied until the next one (Nm).
        fault: latched, None while the robot may move.
        sigma: weight of the constraint law, 0 off the Type 2 locus.
        kappa: 1/cond(A), 0 on the locus.
        estimate: the robot's state; None where no sample has come yet.
        reference: where the platform should be then (m, m/s, m/s^2).
        nominal, constraint: torques of the laws (Nm), NaN where undefined; None for no constraint law.
        requested: their blend before limits (Nm), None once a fault is latched.
    """

    sample: int
    torque: Torque
    fault: Fault | None
    sigma: float
    kappa: float
    estimate: StateEstimate | None
    reference: Platform
    nominal: Torque
    constraint: Torque | None
    requested: Torque | None

    def __repr__(self) -> str:
        """Return sample, torque and fault."""
        fault = "" if self.fault is None else f", {self.fault}"
        return f"<ControlOutput {self.sample}: {self.torque.tau1:.4g}, {self.torque.tau2:.4g} Nm{fault}>"


class KnownJoints(NamedTuple):
    """The joints of a sample, measured or estimated: as in `StateEstimate`, and the fault of the estimator."""

    position: Quadruple
    velocity: Quadruple
    effort: Quadruple
    deviations: Vector6 | None
    disturbance: Pair
    trip: int


class LoopAnswer(NamedTuple):
    """The loop's answer to a sample.

    Attributes:
        place: x, y, vx, vy of the platform (m, m/s).
        reference: as in `ControlOutput`, and so are `sigma`, `kappa` and the torques.
        found: number of the fault detected at the sample, `NO_FAULT` for none.
        fault: that of the first one.
        latched: whether one was latched before.
    """

    place: Quadruple
    reference: Platform
    sigma: float
    kappa: float
    nominal: Torque
    constraint: Torque
    requested: Torque
    command: Torque
    found: int
    fault: int
    latched: bool


class MotionController:
    """Law, estimator and guard of a scenario, to be stepped once a period."""

    _loop: Answered

    def __init__(self, scenario: ControlScenario, longest_hold: int | None = None) -> None:
        """Make a controller before its first sample.

        Args:
            scenario: motion, law, estimator, limits.
            longest_hold: lost samples in a row over which the last torque is held, None for any number.

        Raises:
            InputError: the motion is refused, or the estimator cannot begin where it does.
        """
        self._scenario, self._longest_hold = scenario, longest_hold
        self._robot, self._plan, self._rate_hz = scenario.five_bar(), scenario.plan(), scenario.rate_hz
        tuned, scheme = tuned_controller(scenario), scenario.scheme()
        self._laws, self._of_laws, self._ahead = scheme.laws, law_functions(scheme), tuned.samples_ahead
        self._control = cycle_settings(scenario)
        last, lead = self._plan.path.samples(self._rate_hz), scenario.lead_samples
        self._settings = LoopSettings(self._control, 0, last, lead, scenario.compensates_disturbance)
        self._scheme = scheme
        self.reset()

    def reset(self) -> None:
        """Begin the motion again, with a robot at rest where it starts; a latched fault is cleared."""
        self._estimator = self._new_estimator() if self._scenario.estimated else None
        self._queue: MotionQueue | None = None
        memory = first_memory(self._scheme, self._control, lambda: planned_references(self._plan, self._rate_hz))
        self._begin_loop(memory)
        self._sensed: KnownJoints | None = None
        self._estimate: StateEstimate | None = None
        self._waiting: SensorReadings | None = None
        self._commands: list[Torque] = [ZERO] * (self._scenario.plant.delay_samples + 1)
        self._output: ControlOutput | None = None
        self._number, self._came, self._last = -1, -1, self._settings.last
        self.fault: Fault | None = None
        """The latched fault, None while the robot may move."""

    @property
    def finished(self) -> bool:
        """Whether the motion's last sample has been answered; from then on the robot is held where it ends."""
        return self._number >= self._last

    @property
    def period(self) -> float:
        """Time from one sample to the next (s)."""
        return self._control.period

    @property
    def scenario(self) -> ControlScenario:
        """The scenario of the motion."""
        return self._scenario

    def begin_at(self, joints: Sequence[float]) -> None:
        """Begin with a robot that rests elsewhere, and hold it there until a request; a latched fault is cleared.

        Args:
            joints: q11, q12, q21, q22 (rad), in the working mode of the scenario.

        Raises:
            InputError: the legs do not meet so, the working mode is another one, or the estimator cannot begin there.
        """
        angles = SensorReadings(joint_angles=tuple(joints))  # type: ignore[arg-type]
        angles.check()
        state = state_from_joints(self._robot, *JointAngles(*joints), 0.0, 0.0, 0.0, 0.0)
        if working_mode(state) != tuple(self._scenario.working_mode):
            raise InputError(
                f"posture: it has the working mode {list(working_mode(state))}: expected that of the scenario,"
                f" {list(self._scenario.working_mode)}"
            )
        self.reset()
        if self._estimator is not None:
            from fivebar_control.estimation.homing import Homing

            self._estimator.begin_at(Homing(state.x, state.y, working_mode(state), assembly_mode(state)))
        self._rest(state.x, state.y)
        self._last = -1

    def step(self, readings: SensorReadings | None = None) -> ControlOutput:
        """Answer a sample.

        The same time again gets the same answer. Where samples are lost, the last torque is held, and after too many
        of them the fault `state_stale` is latched.

        Args:
            readings: of the sample; None for a lost one.

        Raises:
            InputError: readings are malformed, or not those that the scenario's controller needs; the time is that of
                no sample or goes back; the robot does not rest where the motion starts (`HomingContradicted`).
        """
        if readings is None:
            readings = SensorReadings()
        readings.check()
        self._check_sufficient(readings)
        number = self._number_of(readings.time)
        if number == self._number and self._output is not None:
            return self._output
        # over samples that were left out the last torque held
        self._commands += self._commands[-1:] * (number - self._number - 1)
        self._number = number
        sensed = self._sensed = self._sensed_by(readings)
        if sensed is None:
            response = self._held(number)
        else:
            response = self._answered(number, sensed)
            self._came = number
            position, velocity, effort, deviations, disturbance, _ = sensed
            self._estimate = StateEstimate(position, velocity, effort, *response.place, deviations, disturbance)
            if response.fault != NO_FAULT and self.fault is None:
                self.fault = self._in_words(response, sensed)
            if self._estimator is not None:
                self._estimator.commanded(number, *response.command)
        self._commands.append(response.command)
        self._output = ControlOutput(
            number,
            response.command,
            self.fault,
            response.sigma,
            response.kappa,
            self._estimate,
            response.reference,
            response.nominal,
            response.constraint if self._control.blended else None,
            None if response.latched else response.requested,
        )
        return self._output

    def clear(self) -> None:
        """Clear a latched fault whose cause is gone; the robot is held where it rests, until a request or a reset.

        Raises:
            StillFaulty: the cause is still there, the robot moves, or only a new beginning clears the fault.
        """
        if self.fault is None:
            return
        # here, because most runs have no fault
        from fivebar_control.safety.guard import FINAL_FAULTS, motion_left

        if self.fault.name in FINAL_FAULTS:
            raise StillFaulty(f"only a new beginning clears {self.fault}: expected a reset")
        if self._sensed is None:
            raise StillFaulty("no sample has come since")
        state, control = self._state_of(self._sensed), self._control
        arguments = control.limits, control.robot, control.mode, state, state.x, state.y, ZERO
        fault_number = first_fault(*arguments)
        reason = motion_left(state, self._scenario.safety.rest_speed)
        if fault_number != NO_FAULT:
            reason = str(fault_of(fault_number, *arguments, 0.0))
        if reason is not None:
            raise StillFaulty(reason)
        self.fault = None
        self._clear_loop()
        self._rest(state.x, state.y)
        self._last = self._number

    def request(self, goal: Goal) -> None:
        """Plan a motion from where the robot rests, judge it as requests to the graph are, and begin it.

        Raises:
            PlanRefused: the robot still moves or a fault is latched, the law takes no further motions, or there is no
                feasible one.
        """
        from fivebar_control.planning.motion_queue import GoalRefused
        from fivebar_control.planning.order_planning import plan_once
        from fivebar_control.scenario.goal_conditions import conditions_of

        if self._scenario.controller not in goal_controllers():
            raise GoalRefused(f"requests are not taken: they need controller {' or '.join(goal_controllers())}")
        if self.fault is not None:
            raise GoalRefused("a fault holds the robot where it stands: clear it first")
        queue, moment = self._motions(), self._moment
        planned = plan_once(conditions_of(self._scenario), queue.request(moment, goal))
        if planned.refused:
            queue.cancel()
            raise GoalRefused(planned.refused)
        queue.begin(moment, planned.path(), planned.references)
        if planned.references:
            self._follow(np.array(planned.references).reshape(-1, len(Platform._fields)))
        self._last = queue.resting_from() - self._settings.lead

    @property
    def _moment(self) -> int:
        """The moment of the reference that answers the next sample."""
        return self._number + 1 + self._settings.lead

    def _motions(self) -> MotionQueue:
        """Return the queue of motions, which takes over from the plan."""
        if self._queue is None:
            # here, because a single motion needs none
            from fivebar_control.planning.motion_queue import MotionQueue

            self._queue = MotionQueue(self._plan, self._rate_hz)
        return self._queue

    def _follow(self, references: np.ndarray) -> None:
        """Tell the laws that need whole motions of one that begins with the next sample."""
        memory = self._loop.cycle.memory
        nominal, constraint = (
            kept if law is None or law.follow is None else law.follow(kept, references)
            for law, kept in zip((*self._laws, None)[:2], (memory.nominal, memory.constraint), strict=True)
        )
        cycle = self._loop.cycle._replace(memory=memory._replace(nominal=nominal, constraint=constraint))
        self._loop = self._loop._replace(cycle=cycle)

    def _rest(self, x: float, y: float) -> None:
        """Rest at (x, y) m from the next sample on."""
        self._motions().rest_at(self._moment, x, y)

    def _new_estimator(self) -> StateEstimator:
        # here, because most runs measure all joints
        from fivebar_control.controller.estimator import estimator_of

        return estimator_of(self._scenario)

    def _begin_loop(self, memory: CycleMemory) -> None:
        """Begin with a memory of the control cycle."""
        self._loop = unanswered(memory, 0)

    def _clear_loop(self) -> None:
        """Go on without a fault."""
        self._loop = cleared(self._loop)

    def _answered(self, number: int, sensed: KnownJoints) -> LoopAnswer:
        """Answer a sample."""
        planned, state = self._planned(number + self._settings.lead), self._state_of(sensed)
        known = Known(True, state, *sensed.disturbance, sensed.trip)
        self._loop = answer(
            **self._of_laws, settings=self._settings, before=self._loop, number=number, known=known, planned=planned
        )
        return self._response((state.x, state.y, state.vx, state.vy), planned.platform)

    def _stopped(self, number: int) -> LoopAnswer:
        """Command no torque at a sample that was lost, and latch a fault."""
        self._loop = stopped(self._loop, number)
        return self._response(NOWHERE, self._planned(number + self._settings.lead).platform)

    def _unanswered(self, number: int) -> LoopAnswer:
        """Hold the last torque at a sample that was lost."""
        return self._response(NOWHERE, self._planned(number + self._settings.lead).platform)

    def _response(self, place: Quadruple, reference: Platform) -> LoopAnswer:
        cycle, _, latched, fault, _ = self._loop
        torques = cycle.nominal, cycle.constraint, cycle.requested, cycle.command
        return LoopAnswer(place, reference, cycle.sigma, cycle.kappa, *torques, cycle.fault, fault, latched)

    def _planned(self, moment: int) -> PlanSample:
        if self._queue is None:
            ahead = reference_ahead(self._plan, moment, self._rate_hz, self._ahead)
            return plan_sample(self._robot, self._plan, moment / self._rate_hz, ahead)
        platform, *later = self._queue.window(moment, self._ahead)
        return plan_sample(self._robot, self._plan, moment / self._rate_hz, tuple(later) or None, platform)

    def _state_of(self, sensed: KnownJoints) -> State:
        return state_from_joints(self._robot, *sensed.position, *sensed.velocity)

    def _check_sufficient(self, readings: SensorReadings) -> None:
        """Refuse a sample without the readings from which the scenario's controller knows the robot."""
        all_joints = readings.joint_angles is not None and readings.joint_velocities is not None
        if readings.present and self._estimator is None and not all_joints:
            raise InputError(
                "joint_angles, joint_velocities: the scenario measures all joints: expected both, or a scenario with"
                " estimator ekf"
            )

    def _number_of(self, time: float | None) -> int:
        """Return the number of the sample at a time (s), the next one where none is given."""
        if time is None:
            return self._number + 1
        number = round(time * self._rate_hz)
        if abs(time * self._rate_hz - number) > OFF_GRID:
            raise InputError(f"time: {time:g}: expected a multiple of the period, {self.period:g} s")
        if number < max(self._number, 0):
            newest = f"{max(self._number, 0) / self._rate_hz:g}"
            raise InputError(f"time: {time:g}: it goes back: expected at least {newest} s")
        return number

    def _sensed_by(self, readings: SensorReadings) -> KnownJoints | None:
        """Return the joints by the readings of the present sample, None where it was lost."""
        waiting = self._waiting
        if waiting is not None:
            # they come with this sample
            readings = readings._replace(
                imu=waiting.imu + tuple(readings.imu),
                passive_angles=waiting.passive_angles + tuple(readings.passive_angles),
                camera=waiting.camera + tuple(readings.camera),
                extra=waiting.extra + tuple(readings.extra),
            )
        if not readings.present:
            self._waiting = readings
            return None
        self._waiting = None
        tau1, tau2 = torques = self._applied(readings)
        angles = readings.joint_angles
        if self._estimator is None:
            assert angles is not None and readings.joint_velocities is not None
            return KnownJoints(angles, readings.joint_velocities, (tau1, 0.0, tau2, 0.0), None, (0.0, 0.0), NO_FAULT)
        # here, because most runs measure all joints
        from fivebar_control.controller.late_readings import late_readings
        from fivebar_control.estimation.fault_numbers import TRIP_NUMBERS

        motors = readings.motor_angles
        if motors is None:
            assert angles is not None
            motors = angles[0], angles[2]
        estimate = self._estimator.take(self._number, *motors, *torques, late_readings(readings, self._scenario))
        fault = self._estimator.fault
        trip = NO_FAULT if fault is None else TRIP_NUMBERS[fault.name]
        return KnownJoints(
            estimate.position, estimate.velocity, estimate.effort, estimate.deviations, estimate.disturbance, trip
        )

    def _applied(self, readings: SensorReadings) -> Pair:
        """Return the torques (Nm) applied over the period before the sample."""
        delay = self._scenario.plant.delay_samples
        commanded, self._commands = self._commands[-delay - 1], self._commands[-delay - 1 :]
        return commanded if readings.motor_torques is None else readings.motor_torques

    def _held(self, number: int) -> LoopAnswer:
        """Hold the last torque over a lost sample, or latch a fault and command none where that is one too many."""
        came, held = self._came, self._longest_hold
        if held is None or came < 0 or number - came <= held:
            return self._unanswered(number)
        if self.fault is None:
            self.fault = Fault("state_stale", f"no sample after {came}, where the torque is held for {held} at most")
        return self._stopped(number)

    def _in_words(self, response: LoopAnswer, sensed: KnownJoints) -> Fault | None:
        """Return the first fault that the loop has found."""
        if response.found == NO_FAULT:
            assert self._estimator is not None
            return self._estimator.fault
        control = self._control
        fault = fault_of(
            response.found,
            control.limits,
            control.robot,
            control.mode,
            self._state_of(sensed),
            response.reference.x,
            response.reference.y,
            response.requested,
            response.sigma if control.blended else 0.0,
        )
        return Fault(fault.name, f"at sample {self._number}: {fault.detail}")
