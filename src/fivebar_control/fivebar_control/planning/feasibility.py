"""Feasibility of a planned motion, checked before the robot moves: each figure, its limit, and where it is worst."""

from __future__ import annotations

import math
from typing import NamedTuple

from scipy.optimize import brentq

from fivebar_control.laws.reference import Reference
from fivebar_control.laws.registry import CONTROLLERS, TunedController, default_tuning
from fivebar_control.model.singularity import NEAR_LOCUS, inverse_condition, type1_margin
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.planning.reference_torque import ReferenceTorque
from fivebar_control.trajectory.desired import desired_at
from fivebar_control.trajectory.planner import Plan
from fivebar_control.trajectory.refusal import place
from fivebar_description.parameters import FiveBar

COARSE_SAMPLES = 200
"""Samples per segment of the coarse pass; around crossings and extremes every sample is evaluated."""

CLOSE_RANGE = 0.06
"""Time (s) before and after a crossing in which every sample is evaluated."""

REST_ROOM = 2.0
"""A blended controller's rests have this many times the kappa at the edge of the widest zone: with less, motions that
arrive quickly end beside the goal or fall back across the locus."""

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


TORQUE, SPEED, SERIAL, DWELL, ZONE_STAY, REST, DIRECTION = (
    "reference torque",
    "motor speed",
    "|sin q_i2|",
    "time near the Type 2 locus",
    "time in a blending zone",
    "1/cond(A) at rest",
    "|n.v1| where the path crosses the Type 2 locus",
)
"""Names of the figures."""


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


def screen(robot: FiveBar, plan: Plan, rate_hz: int, follower: TunedController, limits: MotionLimits) -> Feasibility:
    """Judge a plan: torque, joint speeds, distance to Type 1, dwells near Type 2, rests and directions.

    Torque and speed are those of the reference at the samples of `rate_hz`, the only ones that a controller sees.
    """
    scan = _ReferenceScan(robot, plan, rate_hz, follower)
    zone_edge = max((2.0 * crossing.epsilon for crossing in plan.crossings), default=0.0)
    room = REST_ROOM if follower.controller.blended else 1.0
    figures = [
        scan.worst(TORQUE, "torque", limits.torque_share * limits.torque, True, "Nm"),
        scan.worst(SPEED, "speed", limits.motor_speed, True, "rad/s"),
        scan.worst(SERIAL, "serial", limits.serial_margin, False),
        scan.worst_rest(max(limits.rest, room * zone_edge)),
    ]
    dwells = scan.dwells(NEAR_LOCUS)
    if dwells:
        figures.append(scan.longest(DWELL, dwells, limits.dwell))
    if follower.controller.blended and plan.crossings:
        zones = [scan.dwell_at(crossing.time, 2.0 * crossing.epsilon) for crossing in plan.crossings]
        figures.append(scan.longest(ZONE_STAY, zones, limits.zone_stay))
        least = min(plan.crossings, key=lambda crossing: crossing.authority)
        place = (least.time, least.x, least.y)
        figures.append(Figure(DIRECTION, least.authority, limits.authority, False, *place))
    return Feasibility(tuple(figures))


def dwells_near_locus(robot: FiveBar, plan: Plan, rate_hz: int) -> list[Dwell]:
    """Return when a motion is near the Type 2 locus: at its crossings, and where it comes close without crossing."""
    return _ReferenceScan(robot, plan, rate_hz, default_tuning(CONTROLLERS["unified"])).dwells(NEAR_LOCUS)


class _ReferenceScan:
    """Evaluates the reference, each sample once."""

    def __init__(self, robot: FiveBar, plan: Plan, rate_hz: int, follower: TunedController) -> None:
        self._robot, self._plan, self._rate_hz = robot, plan, rate_hz
        self._needed = ReferenceTorque(robot, plan, rate_hz, follower)
        self._last = plan.path.samples(rate_hz)
        self._seen: dict[int, ReferenceSample] = {}
        self._coarse = self._coarse_samples()

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

    def worst_rest(self, limit: float) -> Figure:
        """Return the rest with the least kappa."""
        segments = self._plan.path.segments
        times = [segment.start_time for segment in segments] + [self._plan.path.duration]
        kappa, t = min((self._kappa(t), t) for t in times)
        platform = self._plan.path.at(t)
        return Figure(REST, kappa, limit, False, t, platform.x, platform.y)

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
        reach = math.ceil(CLOSE_RANGE * self._rate_hz)
        for crossing in self._plan.crossings:
            middle = round(crossing.time * self._rate_hz)
            samples.update(range(max(middle - reach, 0), min(middle + reach, self._last) + 1))
        return sorted(samples)


def _largest(*values: float) -> float:
    """Return the largest magnitude, NaN if one is NaN (`max` alone would lose it)."""
    return math.nan if any(math.isnan(value) for value in values) else max(abs(value) for value in values)
