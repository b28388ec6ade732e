"""How well an estimator will know the robot along a predicted run, from tolerances and sensors, before anything moves.

The covariance of the filter does not depend on the readings but through the rows' linearisation. So it is run along the
predicted states with the declared sensors, without random numbers: what the estimator will say of itself, which is
honest where the tolerances are.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fivebar_control.estimation.constants import Drives, EstimatorModel, estimator_model
from fivebar_control.estimation.covariance import CONSIDERED, Matrix, Vector, X, Y, propagated
from fivebar_control.estimation.ekf import Belief, EkfSettings, Estimate, transition
from fivebar_control.estimation.encoder import Angle, angle_variance, first_angle
from fivebar_control.estimation.measurements import corrected, elbow_turned, homed_belief, seen_at, turn_rate, turned
from fivebar_control.estimation.mirror import mirror_distance
from fivebar_control.estimation.platform_motion import leg_motion
from fivebar_control.planning.predicted_run import Peak, PredictedRun, PredictedSample
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar
from fivebar_description.passive_encoder import NO_ENCODER, PassiveEncoder
from fivebar_description.tolerances import Tolerances

INTEGRATION_POINTS = 4000
INTEGRATION_END = 40.0
"""Of the characteristic function, in units of one over the standard deviation."""

BISECTIONS = 30


class Sensing(NamedTuple):
    """What an estimator has to work with, as declared.

    Attributes:
        drives: encoders and drives.
        settings: of the filter; `gyro` says whether there is a gyroscope.
        tolerances: how exactly the robot is known.
        gyro_every: samples from one gyroscope reading to the next.
        passive: the encoder on a passive joint.
        camera_every: samples from one position by the camera to the next, 0 for none.
    """

    drives: Drives
    settings: EkfSettings
    tolerances: Tolerances
    gyro_every: int = 1
    passive: PassiveEncoder = NO_ENCODER
    camera_every: int = 0

    @property
    def declared(self) -> bool:
        """Whether tolerances of the robot are declared; without, the filter is to believe the model, and so are we."""
        return max(self.tolerances.length, self.tolerances.base, self.tolerances.zero) > 0.0


class ErrorDistribution(NamedTuple):
    """Distribution of the estimated position's error along its most uncertain direction: uniform parts plus noise.

    Attributes:
        bounds: largest effect of each considered error (m).
        noise: standard deviation of the rest, which is normal (m).
    """

    bounds: tuple[float, ...]
    noise: float

    @property
    def deviation(self) -> float:
        """Standard deviation of the whole (m)."""
        return math.sqrt(sum(bound * bound for bound in self.bounds) / 3.0 + self.noise * self.noise)

    def beyond(self, distance: float) -> float:
        """Return the probability of an error of more than a distance (m), to either side."""
        return _beyond(distance, *self._characteristic())

    def exceeded_by(self, probability: float) -> float:
        """Return the distance (m) that the error exceeds with a probability."""
        characteristic = self._characteristic()
        low, high = 0.0, sum(self.bounds) + 6.0 * self.noise
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if _beyond(middle, *characteristic) > probability else (low, middle)
        return high

    def _characteristic(self) -> tuple[Vector, Vector]:
        """Return points (1/m) and the characteristic function there, both [INTEGRATION_POINTS - 1]."""
        t = np.linspace(0.0, INTEGRATION_END / self.deviation, INTEGRATION_POINTS)[1:]
        values = np.exp(-0.5 * (self.noise * t) ** 2)
        for bound in self.bounds:
            values *= np.sinc(bound * t / math.pi)
        return t, values


def _beyond(distance: float, t: Vector, values: Vector) -> float:
    """Return the probability of an error of more than a distance (m), given its characteristic function at points t.

    The integral of that function: the tail of a sum of bounded errors is lighter than a normal one.
    """
    if distance <= 0.0:
        return 1.0
    within = 2.0 / math.pi * (float(np.sum(values * np.sin(distance * t) / t)) + 0.5 * distance) * float(t[0])
    return min(max(1.0 - within, 0.0), 1.0)


class PredictedEstimate(NamedTuple):
    """What an estimate is predicted to be worth, where it is least.

    Attributes:
        mirror: fewest standard deviations from the estimate to the other assembly mode with the same motor angles and
            speeds, infinite where the motion is nowhere near the locus.
        position: largest standard deviation of the position in any direction (m).
        spread: distribution of the position's error there.
    """

    mirror: Peak
    position: Peak
    spread: ErrorDistribution

    @property
    def wrong_mode(self) -> float:
        """Probability of taking one of two mirror images for the other, where they are closest."""
        return wrong_mode_probability(self.mirror.value)


def wrong_mode_probability(deviations: float) -> float:
    """Return how likely the farther of two mirror images seems nearer, so many standard deviations apart."""
    return 0.5 * math.erfc(0.5 * deviations / math.sqrt(2.0))


def predict_estimate(
    robot: FiveBar, plan: Plan, rate_hz: int, sensing: Sensing, predicted: PredictedRun
) -> PredictedEstimate:
    """Return what the estimate of a predicted run is worth; readings arrive as soon as they are made.

    Args:
        robot: of controllers and estimator.
        plan: in one working mode.
        rate_hz: of the estimator.
        sensing: what it has.
        predicted: the run, of at least one sample.
    """
    model = estimator_model(
        robot, plan.mode1, plan.mode2, rate_hz, sensing.drives, sensing.settings, sensing.tolerances, sensing.passive
    )
    every = sensing.gyro_every if sensing.settings.gyro else 0
    elbow_every = sensing.passive.schedule(rate_hz).every if model.elbow else 0
    first = predicted.moments[0]
    belief = homed_belief(model.filter, first.x, first.y, first_angle(model.resolution, 0.0).variance + model.play)
    mirror, position = Peak(math.inf, 0.0, first.x, first.y), Peak(0.0, 0.0, first.x, first.y)
    widest = belief.covariance
    for number, moment in enumerate(predicted.moments):
        if number > 0:
            gyro, elbow = (one > 0 and number % one == 0 for one in (every, elbow_every))
            belief = _next(model, belief, predicted.moments[number - 1], moment, gyro, elbow)
            if sensing.settings.camera and sensing.camera_every and number % sensing.camera_every == 0:
                at = seen_at(belief, moment.x, moment.y, 0.0, model.camera_variance, model.camera_gate)
                belief = belief._replace(covariance=at.belief.covariance)
        t = number / rate_hz
        distance = mirror_distance(model.filter, belief)
        if distance < mirror.value:
            mirror = Peak(distance, t, moment.x, moment.y)
        deviation = _widest(belief.covariance)[0]
        if not deviation <= position.value:
            position, widest = Peak(deviation, t, moment.x, moment.y), belief.covariance
    return PredictedEstimate(mirror, position, _spread(model, widest))


def _next(
    model: EstimatorModel, belief: Belief, before: PredictedSample, now: PredictedSample, gyro: bool, elbow: bool
) -> Belief:
    """Return the belief at the next sample, as the readings of the predicted robot leave it."""
    known = model.filter
    middle = _estimate([0.5 * (one + two) for one, two in zip(before[:4], now[:4], strict=True)])
    covariance = propagated(belief.covariance, transition(known, middle, before.tau1, before.tau2), known.noise)
    belief = Belief(_estimate(now[:4]), covariance)
    legs = (
        leg_motion(known.robot.leg1, known.mode1, *now[:4]),
        leg_motion(known.robot.leg2, known.mode2, *now[:4]),
    )
    q11, q21 = (
        Angle(math.atan2(leg.r_y, leg.r_x), angle_variance(model.resolution, model.rate_hz, leg.dq1) + model.play)
        for leg in legs
    )
    belief = belief._replace(covariance=corrected(known, belief, q11, q21).belief.covariance)
    if elbow:
        leg = legs[model.elbow - 1]
        variance = angle_variance(model.elbow_resolution, model.elbow_rate, leg.dtheta - leg.dq1)
        reading = Angle(math.atan2(leg.sin_q2, leg.cos_q2), variance)
        belief = belief._replace(covariance=elbow_turned(known, belief, model.elbow, reading).belief.covariance)
    if gyro:
        rate = legs[1].dtheta
        slope = (rate - turn_rate(known, _estimate(before[:4]))) / known.period
        belief = belief._replace(covariance=turned(known, belief, rate, 0.0, slope).belief.covariance)
    return belief


def _estimate(platform: tuple[float, ...] | list[float]) -> Estimate:
    x, y, vx, vy = platform
    return Estimate(x, y, vx, vy, 0.0, 0.0)


def _widest(covariance: Matrix) -> tuple[float, Vector]:
    """Return the largest standard deviation of the position in any direction (m), and that unit vector, [2]."""
    xx, yy, xy = float(covariance[X, X]), float(covariance[Y, Y]), float(covariance[X, Y])
    half = 0.5 * (xx - yy)
    variance = 0.5 * (xx + yy) + math.hypot(half, xy)
    angle = 0.5 * math.atan2(xy, half)
    return math.sqrt(variance), np.array([math.cos(angle), math.sin(angle)])


def _spread(model: EstimatorModel, covariance: Matrix) -> ErrorDistribution:
    """Return the distribution along the most uncertain direction.

    Considered errors c get no gain, so the cross-covariance with them is the error's derivative times c's variance.
    """
    deviation, direction = _widest(covariance)
    bounds = []
    explained = 0.0
    for index, considered in enumerate(model.filter.considered):
        if considered > 0.0:
            share = abs(float(direction @ covariance[[X, Y], CONSIDERED + index])) / considered
            explained += share * share
            bounds.append(math.sqrt(3.0) * share)
    return ErrorDistribution(
        tuple(bounds), math.sqrt(max(deviation * deviation - explained, 1e-6 * deviation * deviation))
    )
