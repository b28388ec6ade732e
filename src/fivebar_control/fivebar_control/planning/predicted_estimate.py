# SPDX-License-Identifier: Apache-2.0
"""How well an estimator will know the robot along a predicted run, from tolerances and sensors, before anything moves.

The covariance of the filter does not depend on the readings but through the rows' linearisation. So it is run along the
predicted states with the declared sensors, without random numbers: what the estimator will say of itself, which is
honest where the tolerances are.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.compiling import as_machine_code, bound, bound_apart
from fivebar_control.estimation.camera import CAMERA_GATE, seen_at
from fivebar_control.estimation.constants import EstimatorModel, estimator_model
from fivebar_control.estimation.covariance import Matrix, X, Y, propagated
from fivebar_control.estimation.ekf import NO_ERRORS, Belief, Estimate, transition
from fivebar_control.estimation.encoder import Angle, angle_variance, first_angle
from fivebar_control.estimation.extra_sensor import extra_expected, extra_taken
from fivebar_control.estimation.gyroscope import turn_rate, turned
from fivebar_control.estimation.late_reading import CAMERA, EXTRA, GYROSCOPE, PASSIVE, SENSORS
from fivebar_control.estimation.measurements import corrected, homed_belief
from fivebar_control.estimation.mirror import mirror_distance
from fivebar_control.estimation.passive_encoder import elbow_turned
from fivebar_control.estimation.platform_motion import LegMotion, leg_motion
from fivebar_control.estimation.settings import Sensing
from fivebar_control.planning.predicted_run import Peak, PredictedRun, PredictedSample
from fivebar_control.trajectory.path_distance import PATH, TIMED
from fivebar_control.trajectory.planner import Plan
from fivebar_description.extra_sensor import ExpectedReading
from fivebar_description.parameters import FiveBar, with_floats
from fivebar_description.sensors import NOTHING_KNOWN

IntArray = NDArray[np.int64]


class PredictedEstimate(NamedTuple):
    """The predicted quality of an estimate, where it is least.

    Attributes:
        mirror: fewest standard deviations from the estimate to the other assembly mode with the same motor angles and
            speeds, infinite where the motion is nowhere near the locus.
        position: largest standard deviation of the position (m): in any direction, or where the distance from the path
            counts, across the path.
    """

    mirror: Peak
    position: Peak

    @property
    def wrong_mode(self) -> float:
        """Probability of taking one of two mirror images for the other, where they are closest."""
        return wrong_mode_probability(self.mirror.value)

    def exceeded_by(self, probability: float) -> float:
        """Return the distance (m) that the position's error exceeds in that direction with a probability."""
        return self.position.value * NormalDist().inv_cdf(1.0 - 0.5 * probability)


def wrong_mode_probability(deviations: float) -> float:
    """Return how likely the farther of two mirror images seems nearer, so many standard deviations apart."""
    return 0.5 * math.erfc(0.5 * deviations / math.sqrt(2.0))


def predict_estimate(
    robot: FiveBar, plan: Plan, sensing: Sensing, predicted: PredictedRun, judge: str = TIMED
) -> PredictedEstimate:
    """Return what the estimate of a predicted run is worth; readings arrive as soon as they are made.

    Args:
        robot: of controllers and estimator.
        plan: in one working mode.
        sensing: what it has.
        predicted: the run, of at least one sample.
        judge: by which distance the motion is judged.
    """
    model = estimator_model(with_floats(robot), plan.mode, sensing._replace(known=NOTHING_KNOWN))
    every = np.zeros(SENSORS, dtype=np.int64)
    every[PASSIVE] = sensing.passive.schedule(sensing.rate_hz).every if model.elbow else 0
    every[GYROSCOPE] = sensing.gyro_every if sensing.settings.gyro else 0
    every[CAMERA] = sensing.camera_every if sensing.settings.camera else 0
    every[EXTRA] = 0 if sensing.extra is None else sensing.extra.schedule(sensing.rate_hz).every
    first = predicted.moments[0]
    belief = homed_belief(model.filter, first.x, first.y, first_angle(model.resolution, 0.0).variance + model.play)
    moments = np.array(predicted.moments, dtype=np.float64)
    counted = _across(plan, sensing.rate_hz, len(moments)) if judge == PATH else np.zeros((len(moments), 2))
    worth = worth_along if sensing.extra is None else _worth_with(sensing.extra.kind.expected)
    return as_machine_code(worth)(model, every, moments, counted, belief.covariance)


@cache
def _worth_with(expected: Callable[..., ExpectedReading]) -> Callable[..., PredictedEstimate]:
    """Return `worth_along` for a sensor from another package, given what is expected of it."""
    taken = bound(extra_taken, extra_expected=expected)
    later = bound(_next, extra_taken=taken, extra_expected=expected)
    return bound_apart(expected.__name__, worth_along, _next=later)


def _across(plan: Plan, rate_hz: int, samples: int) -> Matrix:
    """Return the directions across the path at the first samples of a plan, [N, 2]; zeros where the reference rests."""
    velocities = [plan.path.at(min(sample / rate_hz, plan.path.duration))[2:4] for sample in range(samples)]
    across = np.array([(-vy, vx) for vx, vy in velocities])
    speeds = np.hypot(*across.T)
    return across / np.where(speeds > 0.0, speeds, 1.0)[:, None]


