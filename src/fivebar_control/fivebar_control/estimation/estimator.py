"""State estimator: from motor readings to the joint states that the controllers use, for node and offline runner.

Moments. Sample k is measured at t_k, and the command that answers it acts from t_(k+d) on, d being the drives' delay
in samples. The filter's estimate at t_k is therefore advanced by d periods under the torques that are on their way, the
commands of samples k-d to k-1. What is published under the stamp of sample k, the measurement that it answers, is the
state at t_(k+d); the reference under that stamp must be that of t_(k+d) too (`lead_samples` of the motion).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.estimation.covariance import Vector6
from fivebar_control.estimation.ekf import Belief, EkfSettings, EncoderFilter, Estimate
from fivebar_control.estimation.encoder import CountedAngle
from fivebar_control.estimation.frozen import FrozenWatch
from fivebar_control.estimation.homing import Homing, check_declared, homed_platform
from fivebar_control.estimation.mirror import MirrorWatch
from fivebar_control.fault import Fault
from fivebar_control.model.kinematics import state_from_platform
from fivebar_description.parameters import FiveBar
from fivebar_description.shared_settings import DelaySamples, DriveTorqueLimit, EncoderCounts

LONGEST_GAP = 10
"""Samples without a reading over which the filter predicts; after a longer gap the estimate is lost."""


class Drives(NamedTuple):
    """What the estimator knows of the motors' encoders and drives."""

    encoder_counts: EncoderCounts = None
    delay_samples: DelaySamples = 0
    torque_limit: DriveTorqueLimit = None

    def limited(self, torque: float) -> float:
        """Return a commanded torque (Nm) limited as by the drives."""
        if self.torque_limit is None:
            return torque
        return max(-self.torque_limit, min(self.torque_limit, torque))


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


class StateEstimator:
    """The filter over a run: initialised from the homing posture; latches the first fault."""

    def __init__(self, robot: FiveBar, homing: Homing, rate_hz: int, drives: Drives, settings: EkfSettings) -> None:
        """Make an estimator for a robot at rest in a declared posture.

        Raises:
            HomingContradicted: the declared posture contradicts itself.
        """
        check_declared(robot, homing)
        self._robot = robot
        self._homing = homing
        self._drives = drives
        self._settings = settings
        self._filter = EncoderFilter(robot, homing.mode1, homing.mode2, rate_hz, settings)
        self._encoders = tuple(CountedAngle(drives.encoder_counts, rate_hz) for _ in range(2))
        self._watch = MirrorWatch(robot, homing.mode1, homing.mode2, rate_hz, settings)
        self._frozen = FrozenWatch(robot, homing.mode1, homing.mode2, self._encoders[0].count)
        # before sample 0 the drives are at zero torque
        self._commands = {sample: (0.0, 0.0) for sample in range(-drives.delay_samples, 0)}
        self._answer: JointEstimate | None = None
        self.belief: Belief | None = None
        """At the moment of the sample taken last, before it is advanced; None before the first."""
        self.fault: Fault | None = None
        self._last = 0

    def commanded(self, sample: int, tau1: float, tau2: float) -> None:
        """Record the torque (Nm) that was commanded in answer to a sample; repeated commands are ignored."""
        if self._drives.delay_samples > 0:
            self._commands.setdefault(sample, (self._drives.limited(tau1), self._drives.limited(tau2)))

    def awaits(self, sample: int) -> bool:
        """Return whether a command that affects this sample's estimate has not been recorded yet."""
        return self._drives.delay_samples > 0 and sample - 1 not in self._commands

    def take(self, sample: int, q11: float, q21: float, tau1: float, tau2: float) -> JointEstimate:
        """Return the joint states for a sample's motor angles (rad) and the torques applied before it (Nm).

        A missing command is replaced by that of the sample before it, as the drives do.

        Raises:
            HomingContradicted: the first angles are not those of the declared posture.
        """
        belief = self._update(sample, q11, q21, tau1, tau2)
        x, y, vx, vy, _, _ = self._advanced(sample, belief.estimate)
        state = state_from_platform(self._robot, self._homing.mode1, self._homing.mode2, x, y, vx, vy)
        leg1, leg2 = state.leg1, state.leg2
        velocity = (leg1.dq1, leg1.dtheta - leg1.dq1, leg2.dq1, leg2.dtheta - leg2.dq1)
        effort = (tau1, 0.0, tau2, 0.0)
        disturbance = (belief.estimate.d1, belief.estimate.d2)
        if not math.isfinite(sum(velocity)):
            self._latch(
                "estimate_lost", f"at sample {sample} the estimated platform ({x:.4f}, {y:.4f}) m is out of reach"
            )
            if self._answer is not None:
                return self._answer._replace(effort=effort)
        elif (reason := self._watch.check(belief)) is not None:
            self._latch("estimate_ambiguous", f"at sample {sample}: {reason}")
        variances = (row[i] for i, row in enumerate(belief.covariance))
        a, b, c, d, e, f = (math.sqrt(max(0.0, variance)) for variance in variances)
        position, deviations = (leg1.q1, leg1.q2, leg2.q1, leg2.q2), (a, b, c, d, e, f)
        self._answer = JointEstimate(position, velocity, effort, deviations, disturbance)
        return self._answer

    def _update(self, sample: int, q11: float, q21: float, tau1: float, tau2: float) -> Belief:
        one, two = self._encoders
        if self.belief is None:
            angle1, angle2 = one.first(q11), two.first(q21)
            tolerance = self._settings.homing_tolerance + one.count
            x, y = homed_platform(self._robot, self._homing, tolerance, angle1.value, angle2.value)
            self.belief = self._filter.begin(x, y, angle1.variance)
        else:
            expected = self.belief
            # over a gap in the readings the torque is assumed to be that of its last period
            for _ in range(min(max(sample - self._last, 1), LONGEST_GAP)):
                expected = self._filter.predict(expected, tau1, tau2)
            if sample - self._last > LONGEST_GAP:
                self._latch("estimate_lost", f"no motor readings from sample {self._last + 1} to {sample - 1}")
            reason = self._frozen.check((q11, q21), expected.estimate, sample - self._last > 1)
            if reason is not None:
                self._latch("encoder_frozen", f"at sample {sample} {reason}")
            speed1, speed2 = self._filter.motor_speeds(expected.estimate)
            self.belief = self._filter.correct(expected, one.next(q11, speed1), two.next(q21, speed2))
        self._last = sample
        return self.belief

    def _advanced(self, sample: int, estimate: Estimate) -> Estimate:
        delay = self._drives.delay_samples
        torque = self._commands.pop(sample - delay - 1, (0.0, 0.0))
        for number in range(sample - delay, sample):
            torque = self._commands.setdefault(number, torque)
            estimate = self._filter.advance(estimate, *torque)
        return estimate

    def _latch(self, name: str, detail: str) -> None:
        if self.fault is None:
            self.fault = Fault(name, detail)
