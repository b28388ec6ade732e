# SPDX-License-Identifier: Apache-2.0
"""Feasibility of a planned motion, checked before the robot moves: each figure, its limit, and where it is worst."""

from __future__ import annotations

import math
from collections.abc import Callable

from fivebar_control.estimation.settings import Sensing
from fivebar_control.laws.registry import TunedController
from fivebar_control.model.singularity import FOLDED, NEAR_LOCUS
from fivebar_control.planning.figures import (
    APPROACH,
    DIRECTION,
    DWELL,
    ELBOWS,
    ERROR,
    LOADS,
    MODE_CHANGES,
    PATH_ERROR,
    PATH_WITH_RESERVE,
    REQUEST,
    SERIAL,
    SPEED,
    TORQUE,
    UNCERTAINTY,
    WITH_RESERVE,
    WRONG_MODE,
    ZONE_STAY,
    Feasibility,
    Figure,
)
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.planning.predicted_run import Peak, PredictedRun, predict_run, stretches_of
from fivebar_control.planning.reference_scan import ReferenceScan
from fivebar_control.safety.settings import EVERYWHERE
from fivebar_control.trajectory.path_distance import PATH, TIMED
from fivebar_control.trajectory.planner import Crossing, Plan
from fivebar_description.loads import Loads
from fivebar_description.parameters import FiveBar, has_external_force

ERROR_NAMES = {TIMED: (ERROR, WITH_RESERVE), PATH: (PATH_ERROR, PATH_WITH_RESERVE)}
"""Names of the figures of the distance by which a motion is judged: with all torque, and with the reserve left."""

OF_FALL = {TORQUE, REQUEST, MODE_CHANGES, ERROR, WITH_RESERVE, PATH_ERROR, PATH_WITH_RESERVE}
"""Names of the figures that a reference misses which does not fall with the platform."""

REQUEST_TOLERANCE = 1e-9
"""Share by which a law that keeps the torque limit itself may exceed it, from rounding."""


LIKELIEST_WRONG_MODE = 1e-3
"""Largest predicted probability of taking the mirrored assembly mode for the actual one: less than where the estimator
itself gives up."""

Predict = Callable[[FiveBar, Plan, int, TunedController, float, str], PredictedRun]
"""Returns the run that a plan is predicted to become; arguments as for `predict_run`."""


def screen(
    robot: FiveBar,
    plan: Plan,
    rate_hz: int,
    follower: TunedController,
    limits: MotionLimits,
) -> Feasibility:
    """Judge a reference: torque, speeds, distance to Type 1, dwells near Type 2, rests, directions, near passes, loads.

    Torque and speed are those of the reference at the samples of `rate_hz`, the only ones that a controller sees.
    """
    scan = ReferenceScan(robot, plan, rate_hz, follower)
    zoned = () if follower.controller.needs_no_zones else plan.crossings
    zone_edge = max((2.0 * crossing.epsilon for crossing in zoned), default=0.0)
    room = limits.rest_room if follower.controller.blended else 1.0
    figures = [
        scan.worst(TORQUE, "torque", limits.torque_share * limits.torque, True, "Nm"),
        scan.worst(SPEED, "speed", limits.speed_share * limits.motor_speed, True, "rad/s"),
        scan.worst(SERIAL, "serial", limits.serial_margin, False),
        scan.worst_rest(max(limits.rest, _with_room(zone_edge, room))),
    ]
    figures += [scan.nearest_to(posture) for posture in limits.forbidden]
    if limits.workspace != EVERYWHERE:
        figures.append(scan.nearest_edge(limits.workspace))
    if limits.elbows_pass is False:
        figures += elbow_passes(plan)
    dwells = scan.dwells(NEAR_LOCUS)
    if dwells:
        figures.append(scan.longest(DWELL, dwells, limits.dwell))
    if follower.controller.blended and plan.crossings:
        zones = [scan.dwell_at(crossing.time, 2.0 * crossing.epsilon) for crossing in plan.crossings]
        figures.append(scan.longest(ZONE_STAY, zones, limits.zone_stay))
        least = min(plan.crossings, key=lambda crossing: crossing.authority)
        place = (least.time, least.x, least.y)
        figures.append(Figure(DIRECTION, least.authority, limits.authority, False, *place))
    if not follower.controller.needs_no_zones:
        nearest = scan.nearest_unguarded(limits.clearance)
        figures += [nearest] if nearest is not None else []
    if limits.approach > 0.0 and plan.crossings:
        figures.append(quickest_approach(plan, limits.approach / math.sqrt(follower.nominal.feedback.kp)))
    if not (limits.loads.declared and plan.crossings):
        return explained(Feasibility(tuple(figures)), robot, plan)
    judged = declared = displaced(robot, plan, rate_hz, follower, limits, limits.certain_loads)
    if limits.risk.load > 0.0:
        declared = displaced(robot, plan, rate_hz, follower, limits, limits.loads)
    if math.isfinite(judged.limit):
        figures.append(judged)
    return explained(Feasibility(tuple(figures), declared.value), robot, plan)


