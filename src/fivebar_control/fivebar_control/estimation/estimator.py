# SPDX-License-Identifier: Apache-2.0
"""State estimator: from motor readings to the joint states that the controllers use, for node and offline runner.

Timing: sample k is measured at t_k, and the command that answers it acts from t_(k+d) on, d being the drives' delay
in samples. The filter's estimate at t_k is therefore advanced by d periods under the torques that do not act yet, the
commands of samples k-d to k-1. The state published with the stamp of sample k is that at t_(k+d); the reference under
that stamp must be that of t_(k+d) too (`lead_samples` of the motion).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from fivebar_control.estimation.causes import inconsistency_reason
from fivebar_control.estimation.constants import estimator_model
from fivebar_control.estimation.ekf import Belief
from fivebar_control.estimation.encoder import first_angle
from fivebar_control.estimation.fault_numbers import (
    ENCODER_FROZEN,
    ESTIMATE_AMBIGUOUS,
    ESTIMATE_INCONSISTENT,
    ESTIMATE_LOST,
    TRIP_NAMES,
)
from fivebar_control.estimation.frozen import (
    FrozenMemory,
    frozen_reason,
    named_motor,
    nothing_read,
)
from fivebar_control.estimation.gyro_watch import gyro_reason
from fivebar_control.estimation.homing import Homing, HomingContradicted, check_declared, check_encoders, seen_assembly
from fivebar_control.estimation.late_reading import CAMERA, EXTRA, PASSIVE, LateReading
from fivebar_control.estimation.late_sensors import with_readings
from fivebar_control.estimation.mirror import ambiguity_reason
from fivebar_control.estimation.readings import (
    EstimatorMemory,
    Misfit,
    longest_gap,
    with_motors,
)
from fivebar_control.estimation.settings import Sensing
from fivebar_control.estimation.step import (
    EstimatorStep,
    Prediction,
    filter_functions,
    first_update,
)
from fivebar_control.fault import Fault
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.state import Joints
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.parameters import FiveBar
from fivebar_description.whole_turns import same_turn, turns_between

NO_READINGS = Misfit(math.nan, math.nan, math.nan, math.nan)

Vector6 = tuple[float, float, float, float, float, float]

Torques = Sequence[tuple[float, float]]


class JointEstimate(NamedTuple):
    """The estimate that is published for a sample.

    Attributes:
        position, velocity: of q11, q12, q21, q22 (rad, rad/s) when the answering torque begins to act.
        effort: applied torque over the period before the sample (Nm), 0 for the passive joints.
        deviations: standard deviations of x, y (m), vx, vy (m/s), d1, d2 (Nm) when the sample was measured.
        disturbance: d1, d2 (Nm), estimated torques on the motors besides the commanded ones.
    """

    position: tuple[float, float, float, float]
    velocity: tuple[float, float, float, float]
    effort: tuple[float, float, float, float]
    deviations: Vector6
    disturbance: tuple[float, float]


class MotorReadings(NamedTuple):
    """A sample's number, the periods since the one before, the motors' angles (rad) and the torques before it (Nm)."""

    sample: int
    periods: int
    q11: float
    q21: float
    tau1: float
    tau2: float


class Ahead(NamedTuple):
    """A sample's estimate.

    Attributes:
        joints: angles and rates of all joints when the answering torque begins to act.
        variances: of x, y, vx, vy, d1, d2 when the sample was measured.
        disturbance: d1, d2 (Nm).
        trip, lost: as in `Prediction`.
    """

    joints: Joints
    variances: tuple[float, ...]
    disturbance: tuple[float, float]
    trip: int
    lost: bool


class StateEstimator:
    """The filter over a run: initialised from the homing posture; latches the first fault."""

    def __init__(self, robot: FiveBar, homing: Homing, sensing: Sensing) -> None:
        """Make an estimator for a robot at rest in a declared posture.

        Raises:
            HomingContradicted: the declared posture contradicts itself.
        """
        check_declared(robot, homing)
        drives, settings, extra = sensing.drives, sensing.settings, sensing.extra
        self._robot = robot
        self._homing = homing
        self._filter = filter_functions(None if extra is None else extra.kind)
        self._sees, self._seen_start = settings.camera, settings.seen_start
        self._model = estimator_model(robot, homing.mode, sensing)
        self._tolerance = settings.homing_tolerance + self._model.resolution
        self._frozen = nothing_read()
        self._longest_gap = longest_gap(sensing.rate_hz)
        # before sample 0 the drives are at zero torque
        self._commands = {sample: (0.0, 0.0) for sample in range(-drives.delay_samples, 0)}
        self._newest_command = 0.0, 0.0
        self._answer: JointEstimate | None = None
        self._begun = False
        self._memory: EstimatorMemory | None = None
        self.fault: Fault | None = None
        self.squared = NO_READINGS
        """Mean squares of the innovations of the last sample in units of their variances, NaN without a reading."""
        self._last = 0
        self._found_again = False
        self._near = self._expected_motors()
        self._near_elbow = math.nan
        self.turns = 0, 0
        """Whole turns that both motors' last readings had too many, and that were taken off."""

    def joined_late(self, sample: int) -> bool:
        """Return whether the first sample of all is no beginning of a run, and latch `estimate_lost` for it.

        An estimator that was restarted on the way does not know where the robot is, although its encoders may fit the
        declared posture: they do in both assembly modes. A few first samples may be missing, as anywhere else.
        """
        if self._begun or self._found_again or sample <= self._longest_gap:
            return False
        self._latch("estimate_lost", f"the first sample heard was {sample}, not the beginning of a run")
        return True

    def begin_at(self, homing: Homing) -> None:
        """Begin again with the next sample, at rest in another posture than declared; a latched fault is cleared.

        Raises:
            HomingContradicted: the posture contradicts itself.
        """
        check_declared(self._robot, homing)
        self._homing, self._seen_start = homing, False
        self._memory = self._answer = self.fault = None
        self._begun, self._found_again = False, True
        self._near, self._near_elbow = self._expected_motors(), math.nan
        self._frozen = nothing_read()

    def carry(self, robot: FiveBar) -> None:
        """Go on with another mass of the platform."""
        self._robot = robot
        self._model = self._model._replace(filter=self._model.filter._replace(robot=robot))

    def warm_up(self) -> None:
        """Work out a sample that does not count, so that machine code is loaded, or made, before the first one does."""
        q11, q21 = self._expected_motors()
        memory = self._filter.first_update(self._model, self._homing.assembly, q11, q21)
        memory = with_motors(memory, 1, 1, q11, q21, 0.0, 0.0)
        pending = [(0.0, 0.0)] * self._model.delay_samples
        self._filter.estimator_step(self._model, memory, nothing_read(), memory.newest, pending, 0, False)

    def _expected_motors(self) -> tuple[float, float]:
        """Return both motor angles (rad) of the declared posture."""
        return inverse_geometry(self._robot, self._homing.mode, *self._homing[:2])[::2]

    @property
    def belief(self) -> Belief | None:
        """Belief at the measurement of the last sample, not yet predicted over the delay; None before the first."""
        return None if self._memory is None else self._memory.belief

    def commanded(self, sample: int, tau1: float, tau2: float) -> None:
        """Record the torque (Nm) that was commanded in answer to a sample; repeated commands are ignored."""
        self._newest_command = tau1, tau2
        if self._model.delay_samples > 0:
            self._commands.setdefault(sample, (tau1, tau2))

    def awaits(self, sample: int) -> bool:
        """Return whether a command that affects this sample's estimate is still to come.

        None comes in answer to a sample whose readings were lost.
        """
        expected = self._model.delay_samples > 0 and self._last == sample - 1
        return expected and sample - 1 not in self._commands

    def take(
        self,
        sample: int,
        q11: float,
        q21: float,
        tau1: float,
        tau2: float,
        readings: Sequence[LateReading] = (),
    ) -> JointEstimate:
        """Return the joint states for a sample's motor angles (rad) and the torques applied before it (Nm).

        `readings` are those of the late sensors that came with the sample, of each sensor in their order. One that is
        older than the history is left out.

        Angles may be wrapped or offset by whole turns: each is taken in the turn of the one before, the first in that
        of the declared posture.

        A missing command is replaced by the last one before it, as the drives do.

        Raises:
            HomingContradicted: the first angles are not those of the declared posture.
        """
        read = q11, q21
        q11, q21 = self._near = same_turn(q11, self._near[0]), same_turn(q21, self._near[1])
        self.turns = turns_between(read[0], q11), turns_between(read[1], q21)
        ahead = self._stepped(sample, q11, q21, tau1, tau2, readings)
        effort = (tau1, 0.0, tau2, 0.0)
        trip = ahead.trip
        if trip != NO_FAULT:
            self._latch(TRIP_NAMES[trip], f"at sample {sample}{self._reason(trip, *self._details())}")
        if ahead.lost and self._answer is not None:
            return self._answer._replace(effort=effort)
        # NaN stays NaN
        a, b, c, d, e, f = (0.0 if variance < 0.0 else math.sqrt(variance) for variance in ahead.variances)
        self._answer = JointEstimate(ahead.joints[:4], ahead.joints[4:], effort, (a, b, c, d, e, f), ahead.disturbance)
        return self._answer

    def _stepped(
        self,
        sample: int,
        q11: float,
        q21: float,
        tau1: float,
        tau2: float,
        readings: Sequence[LateReading],
    ) -> Ahead:
        model, last, self._last = self._model, self._last, sample
        if not self._begun:
            angle1, angle2 = first_angle(model.resolution, q11), first_angle(model.resolution, q21)
            check_encoders(self._robot, self._homing, self._tolerance, angle1.value, angle2.value)
            memory = first_update(model, self._first_assembly(angle1.value, angle2.value, readings), q11, q21)
            self._begun = True
            return self._first(memory, self._pending(sample))
        # over a gap in the readings the torque is assumed to be that of its last period
        periods = min(max(sample - last, 1), self._longest_gap)
        # exactly zero is what the guard commands once a fault is latched
        coasts = self._newest_command == (0.0, 0.0)
        motors = MotorReadings(sample, periods, q11, q21, tau1, tau2)
        ahead = self._next(motors, self._usable(readings), self._pending(sample), coasts)
        if sample - last > self._longest_gap:
            self._latch("estimate_lost", f"no motor readings from sample {last + 1} to {sample - 1}")
        return ahead

    def _usable(self, readings: Sequence[LateReading]) -> list[LateReading]:
        """Return the readings that can be taken: angles in the turn of those before, and positions that were seen."""
        usable = []
        for reading in readings:
            if reading.sensor == PASSIVE:
                self._near_elbow = same_turn(reading.value, self._near_elbow)
                reading = reading._replace(value=self._near_elbow)
            known = math.isfinite(reading.value + reading.second + reading.deviation)
            if (reading.sensor == CAMERA and not (self._sees and known)) or (reading.sensor == EXTRA and not known):
                continue
            usable.append(reading)
        return usable

    def _first(self, memory: EstimatorMemory, pending: Torques) -> Ahead:
        """Begin with the memory after the first readings, and predict over the torques (Nm) that do not act yet."""
        self._memory = memory
        return self._after(self._filter.estimator_step(self._model, memory, self._frozen, 1, pending, 0, False))

    def _next(
        self,
        motors: MotorReadings,
        readings: Sequence[LateReading],
        pending: Torques,
        coasts: bool,
    ) -> Ahead:
        """Go on by a sample's readings, and predict over the torques (Nm) that do not act yet."""
        assert self._memory is not None
        memory, start = with_readings(self._model, self._memory, *motors, readings)
        stepped = self._filter.estimator_step(self._model, memory, self._frozen, start, pending, 0, coasts)
        self.squared, self._frozen = stepped.squared, stepped.frozen
        return self._after(stepped)

    def _after(self, stepped: EstimatorStep) -> Ahead:
        self._prediction = prediction = stepped.prediction
        self._memory = prediction.memory
        estimate, covariance = prediction.memory.belief
        variances = tuple(covariance.diagonal()[:6].tolist())
        return Ahead(prediction.joints, variances, (estimate.d1, estimate.d2), prediction.trip, prediction.lost)

    def _details(self) -> tuple[Prediction, FrozenMemory]:
        """Return what a fault is put into words by."""
        return self._prediction, self._frozen

    def _reason(self, trip: int, ahead: Prediction, frozen: FrozenMemory) -> str:
        """Return a fault in words that go on from "at sample N"."""
        model, memory = self._model, ahead.memory
        if trip == ESTIMATE_LOST:
            return f" the estimated platform ({ahead.estimate.x:.4f}, {ahead.estimate.y:.4f}) m is out of reach"
        if trip == ESTIMATE_AMBIGUOUS:
            return f": {ambiguity_reason(model.filter, model.limits, ahead.ambiguity)}"
        if trip == ENCODER_FROZEN:
            motor = named_motor(model, frozen, False) or named_motor(model, frozen, True)
            return f" {frozen_reason(frozen.motor1 if motor == 1 else frozen.motor2, motor)}"
        if trip == ESTIMATE_INCONSISTENT:
            return f" {inconsistency_reason(model, memory.misfit, memory.pattern)}"
        return f": {gyro_reason(trip, memory.gyro, model.rate_hz)}"

    def _first_assembly(self, q11: float, q21: float, readings: Sequence[LateReading]) -> int:
        """Return the assembly mode at the start: declared, or by the camera with `seen_start`."""
        if not self._seen_start:
            return self._homing.assembly
        seen = (reading for reading in readings if reading.sensor == CAMERA)
        sighting = next((reading for reading in seen if math.isfinite(reading.value + reading.second)), None)
        if sighting is None:
            raise HomingContradicted("homing_contradicted: the camera does not see the platform at the start")
        assembly = seen_assembly(self._robot, q11, q21, sighting.value, sighting.second)
        if assembly != self._homing.assembly:
            raise HomingContradicted(
                f"homing_contradicted: the camera sees the platform in assembly mode {assembly}, the motion begins in"
                f" {self._homing.assembly}"
            )
        return assembly

    def _pending(self, sample: int) -> list[tuple[float, float]]:
        """Return the commanded torques (Nm) that do not act yet when a sample is measured, a missing one repeated."""
        delay = self._model.delay_samples
        # over a gap in the samples none may be known for a while: the last one before
        past = sorted(number for number in self._commands if number < sample - delay)
        torque = self._commands[past[-1]] if past else (0.0, 0.0)
        for number in past:
            del self._commands[number]
        pending = []
        for number in range(sample - delay, sample):
            torque = self._commands.setdefault(number, torque)
            pending.append(torque)
        return pending

    def _latch(self, name: str, detail: str) -> None:
        if self.fault is None:
            self.fault = Fault(name, detail)