def worth_along(
    model: EstimatorModel, every: IntArray, moments: Matrix, counted: Matrix, covariance: Matrix
) -> PredictedEstimate:
    """Return what the estimate is worth along a run.

    Args:
        model: of the estimator.
        every: samples from one reading of each late sensor to the next, 0 for one that is not there, [SENSORS].
        moments: the predicted samples, in the order of `PredictedSample`, [N, 6].
        counted: direction in which the position counts at each of them, [N, 2]; zeros for any direction.
        covariance: of the belief at the first of them, [SIZE, SIZE].
    """
    now = _sample(moments, 0)
    belief = Belief(_estimate(now.x, now.y, now.vx, now.vy), covariance)
    mirror, position = Peak(math.inf, 0.0, now.x, now.y), Peak(0.0, 0.0, now.x, now.y)
    for number in range(len(moments)):
        if number > 0:
            before, now = now, _sample(moments, number)
            belief = _next(model, belief, before, now, every, number)
        t = number / model.rate_hz
        distance = mirror_distance(model.filter, belief)
        if distance < mirror.value:
            mirror = Peak(distance, t, now.x, now.y)
        deviation = _deviation(belief.covariance, float(counted[number, 0]), float(counted[number, 1]))
        if not deviation <= position.value:
            position = Peak(deviation, t, now.x, now.y)
    return PredictedEstimate(mirror, position)


def _sample(moments: Matrix, number: int) -> PredictedSample:
    return PredictedSample(
        float(moments[number, 0]),
        float(moments[number, 1]),
        float(moments[number, 2]),
        float(moments[number, 3]),
        float(moments[number, 4]),
        float(moments[number, 5]),
    )


def _is_due(every: IntArray, sensor: int, number: int) -> bool:
    return bool(every[sensor] > 0 and number % every[sensor] == 0)


def _next(
    model: EstimatorModel, belief: Belief, before: PredictedSample, now: PredictedSample, every: IntArray, number: int
) -> Belief:
    """Return the belief at the next sample, as the readings of the predicted robot leave it."""
    known = model.filter
    half_x, half_y = 0.5 * (before.x + now.x), 0.5 * (before.y + now.y)
    middle = _estimate(half_x, half_y, 0.5 * (before.vx + now.vx), 0.5 * (before.vy + now.vy))
    covariance = propagated(belief.covariance, transition(known, middle, before.tau1, before.tau2), known.noise)
    belief = Belief(_estimate(now.x, now.y, now.vx, now.vy), covariance)
    leg1 = leg_motion(known.robot.leg1, known.mode[0], now.x, now.y, now.vx, now.vy)
    leg2 = leg_motion(known.robot.leg2, known.mode[1], now.x, now.y, now.vx, now.vy)
    q11, q21 = _motor_angle(model, leg1), _motor_angle(model, leg2)
    belief = Belief(belief.estimate, corrected(known, belief, q11, q21).belief.covariance)
    if _is_due(every, PASSIVE, number):
        leg = leg1 if model.elbow == 1 else leg2
        variance = angle_variance(model.elbow_resolution, model.elbow_rate, leg.dtheta - leg.dq1)
        reading = Angle(math.atan2(leg.sin_q2, leg.cos_q2), variance)
        belief = Belief(belief.estimate, elbow_turned(known, belief, model.elbow, reading).belief.covariance)
    if _is_due(every, GYROSCOPE, number):
        rate_before = turn_rate(known, _estimate(before.x, before.y, before.vx, before.vy))
        slope = (leg2.dtheta - rate_before) / known.period
        belief = Belief(belief.estimate, turned(known, belief, leg2.dtheta, 0.0, slope).belief.covariance)
    if _is_due(every, CAMERA, number):
        at = seen_at(belief, now.x, now.y, 0.0, model.camera_variance, CAMERA_GATE)
        belief = Belief(belief.estimate, at.belief.covariance)
    if _is_due(every, EXTRA, number):
        value = extra_expected(model.extra, known.robot, known.mode, now.x, now.y, now.vx, now.vy).value
        by_extra = extra_taken(model, belief, value, 0.0, model.extra_variance)
        belief = Belief(belief.estimate, by_extra.belief.covariance)
    return belief


def _motor_angle(model: EstimatorModel, leg: LegMotion) -> Angle:
    variance = angle_variance(model.resolution, model.rate_hz, leg.dq1) + model.play
    return Angle(math.atan2(leg.r_y, leg.r_x), variance)


def _estimate(x: float, y: float, vx: float, vy: float) -> Estimate:
    return Estimate(x, y, vx, vy, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, NO_ERRORS)


def _deviation(covariance: Matrix, along_x: float, along_y: float) -> float:
    """Return the standard deviation of the position (m) in a direction, the largest of all for zeros."""
    xx, yy, xy = float(covariance[X, X]), float(covariance[Y, Y]), float(covariance[X, Y])
    if along_x != 0.0 or along_y != 0.0:
        variance = along_x * along_x * xx + along_y * along_y * yy + 2.0 * along_x * along_y * xy
        return math.sqrt(max(variance, 0.0))
    return math.sqrt(0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy))