def explained(verdict: Feasibility, robot: FiveBar, plan: Plan) -> Feasibility:
    """Return a verdict with its causes: crossings whose reference does not fall with the platform, if it has to."""
    missed = {figure.name for figure in verdict.figures if not figure.kept}
    causes: list[str] = []
    if has_external_force(robot) and missed & OF_FALL:
        # the criterion is loaded where forces act all the time
        from fivebar_control.trajectory.criterion import fall_problem

        for crossing in plan.crossings:
            motion = plan.path.at(crossing.time)
            causes.append(fall_problem(robot, plan.mode_at(crossing.time), motion))
    return verdict._replace(causes=tuple(filter(None, causes)))


def elbow_passes(plan: Plan) -> list[Figure]:
    """Return how often the elbows of a plan pass each other, at the first time; nothing where they never do."""
    folded = [crossing for crossing in plan.crossings if crossing.distal_links == FOLDED]
    return [Figure(ELBOWS, float(len(folded)), 0.0, True, *folded[0][1:4])] if folded else []


def quickest_approach(plan: Plan, limit: float) -> Figure:
    """Return the least time between a crossing of a plan and the rest before or after it; at least `limit` (s)."""

    def approach(crossing: Crossing) -> float:
        segment = plan.path.segments[crossing.segment]
        return min(crossing.time - segment.start_time, segment.start_time + segment.duration - crossing.time)

    least = min(plan.crossings, key=approach)
    return Figure(APPROACH, approach(least), limit, False, least.time, least.x, least.y, unit="s")


def displaced(
    robot: FiveBar, plan: Plan, rate_hz: int, follower: TunedController, limits: MotionLimits, loads: Loads
) -> Figure:
    """Return how far loads displace the platform at the crossings of a plan, at the worst of them."""
    # here, because few robots declare loads
    from fivebar_control.planning.passage import displacement

    moved = displacement(robot, plan, rate_hz, follower, limits.torque, loads, limits.judge)
    limit = limits.risk.load_share * limits.error_tolerance
    return Figure(LOADS, moved.value, limit, True, *moved[1:], unit="m")


def screen_run(
    robot: FiveBar,
    plan: Plan,
    rate_hz: int,
    follower: TunedController,
    limits: MotionLimits,
    sensing: Sensing | None = None,
    predict: Predict = predict_run,
) -> Feasibility:
    """Judge a plan as `screen` does, and where that finds nothing, by the run that it is predicted to become.

    Segments that are planned in the motors' angles, through Type 1, are judged by their reference alone: there the
    predicting model is not regular. Where an estimator works with declared tolerances (`sensing`), what its estimate is
    going to be worth counts too. A reference that asks for more torque than its share passes under a regular law that
    keeps its run within the tolerance with that share alone. `predict` makes the predicted run.
    """
    verdict = screen(robot, plan, rate_hz, follower, limits)
    if only_torque(verdict, follower) and is_predictable(plan):
        less = limits.torque_share * limits.torque
        spare = predict(robot, plan, rate_hz, follower.limited_to(less), less, limits.judge)
        verdict = explained(with_reserve(verdict, spare, limits), robot, plan)
    if not verdict.feasible:
        return verdict
    if not stretches_of(plan, rate_hz):
        return verdict
    predicted = predict(robot, plan, rate_hz, follower, limits.torque, limits.judge)
    verdict = explained(with_prediction(verdict, predicted, plan, limits), robot, plan)
    return with_sensing(verdict, predicted, robot, plan, limits, sensing)


