"""Feasibility of a planned motion, checked before the robot moves: each figure, its limit, and where it is worst."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from scipy.optimize import brentq, minimize_scalar

from fivebar_control.laws.reference import Reference
from fivebar_control.laws.registry import CONTROLLERS, TunedController, default_tuning
from fivebar_control.loop.supervisor import Supervisor
from fivebar_control.model.singularity import NEAR_LOCUS, inverse_condition, type1_margin
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.planning.passage import displacement
from fivebar_control.planning.predicted_estimate import (
    Sensing,
    predict_estimate,
    wrong_mode_probability,
)
from fivebar_control.planning.predicted_run import Peak, PredictedRun, predict_run, stretches_of
from fivebar_control.planning.reference_torque import ReferenceTorque, limited_to
from fivebar_control.safety.forbidden import CLEAR, time_to_posture
from fivebar_control.trajectory.desired import desired_at
from fivebar_control.trajectory.planner import Plan
from fivebar_control.trajectory.refusal import place
from fivebar_control.trajectory.rounded import RoundedSegment
from fivebar_description.forbidden import NamedBounds
from fivebar_description.loads import Loads
from fivebar_description.parameters import FiveBar

COARSE_SAMPLES = 200
"""Samples per segment of the coarse pass; around crossings and extremes every sample is evaluated."""

CLOSE_RANGE = 0.06
"""Time (s) before and after a crossing in which every sample is evaluated."""

BOUNDARY_TOLERANCE = 1e-6
"""Time (s) to which beginning and end of a dwell near the locus are found."""


class Figure(NamedTuple):
    """The worst of one quantity along a motion.

    Attributes:
        name: of the quantity, in words.
        value, limit: in `unit`.
        at_most: whether the limit is an upper one.
        time: when (s since sample 0).
        x, y: where (m).
        unit: of value and limit, "" for none.
    """

    name: str
    value: float
    limit: float
    at_most: bool
    time: float
    x: float
    y: float
    unit: str = ""

    @property
    def kept(self) -> bool:
        """Whether the limit is kept; an undefined value keeps none."""
        return self.value <= self.limit if self.at_most else self.value >= self.limit

    def __str__(self) -> str:
        """Return the figure in words: what, how much, where, when, and what was expected."""
        unit = f" {self.unit}" if self.unit else ""
        return (
            f"{self.name} is {self.value:.3g}{unit} at {place(self.x, self.y)} after {self.time:.3f} s,"
            f" expected at {'most' if self.at_most else 'least'} {self.limit:.3g}{unit}"
        )


(
    TORQUE,
    SPEED,
    SERIAL,
    DWELL,
    ZONE_STAY,
    REST,
    DIRECTION,
    NEAREST,
    ERROR,
    REQUEST,
    MODE_CHANGES,
    WRONG_MODE,
    UNCERTAINTY,
    LOADS,
    WITH_RESERVE,
) = (
    "reference torque",
    "motor speed",
    "|sin q_i2|",
    "time near the Type 2 locus",
    "time in a blending zone",
    "1/cond(A) at rest",
    "|n.v1| where the path crosses the Type 2 locus",
    "least 1/cond(A) under a law that is undefined on the Type 2 locus",
    "predicted distance from the reference",
    "predicted torque request",
    "predicted number of unplanned changes of assembly mode",
    "predicted probability of a wrong assembly mode within the tolerances",
    "predicted position error within the tolerances",
    "displacement by the declared loads where the path crosses the Type 2 locus",
    "predicted distance from the reference without the reserve of torque",
)
"""Names of the figures."""

FORBIDDEN = "time to the forbidden posture"
"""How the names of the figures of forbidden postures begin."""

FAR_FROM_FORBIDDEN = 1.0
"""Times (s) to a forbidden posture are not reported beyond this one."""

NEAR_PASS = 2.0 * NEAR_LOCUS
"""Below this kappa every sample around a local minimum is evaluated."""

REQUEST_TOLERANCE = 1e-9
"""Share by which a law that keeps the torque limit itself may exceed it, from rounding."""


class Feasibility(NamedTuple):
    """The verdict on a motion: one figure per limit, the worst of the motion each."""

    figures: tuple[Figure, ...]

    @property
    def feasible(self) -> bool:
        """Whether all limits are kept."""
        return all(figure.kept for figure in self.figures)

    @property
    def reasons(self) -> list[str]:
        """What is not kept, in words."""
        return [str(figure) for figure in self.figures if not figure.kept]

    def figure(self, name: str) -> Figure | None:
        """Return a figure by its name; None where the motion has no such figure."""
        return next((figure for figure in self.figures if figure.name == name), None)


class ReferenceSample(NamedTuple):
    """The reference at one sample: torque (Nm), speed (rad/s), |sin q_i2|, kappa, place (m)."""

    torque: float
    speed: float
    serial: float
    kappa: float
    x: float
    y: float


class Dwell(NamedTuple):
    """A stretch of time (s) during which kappa is below a bound."""

    start: float
    end: float


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
    scan = _ReferenceScan(robot, plan, rate_hz, follower)
    zoned = () if follower.controller.needs_no_zones else plan.crossings
    zone_edge = max((2.0 * crossing.epsilon for crossing in zoned), default=0.0)
    room = limits.rest_room if follower.controller.blended else 1.0
    figures = [
        scan.worst(TORQUE, "torque", limits.torque_share * limits.torque, True, "Nm"),
        scan.worst(SPEED, "speed", limits.motor_speed, True, "rad/s"),
        scan.worst(SERIAL, "serial", limits.serial_margin, False),
        scan.worst_rest(max(limits.rest, _with_room(zone_edge, room))),
    ]
    figures += [scan.nearest_to(posture) for posture in limits.forbidden]
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
    if limits.loads.declared and plan.crossings:
        figures.append(displaced(robot, plan, rate_hz, follower, limits, limits.certain_loads))
    return Feasibility(tuple(figures))


def displaced(
    robot: FiveBar, plan: Plan, rate_hz: int, follower: TunedController, limits: MotionLimits, loads: Loads
) -> Figure:
    """Return how far loads displace the platform at the crossings of a plan, at the worst of them."""
    moved = displacement(robot, plan, rate_hz, follower, limits.torque, loads)
    limit = limits.risk.load_share * limits.error_tolerance
    return Figure(LOADS, moved.value, limit, True, *moved[1:], unit="m")


def screen_run(
    robot: FiveBar,
    plan: Plan,
    rate_hz: int,
    follower: TunedController,
    limits: MotionLimits,
    sensing: Sensing | None = None,
) -> Feasibility:
    """Judge a plan as `screen` does, and where that finds nothing, by the run that it is predicted to become.

    Segments that are planned in the motors' angles, through Type 1, are judged by their reference alone: there the
    predicting model is not regular. Where an estimator works with declared tolerances (`sensing`), what its estimate is
    going to be worth counts too. A reference that asks for more torque than its share passes under a regular law that
    keeps its run within the tolerance with that share alone.
    """
    verdict = screen(robot, plan, rate_hz, follower, limits)
    if only_torque(verdict, follower) and is_predictable(plan):
        less = limits.torque_share * limits.torque
        verdict = with_reserve(verdict, predict_run(robot, plan, rate_hz, limited_to(follower, less), less), limits)
    if not verdict.feasible:
        return verdict
    if not stretches_of(plan, rate_hz):
        return verdict
    predicted = predict_run(robot, plan, rate_hz, follower, limits.torque)
    verdict = with_prediction(verdict, predicted, plan, limits)
    return with_sensing(verdict, predicted, robot, plan, rate_hz, limits, sensing)


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
    error = predicted.error
    run = Figure(WITH_RESERVE, error.value, limits.predicted_error, True, *error[1:], unit="m")
    return Feasibility((*(figure for figure in verdict.figures if not (run.kept and figure.name == TORQUE)), run))


def with_prediction(verdict: Feasibility, predicted: PredictedRun, plan: Plan, limits: MotionLimits) -> Feasibility:
    """Return a verdict with the figures of the predicted run of a plan: error, torque, changes of assembly mode."""
    changes = predicted.mode_changes
    unplanned = changes._replace(value=abs(changes.value - len(plan.crossings)))

    def figure(name: str, peak: Peak, limit: float, unit: str = "") -> Figure:
        return Figure(name, peak.value, limit, True, peak.time, peak.x, peak.y, unit)

    figures = (
        figure(ERROR, predicted.error, limits.predicted_error, "m"),
        figure(REQUEST, predicted.torque, limits.torque * (1.0 + REQUEST_TOLERANCE), "Nm"),
        figure(MODE_CHANGES, unplanned, 0.0),
    )
    return Feasibility(verdict.figures + figures)


def with_sensing(
    verdict: Feasibility,
    predicted: PredictedRun,
    robot: FiveBar,
    plan: Plan,
    rate_hz: int,
    limits: MotionLimits,
    sensing: Sensing | None,
) -> Feasibility:
    """Return a feasible verdict with the figures of the predicted estimate: assembly mode and position.

    Unchanged without an estimator or declared tolerances.
    """
    if not verdict.feasible or sensing is None or not sensing.declared:
        return verdict
    estimate = predict_estimate(robot, plan, rate_hz, sensing, predicted)
    mirror, position, risk = estimate.mirror, estimate.position, limits.risk
    wrong_at_most = min(risk.wrong_mode, wrong_mode_probability(sensing.settings.mirror_deviations))
    error = predicted.error.value + estimate.spread.exceeded_by(risk.position)
    return Feasibility(
        (
            *verdict.figures,
            Figure(WRONG_MODE, estimate.wrong_mode, wrong_at_most, True, *mirror[1:]),
            Figure(UNCERTAINTY, error, limits.error_tolerance, True, *position[1:], unit="m"),
        )
    )


def dwells_near_locus(robot: FiveBar, plan: Plan, rate_hz: int) -> list[Dwell]:
    """Return when a motion is near the Type 2 locus: at its crossings, and where it comes close without crossing."""
    return _ReferenceScan(robot, plan, rate_hz, default_tuning(CONTROLLERS["unified"])).dwells(NEAR_LOCUS)


class _ReferenceScan:
    """Evaluates the reference, each sample once."""

    def __init__(self, robot: FiveBar, plan: Plan, rate_hz: int, follower: TunedController) -> None:
        self._robot, self._plan, self._rate_hz = robot, plan, rate_hz
        self._needed = ReferenceTorque(robot, plan, rate_hz, follower)
        self._blended = follower.controller.blended
        self._supervise = Supervisor(plan, rate_hz, follower.controller.weighting)
        self._last = plan.path.samples(rate_hz)
        self._seen: dict[int, ReferenceSample] = {}
        self._coarse = self._with_near_passes(self._coarse_samples())

    def worst(self, name: str, field: str, limit: float, at_most: bool, unit: str = "") -> Figure:
        """Return the extreme of a field: every sample around that of the coarse pass is evaluated."""
        sign = -1.0 if at_most else 1.0

        def measure(sample: int) -> float:
            value: float = getattr(self._sample(sample), field)
            # an undefined figure is the worst
            return -math.inf if math.isnan(value) else sign * value

        first = self._coarse
        place = min(range(len(first)), key=lambda index: measure(first[index]))
        around = range(first[max(place - 1, 0)], first[min(place + 1, len(first) - 1)] + 1)
        sample = min(around, key=measure)
        seen = self._sample(sample)
        return Figure(name, getattr(seen, field), limit, at_most, sample / self._rate_hz, seen.x, seen.y, unit)

    def nearest_to(self, posture: NamedBounds) -> Figure:
        """Return the least time in which the robot, if it went on as it moves, would be in a forbidden posture."""
        times = [
            (min(time_to_posture(posture.bounds, self._reference(t).state), FAR_FROM_FORBIDDEN), t)
            for t in (sample / self._rate_hz for sample in self._coarse)
        ]
        left, t = min(times)
        platform = self._plan.path.at(t)
        name = f"{FORBIDDEN} {posture.name!r}"
        return Figure(name, left, CLEAR, False, t, platform.x, platform.y, "s")

    def worst_rest(self, limit: float) -> Figure:
        """Return the rest with the least kappa."""
        segments = self._plan.path.segments
        times = [segment.start_time for segment in segments] + [self._plan.path.duration]
        kappa, t = min((self._kappa(t), t) for t in times)
        platform = self._plan.path.at(t)
        return Figure(REST, kappa, limit, False, t, platform.x, platform.y)

    def nearest_unguarded(self, limit: float) -> Figure | None:
        """Return where the path is nearest to the locus outside of all zones; None where it is nowhere near.

        Rests, turns and near passes are minima of kappa in time, which the samples need not meet.
        """
        found = [
            (kappa, t) for kappa, t in self._minima() if kappa < NEAR_PASS and not (self._blended and self._guarded(t))
        ]
        if not found:
            return None
        kappa, t = min(found)
        platform = self._plan.path.at(t)
        return Figure(NEAREST, kappa, limit, False, t, platform.x, platform.y)

    def _minima(self) -> list[tuple[float, float]]:
        """Return the local minima of kappa near the locus and their times (s)."""
        times = [sample / self._rate_hz for sample in self._coarse]
        times[-1] = min(times[-1], self._plan.path.duration)
        kappas = [self._kappa(t) for t in times]
        minima = []
        for index in (index for index in _local_minima(kappas) if kappas[index] < 2.0 * NEAR_PASS):
            low, high = times[max(index - 1, 0)], times[min(index + 1, len(times) - 1)]
            refined = minimize_scalar(
                self._kappa, bounds=(low, high), method="bounded", options={"xatol": BOUNDARY_TOLERANCE}
            )
            minima.append(min((kappas[index], times[index]), (float(refined.fun), float(refined.x))))
        return minima

    def _guarded(self, t: float) -> bool:
        """Return whether a constraint law acts at time t (s)."""
        return self._supervise.at(t, self._reference(t).state).sigma > 0.0

    def dwells(self, bound: float) -> list[Dwell]:
        """Return the stretches of time with kappa below a bound, their ends to the microsecond."""
        known = {sample / self._rate_hz: self._sample(sample).kappa for sample in self._coarse}
        # a quick crossing may fall between two samples
        known.update((crossing.time, 0.0) for crossing in self._plan.crossings)
        times = sorted(known)
        near = [known[t] < bound for t in times]
        dwells = []
        start = times[0]
        for index, t in enumerate(times):
            if near[index] and (index == 0 or not near[index - 1]):
                start = t if index == 0 else self._boundary(t, times[index - 1], bound)
            if near[index] and (index + 1 == len(times) or not near[index + 1]):
                dwells.append(
                    Dwell(start, t if index + 1 == len(times) else self._boundary(t, times[index + 1], bound))
                )
        return dwells

    def dwell_at(self, t: float, bound: float) -> Dwell:
        """Return the stretch of time with kappa below a bound that holds the moment of a crossing (s)."""
        return next(dwell for dwell in self.dwells(bound) if dwell.start <= t <= dwell.end)

    def longest(self, name: str, dwells: list[Dwell], limit: float) -> Figure:
        """Return the figure of the longest dwell, at its middle."""
        longest = max(dwells, key=lambda dwell: dwell.end - dwell.start)
        middle = 0.5 * (longest.start + longest.end)
        platform = self._plan.path.at(middle)
        return Figure(name, longest.end - longest.start, limit, True, middle, platform.x, platform.y, "s")

    def _boundary(self, inside: float, outside: float, bound: float) -> float:
        """Return when kappa passes a bound between two times (s)."""
        return float(brentq(lambda t: self._kappa(t) - bound, inside, outside, xtol=BOUNDARY_TOLERANCE))

    def _sample(self, sample: int) -> ReferenceSample:
        seen = self._seen.get(sample)
        if seen is None:
            reference = self._reference(sample / self._rate_hz)
            state = reference.state
            seen = self._seen[sample] = ReferenceSample(
                torque=_largest(*self._needed(sample, reference)),
                speed=_largest(state.leg1.dq1, state.leg2.dq1),
                # a motion that is planned in the motors' angles is meant to meet Type 1
                serial=math.inf if reference.by_motors else type1_margin(state),
                kappa=inverse_condition(state),
                x=state.x,
                y=state.y,
            )
        return seen

    def _reference(self, t: float) -> Reference:
        return desired_at(self._robot, self._plan, t, self._plan.path.at(t))

    def _kappa(self, t: float) -> float:
        return inverse_condition(self._reference(t).state)

    def _coarse_samples(self) -> list[int]:
        """Return samples spread evenly over each segment, and all of them around the crossings."""
        samples = {self._last}
        for segment in self._plan.path.segments:
            first = math.ceil(segment.start_time * self._rate_hz - 1e-6)
            end = min(math.ceil((segment.start_time + segment.duration) * self._rate_hz - 1e-6), self._last)
            samples.update(range(first, end, max(1, (end - first) // COARSE_SAMPLES)))
            if isinstance(segment, RoundedSegment):
                samples.update(self._in_corners(segment))
        reach = math.ceil(CLOSE_RANGE * self._rate_hz)
        for crossing in self._plan.crossings:
            middle = round(crossing.time * self._rate_hz)
            samples.update(range(max(middle - reach, 0), min(middle + reach, self._last) + 1))
        return sorted(samples)

    def _in_corners(self, segment: RoundedSegment) -> Iterator[int]:
        """Yield the samples in the corners of a segment, which may be short against it."""
        for corner in segment.curve.corners():
            first, end = (segment.time_at(s) * self._rate_hz for s in corner)
            yield from range(math.ceil(first), min(math.floor(end), self._last) + 1)

    def _with_near_passes(self, coarse: list[int]) -> list[int]:
        """Return the samples with all those around the minima of kappa near the locus."""
        kappas = [self._sample(sample).kappa for sample in coarse]
        samples = set(coarse)
        for index in _local_minima(kappas):
            if kappas[index] < NEAR_PASS:
                samples.update(range(coarse[max(index - 1, 0)], coarse[min(index + 1, len(coarse) - 1)] + 1))
        return sorted(samples)


def _with_room(edge: float, room: float) -> float:
    """Return `room` times the kappa of a zone's edge, or where that is near 1, the most there is: the same room to 1.

    At low rates zones are so wide that twice their edge is more than a kappa can be.
    """
    return min(room * edge, 1.0 - (1.0 - edge) / room)


def _local_minima(values: list[float]) -> list[int]:
    """Return the indices of the local minima, the ends included."""
    last = len(values) - 1
    return [
        index
        for index, value in enumerate(values)
        if (index == 0 or value <= values[index - 1]) and (index == last or value <= values[index + 1])
    ]


def _largest(*values: float) -> float:
    """Return the largest magnitude, NaN if one is NaN (`max` alone would lose it)."""
    return math.nan if any(math.isnan(value) for value in values) else max(abs(value) for value in values)
