# SPDX-License-Identifier: Apache-2.0
"""Evaluates a reference before the robot moves: the torque that it needs, and where each quantity is worst along it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.compiling import as_machine_code
from fivebar_control.laws.blend import blend
from fivebar_control.laws.reference import Reference
from fivebar_control.laws.registry import CONTROLLERS, TunedController, default_tuning
from fivebar_control.laws.torque import Torque
from fivebar_control.loop.law_runner import LawRunner
from fivebar_control.loop.supervisor import Supervisor
from fivebar_control.model.dynamics import inverse_dynamics
from fivebar_control.model.kinematics import joint_acceleration
from fivebar_control.model.singularity import NEAR_LOCUS, inverse_condition, inverse_condition_rate, type1_margin
from fivebar_control.planning.figures import FORBIDDEN, NEAREST, REST, WORKSPACE, Figure
from fivebar_control.root_search import minimum_between, zero_between
from fivebar_control.safety.forbidden import CLEAR, time_to_posture
from fivebar_control.safety.settings import Area
from fivebar_control.trajectory.desired import desired_along, desired_at, reference_of
from fivebar_control.trajectory.planner import Plan
from fivebar_control.trajectory.rounded import RoundedSegment
from fivebar_control.trajectory.spline import SplineSegment
from fivebar_description.forbidden import NamedBounds
from fivebar_description.parameters import FiveBar, with_floats

FloatArray = NDArray[np.float64]

COARSE_SAMPLES = 200
"""Samples per segment of the coarse pass; around crossings and extremes every sample is evaluated."""

CLOSE_RANGE = 0.06
"""Time (s) before and after a crossing in which every sample is evaluated."""

BOUNDARY_TOLERANCE = 1e-6
"""Time (s) to which beginning and end of a dwell near the locus are found."""

FAR_FROM_FORBIDDEN = 1.0
"""Times (s) to a forbidden posture are not reported beyond this one."""

NEAR_PASS = 2.0 * NEAR_LOCUS
"""Below this kappa every sample around a local minimum is evaluated."""


class ReferenceTorque:
    """The torque that a controller needs on a plan, sample by sample: what a motion costs, known beforehand.

    Off the Type 2 locus this is the inverse dynamics (1.30, 1.31). On it the inverse dynamics of a motion that knows
    nothing of the locus is infinite, but no controller that crosses requests it: a blended controller hands over to its
    constraint law, and a law that is regular there regularises the uncontrollable direction. There the torque is the
    controller's own: what it requests while the robot is exactly on its reference, before limits.

    A regular law leaves out a little everywhere, by its weight on torque. Off the locus that only postpones the torque,
    so what counts there is the inverse dynamics, not what the law would request without an error.
    """

    def __init__(self, robot: FiveBar, plan: Plan, rate_hz: int, follower: TunedController) -> None:
        """Bind the controller to a robot, a plan and a sampling rate (Hz)."""
        self._robot = robot
        self._plan = plan
        self._rate_hz = rate_hz
        self._regular = follower.controller.needs_no_zones
        own = follower.nominal if self._regular else follower.constraint
        self._own = None if own is None else own.unlimited()
        self._memory: Any = None
        self.supervise = Supervisor(plan, rate_hz, follower.controller.weighting)
        """Decides what share its own answer has, where it is blended."""

    def __call__(self, sample: int, reference: Reference) -> Torque:
        """Return the torque (Nm) for a sample of the reference; NaN where the controller has none."""
        state, full = reference.state, full_torque(self._robot, reference)
        kappa_rate = inverse_condition_rate(state) if self.supervise.forecasts else 0.0
        share = self.own_share(sample, inverse_condition(state), kappa_rate)
        if self._own is None or reference.by_motors or not share > 0.0:
            return full
        # every sample is answered with the memory before the first one
        runner = LawRunner(self._own, self._robot, self._plan, self._rate_hz, self._memory)
        self._memory = runner.memory
        return blend(share, full, runner(sample, state, reference))

    def own_share(self, sample: int, kappa: float, kappa_rate: float) -> float:
        """Return the share of the controller's own answer in its torque, from 0, for `full_torque`, to 1.

        |d kappa / dt| (1/s) counts where the supervisor forecasts.
        """
        if self._own is None:
            return 0.0
        if self._regular:
            return 1.0 if kappa < NEAR_LOCUS else 0.0
        return self.supervise.weight(sample / self._rate_hz, kappa, kappa_rate)


def full_torque(robot: FiveBar, reference: Reference) -> Torque:
    """Return the inverse dynamics of a reference (Nm)."""
    if reference.by_motors:
        return Torque(reference.u1 + reference.f1, reference.u2 + reference.f2)
    ddq11 = joint_acceleration(reference.state.leg1, reference.ax, reference.ay)
    ddq21 = joint_acceleration(reference.state.leg2, reference.ax, reference.ay)
    tau1, tau2 = inverse_dynamics(robot, reference.state, ddq11, ddq21, reference.f1, reference.f2)
    return Torque(tau1, tau2)


class ReferenceSample(NamedTuple):
    """The reference at one sample: torque (Nm), speed (rad/s), |sin q_i2|, kappa, place (m)."""

    torque: float
    speed: float
    serial: float
    kappa: float
    x: float
    y: float


def sample_of(robot: FiveBar, reference: Reference) -> ReferenceSample:
    """Return the quantities of a desired instant, with the torque of its inverse dynamics."""
    state, torque = reference.state, full_torque(robot, reference)
    return ReferenceSample(
        torque=larger(torque.tau1, torque.tau2),
        speed=larger(state.leg1.dq1, state.leg2.dq1),
        # a motion that is planned in the motors' angles is meant to meet Type 1
        serial=math.inf if reference.by_motors else type1_margin(state),
        kappa=inverse_condition(state),
        x=state.x,
        y=state.y,
    )


def samples_of(robot: FiveBar, references: FloatArray) -> list[ReferenceSample]:
    """Return the quantities of desired instants, given as `write_reference` writes them."""
    samples = np.empty((len(references), len(ReferenceSample._fields)))
    as_machine_code(write_samples)(with_floats(robot), references, samples)
    return [ReferenceSample(*row) for row in samples.tolist()]


def write_samples(robot: FiveBar, references: FloatArray, samples: FloatArray) -> None:
    """Write the quantities of desired instants into rows, [N, 6] as in `ReferenceSample`."""
    for number in range(len(references)):
        for index, value in enumerate(sample_of(robot, reference_of(references[number]))):
            samples[number, index] = value


def larger(first: float, second: float) -> float:
    """Return the larger magnitude, NaN if one is NaN (`max` alone would lose it)."""
    first, second = abs(first), abs(second)
    return first if first >= second or math.isnan(first) else second


class Dwell(NamedTuple):
    """A stretch of time (s) during which kappa is below a bound."""

    start: float
    end: float


def dwells_near_locus(robot: FiveBar, plan: Plan, rate_hz: int) -> list[Dwell]:
    """Return when a motion is near the Type 2 locus: at its crossings, and where it comes close without crossing."""
    return ReferenceScan(robot, plan, rate_hz, default_tuning(CONTROLLERS["unified"])).dwells(NEAR_LOCUS)


class ReferenceScan:
    """The reference of a plan at the controllers' samples, each evaluated once, and the extremes of its quantities."""

    def __init__(self, robot: FiveBar, plan: Plan, rate_hz: int, follower: TunedController) -> None:
        """Evaluate it coarsely, and every sample where it comes near the locus."""
        self._robot, self._plan, self._rate_hz = robot, plan, rate_hz
        self._needed = ReferenceTorque(robot, plan, rate_hz, follower)
        self._blended = follower.controller.blended
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
        measured = [measure(coarse) for coarse in first]
        place = measured.index(min(measured))
        around = range(first[max(place - 1, 0)], first[min(place + 1, len(first) - 1)] + 1)
        self._evaluate(around)
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

    def nearest_edge(self, area: Area) -> Figure:
        """Return where the reference is nearest to the edge of an area, negative beyond it; no motion may pass that."""
        ends = [segment.start_time for segment in self._plan.path.segments] + [self._plan.path.duration]
        seen = [(t, self._plan.path.at(t)) for t in (*ends, *(sample / self._rate_hz for sample in self._coarse))]

        def distance(x: float, y: float) -> float:
            return min(x - area.x_min, area.x_max - x, y - area.y_min, area.y_max - y)

        left, t, x, y = min((distance(place.x, place.y), t, place.x, place.y) for t, place in seen)
        return Figure(WORKSPACE, left, 0.0, False, t, x, y, "m")

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
        near_passes = [
            (kappa, t) for kappa, t in self._minima() if kappa < NEAR_PASS and not (self._blended and self._guarded(t))
        ]
        if not near_passes:
            return None
        kappa, t = min(near_passes)
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
            time, kappa = minimum_between(self._kappa, low, high, BOUNDARY_TOLERANCE)
            minima.append(min((kappas[index], times[index]), (kappa, time)))
        return minima

    def _guarded(self, t: float) -> bool:
        """Return whether a constraint law acts at time t (s)."""
        return self._needed.supervise.at(t, self._reference(t).state).sigma > 0.0

    def dwells(self, bound: float) -> list[Dwell]:
        """Return the stretches of time with kappa below a bound, their ends to the microsecond."""

        def beyond(t: float) -> float:
            return self._kappa(t) - bound

        known = {sample / self._rate_hz: self._sample(sample).kappa for sample in self._coarse}
        # a quick crossing may fall between two samples
        known.update((crossing.time, 0.0) for crossing in self._plan.crossings)
        times = sorted(known)
        near = [known[t] < bound for t in times]
        dwells = []
        start = times[0]
        for index, t in enumerate(times):
            if near[index] and (index == 0 or not near[index - 1]):
                start = t if index == 0 else zero_between(beyond, t, times[index - 1], BOUNDARY_TOLERANCE)
            if near[index] and (index + 1 == len(times) or not near[index + 1]):
                last = index + 1 == len(times)
                dwells.append(
                    Dwell(start, t if last else zero_between(beyond, t, times[index + 1], BOUNDARY_TOLERANCE))
                )
        return dwells

    def dwell_at(self, t: float, bound: float) -> Dwell:
        """Return the stretch of time with kappa below a bound that holds the moment of a crossing (s)."""
        return next(dwell for dwell in self.dwells(bound) if dwell.start <= t <= dwell.end)

    def longest(self, name: str, dwells: list[Dwell], limit: float) -> Figure:
        """Return the figure of the longest dwell, at its middle."""
        lengths = [dwell.end - dwell.start for dwell in dwells]
        longest = dwells[lengths.index(max(lengths))]
        middle = 0.5 * (longest.start + longest.end)
        platform = self._plan.path.at(middle)
        return Figure(name, longest.end - longest.start, limit, True, middle, platform.x, platform.y, "s")

    def _sample(self, sample: int) -> ReferenceSample:
        if sample not in self._seen:
            self._evaluate([sample])
        return self._seen[sample]

    def _evaluate(self, samples: Iterable[int]) -> None:
        """Evaluate the reference at those of some samples at which it has not been yet."""
        new = [sample for sample in samples if sample not in self._seen]
        if not new:
            return
        references = desired_along(self._robot, self._plan, [sample / self._rate_hz for sample in new])
        for sample, seen, row in zip(new, samples_of(self._robot, references), references, strict=True):
            rate = inverse_condition_rate(reference_of(row.tolist()).state) if self._needed.supervise.forecasts else 0.0
            if self._needed.own_share(sample, seen.kappa, rate) > 0.0:
                torque = self._needed(sample, reference_of(row.tolist()))
                seen = seen._replace(torque=larger(torque.tau1, torque.tau2))
            self._seen[sample] = seen

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
            parts = len(segment.knots) - 1 if isinstance(segment, SplineSegment) else 1
            samples.update(range(first, end, max(1, (end - first) // (COARSE_SAMPLES * parts))))
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
        self._evaluate(coarse)
        kappas = [self._seen[sample].kappa for sample in coarse]
        samples = set(coarse)
        for index in _local_minima(kappas):
            if kappas[index] < NEAR_PASS:
                samples.update(range(coarse[max(index - 1, 0)], coarse[min(index + 1, len(coarse) - 1)] + 1))
        self._evaluate(sorted(samples))
        return sorted(samples)


def _local_minima(values: list[float]) -> list[int]:
    """Return the indices of the local minima, the ends included."""
    last = len(values) - 1
    return [
        index
        for index, value in enumerate(values)
        if (index == 0 or value <= values[index - 1]) and (index == last or value <= values[index + 1])
    ]