def is_predictable(plan: Plan) -> bool:
    """Return whether `predict_run` can predict what becomes of a plan from beginning to end."""
    return not plan.modes


def only_torque(verdict: Feasibility, follower: TunedController) -> bool:
    """Return whether nothing but the reference's torque speaks against a motion, under a law regular everywhere.

    The inverse dynamics of a reference grows beyond all bounds towards the locus. Such a law chooses the best torque
    within the limit and saturates there for some samples, which may displace the platform by little: its run shows by
    how much.
    """
    missed = [figure.name for figure in verdict.figures if not figure.kept]
    return missed == [TORQUE] and follower.controller.needs_no_zones and follower.controller.meets_type_1


def with_reserve(verdict: Feasibility, predicted: PredictedRun, limits: MotionLimits) -> Feasibility:
    """Return a verdict in which the run with the reference's share of the torque stands for that torque, if it does.

    Args:
        verdict: with nothing but the torque missed.
        predicted: the run with drives that give `torque_share` of their torque; the rest is for the errors.
        limits: of the motion.
    """
    error, (_, name) = predicted.judged, ERROR_NAMES[limits.judge]
    run = Figure(name, error.value, limits.predicted_error, True, *error[1:], unit="m")
    others = [figure for figure in verdict.figures if not (run.kept and figure.name == TORQUE)]
    return verdict._replace(figures=(*others, run))


def with_prediction(verdict: Feasibility, predicted: PredictedRun, plan: Plan, limits: MotionLimits) -> Feasibility:
    """Return a verdict with the figures of the predicted run of a plan: error, torque, changes of assembly mode."""
    changes = predicted.mode_changes
    unplanned = changes._replace(value=abs(changes.value - len(plan.crossings)))

    def figure(name: str, peak: Peak, limit: float, unit: str = "") -> Figure:
        return Figure(name, peak.value, limit, True, peak.time, peak.x, peak.y, unit)

    name, _ = ERROR_NAMES[limits.judge]
    figures = (
        figure(name, predicted.judged, limits.predicted_error, "m"),
        # by whatever a motion is judged, the robot is stopped by its distance from the reference
        *([] if limits.judge == TIMED else [figure(ERROR, predicted.error, limits.tracking_error, "m")]),
        figure(REQUEST, predicted.torque, limits.torque * (1.0 + REQUEST_TOLERANCE), "Nm"),
        figure(MODE_CHANGES, unplanned, 0.0),
    )
    return verdict._replace(figures=verdict.figures + figures)


def with_sensing(
    verdict: Feasibility,
    predicted: PredictedRun,
    robot: FiveBar,
    plan: Plan,
    limits: MotionLimits,
    sensing: Sensing | None,
) -> Feasibility:
    """Return a feasible verdict with the figures of the predicted estimate: assembly mode and position.

    Unchanged without an estimator or declared tolerances.
    """
    if not verdict.feasible or sensing is None or not sensing.declared:
        return verdict
    # here, because it needs the whole estimator
    from fivebar_control.planning.predicted_estimate import predict_estimate, wrong_mode_probability

    estimate = predict_estimate(robot, plan, sensing, predicted, limits.judge)
    mirror, position, risk = estimate.mirror, estimate.position, limits.risk
    wrong_at_most = min(LIKELIEST_WRONG_MODE, wrong_mode_probability(sensing.settings.mirror_deviations))
    error = predicted.judged.value + estimate.exceeded_by(risk.position)
    figures = (
        Figure(WRONG_MODE, estimate.wrong_mode, wrong_at_most, True, *mirror[1:]),
        Figure(UNCERTAINTY, error, limits.error_tolerance, True, *position[1:], unit="m"),
    )
    return verdict._replace(figures=verdict.figures + figures)


def _with_room(edge: float, room: float) -> float:
    """Return `room` times the kappa of a zone's edge, or where that is near 1, the most there is: the same room to 1.

    At low rates zones are so wide that twice their edge is more than a kappa can be.
    """
    return min(room * edge, 1.0 - (1.0 - edge) / room)
