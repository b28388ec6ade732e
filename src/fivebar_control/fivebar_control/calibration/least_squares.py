# SPDX-License-Identifier: Apache-2.0
"""The least squares of a calibration: residuals, their derivatives, and the iteration; see `calibration`."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.calibration.arrowhead import Reduced, Rows, projected, reduced
from fivebar_control.calibration.closure import GEOMETRY, L_22, ZERO_1, Closure, closure, distal_angles
from fivebar_control.calibration.parameters import (
    BIAS,
    COMPLIANCE,
    DELAY,
    PLAY,
    SCALE,
    deviations_before,
    values_before,
)
from fivebar_control.calibration.record import (
    Angles,
    CalibrationRecord,
    ContradictsRobot,
    NotCalibratable,
    SeenPositions,
    TouchedPoint,
    Turned,
    Turning,
    angles,
)
from fivebar_control.calibration.result import Calibration, LocusPassage, covariance_of
from fivebar_control.calibration.seen import SeenRows
from fivebar_description.parameters import FiveBar
from fivebar_description.tolerances import Tolerances

FloatArray = NDArray[np.float64]

NEAR = 0.3
"""|det A| below which an angle theta_2 is not distinguished from its mirror image to begin with."""

DRIFT = 0.15
"""Difference (rad) between an integrated angle theta_2 and the nearest one of the geometry that is taken for drift."""

UNKNOWN = 10.0
"""Standard deviation (rad) of the change of theta_2 where the gyroscope has a gap."""

ITERATIONS = 60
SETTLED = 1e-6
"""Change, in standard deviations, at which the iteration ends."""

SPAN = 5
"""Samples to either side from which a motor's direction follows."""

FARTHEST = 30.0
"""Deviations from what is known before beyond which no parameter is looked for."""

COMMON = 0.1
"""Part of what the transmissions yield that counts as a common error of the closure, which no repetition averages out;
found by the coverage of the intervals on elastic robots."""

DIFFERENCE = 1e-6
"""Change of a parameter (m, rad) by which a derivative is found."""

BLOCK = 0.25
"""Time (s) after which residuals are taken for independent."""

LEAST_TIME = 1.0
"""Shortest recording (s)."""

LARGEST_RESIDUAL = 3e-4
"""Root mean square (m) of the closure's residuals beyond which the recording is that of another robot."""

EXPLAINED = 3.0
"""Root mean square of residuals, in standard deviations of what is declared, beyond which a fit explains nothing."""


class ClosureFit(NamedTuple):
    """Values and states of the unknowns, and the sum of squares that they leave."""

    values: FloatArray
    states: FloatArray
    cost: float


class ClosureProblem:
    """The least squares: values, [15], with a camera [19], and the states.

    These are the angles theta_2 of the samples and of the touched points.
    """

    def __init__(
        self,
        robot: FiveBar,
        tolerances: Tolerances,
        record: CalibrationRecord,
        turned: Turning,
        touched: tuple[TouchedPoint, ...],
        seen: SeenPositions,
        known: Calibration | None = None,
    ) -> None:
        """Make the recording ready; `known` is what earlier ones of the same robot say of its geometry."""
        covered = (record.times >= record.imu_times[0]) & (record.times <= record.imu_times[-1])
        self._times = record.times[covered]
        if len(self._times) < 3 or self._times[-1] - self._times[0] < LEAST_TIME:
            raise NotCalibratable(
                f"too short: motors and gyroscope overlap for {np.ptp(self._times) if self._times.size else 0.0:.2f} s,"
                f" expected at least {LEAST_TIME:g} s"
            )
        read = angles(record._replace(times=self._times, motors=record.motors[covered]))
        self._turning = turned
        self._seen = SeenRows(seen, self._times)
        self._start = values_before(robot, len(self._seen) > 0)
        self._before = deviations_before(robot, tolerances, len(self._seen) > 0)
        self._expected, self._prior = self._start.copy(), np.diag(1.0 / self._before**2)
        if known is not None:
            part = slice(len(GEOMETRY))
            self._expected[part] = known.values[part]
            self._prior[part, part] = covariance_of(known.covariance[part, part], 1.0 / self._before[part])
        self._gyro = Turned(record.imu_times, turned)
        self._samples = len(self._times)
        places = np.array([(point.q11, point.q21) for point in touched]).reshape(-1, 2)
        variances = np.full(places.shape, np.median(read.variances))
        self._read = Angles(
            np.concatenate((read.values, places)), np.concatenate((read.variances, variances)), read.resolution
        )
        # a touched point is read at rest, where it is not known on which flank the motor stands
        rest = np.zeros(places.shape)
        self._ahead = np.concatenate((_directions(self._read.values[: self._samples], read.resolution), rest))
        self._torques = np.concatenate((record.torques[covered], rest))
        self._touched = touched
        self.colour = 1.0
        lasting = np.diff(self._times)
        covered_by_gyro = self._gyro.known(self._times)
        self._chain_deviation = np.where(covered_by_gyro, turned.noise * np.sqrt(turned.period * lasting), UNKNOWN)

    @property
    def _states(self) -> int:
        return len(self._read.values)

    def starts(self) -> list[tuple[FloatArray, FloatArray]]:
        """Return values and states to begin with, the two of the lowest cost.

        Either assembly mode may be the first, and the gyroscope's bias either 0 or what it reads while the motors rest:
        motors may also rest while the link turns, held by friction and play.
        """
        resting = np.all(np.diff(self._read.values[: self._samples], axis=0) == 0.0, axis=1)
        turned = self._gyro.between(self._times, 0.0) / np.diff(self._times)
        biases = [0.0, *([float(np.median(turned[resting]))] if np.any(resting) else [])]
        states = [self._first_states(assembly, bias) for assembly in (0, 1) for bias in biases]
        states.sort(key=lambda candidate: self._cost(self._rows(self._expected, candidate), self._expected))
        return [(self._expected, state) for state in states[:2]]

    def fitted(self, values: FloatArray, states: FloatArray) -> ClosureFit:
        """Return the fit that begins at values and states."""
        damping = 0.0
        rows = self._rows(values, states)
        cost = self._cost(rows, values)
        for _ in range(ITERATIONS):
            step = reduced(rows, self._states, damping)
            gradient = step.gradient + self._prior @ (values - self._expected)
            scale = self._before
            damped = self._prior + np.diag(damping / self._before**2)
            matrix = (step.information + damped) * np.outer(scale, scale)
            change = -scale * np.linalg.solve(matrix, scale * gradient)
            moved = step.offset + step.response @ change
            tried_values, tried_states = values + change, states + moved
            far = bool(np.any(np.abs(tried_values - self._expected) > FARTHEST * self._before))
            tried = self._rows(tried_values, tried_states)
            tried_cost = self._cost(tried, tried_values)
            if far or not tried_cost <= cost * (1.0 + 1e-12):
                damping = max(10.0 * damping, 1e-4)
                if damping > 1e6:
                    break
                continue
            settled = cost - tried_cost <= SETTLED * max(1.0, 1e-6 * cost)
            values, states, rows, cost = tried_values, tried_states, tried, tried_cost
            damping *= 0.1 if damping > 1e-6 else 0.0
            if settled:
                break
        return ClosureFit(values, states, cost)

    def _first_states(self, assembly: int, bias: float) -> FloatArray:
        """Return angles theta_2 that follow the gyroscope from an assembly mode on, held to the geometry's own.

        The assembly mode is 0 for det A < 0, else 1.
        """
        start = self._expected[: len(GEOMETRY)]
        both = distal_angles(start, self._read.values)
        across = closure(start, self._read.values, both[:, 1]).across
        clear = np.abs(across) > NEAR
        first = int(np.argmax(clear)) if np.any(clear[: self._samples]) else 0
        turned = self._gyro.between(self._times, 0.0) - bias * np.diff(self._times)
        states = np.empty(self._states)
        states[first] = both[first, assembly]
        for number in range(first - 1, -1, -1):
            states[number] = states[number + 1] - turned[number]
        angle, pairs, sure = states[first], both.tolist(), clear.tolist()
        for number in range(first + 1, self._samples):
            angle += float(turned[number - 1])
            if sure[number]:
                near = min((math.remainder(pair - angle, 2.0 * math.pi) for pair in pairs[number]), key=abs)
                if abs(near) < DRIFT:
                    angle += near
            states[number] = angle
        for number, point in enumerate(self._touched, self._samples):
            errors = [_distance(start, self._read.values[number], theta, point) for theta in pairs[number]]
            states[number] = pairs[number][errors.index(min(errors))]
        return states

    def _links(self, values: FloatArray) -> FloatArray:
        """Return [n, 2], the angles of the proximal links (rad), zeros included."""
        links: FloatArray = self._read.values - self._ahead * values[PLAY] - self._torques * values[COMPLIANCE]
        return links

    def _closure(self, values: FloatArray, states: FloatArray) -> tuple[Closure, FloatArray]:
        closed = closure(values[: len(GEOMETRY)], self._links(values), states)
        return closed, np.sqrt(np.sum(closed.by_motors**2 * self._read.variances, axis=1))

    def _growth(self, values: FloatArray, states: FloatArray, deviation: FloatArray) -> FloatArray:
        """Return [n, 8], the relative derivatives of the closure's deviations by the geometry, by differences.

        A smaller robot has smaller gaps, and deviations that are as much smaller: without these derivatives each step
        would take it for one that fits better.
        """
        growth = np.empty((self._states, len(GEOMETRY)))
        for number in range(len(GEOMETRY)):
            changed = values.copy()
            changed[number] += DIFFERENCE
            growth[:, number] = (self._closure(changed, states)[1] / deviation - 1.0) / DIFFERENCE
        return growth

    def _rows(self, values: FloatArray, states: FloatArray) -> Rows:
        closed, deviation = self._closure(values, states)
        count, chained = self._states, self._samples - 1
        by = np.zeros((count, len(values)))
        by[:, : len(GEOMETRY)] = closed.by_geometry - closed.gap[:, None] * self._growth(values, states, deviation)
        by[:, PLAY] = -closed.by_motors * self._ahead
        by[:, COMPLIANCE] = -closed.by_motors * self._torques
        parts = [
            Rows(
                closed.gap / deviation,
                by / deviation[:, None],
                closed.by_theta / deviation,
                np.zeros(count),
                np.arange(count),
            )
        ]
        weight = 1.0 / self._chain_deviation
        sensitivity = 1.0 + values[SCALE]
        turned = np.diff(states[: self._samples])
        lasting = np.diff(self._times)
        by = np.zeros((chained, len(values)))
        by[:, BIAS] = lasting
        by[:, SCALE] = turned
        by[:, DELAY] = -self._gyro.change(self._times, values[DELAY])
        parts.append(
            Rows(
                (sensitivity * turned + values[BIAS] * lasting - self._gyro.between(self._times, values[DELAY]))
                * weight,
                by * weight[:, None],
                -sensitivity * weight,
                sensitivity * weight,
                np.arange(chained),
            )
        )
        if self._touched:
            parts += self._touched_rows(values, states, closed)
        if len(self._seen):
            parts += self._seen.rows(values, states, self._links(values), self._ahead, self._torques, closed)
        residual, by_parameters, by_state, by_next, number = (
            np.concatenate(columns) for columns in zip(*parts, strict=True)
        )
        share = 1.0 / math.sqrt(self.colour)
        return Rows(share * residual, share * by_parameters, share * by_state, share * by_next, number)

    def _touched_rows(self, values: FloatArray, states: FloatArray, closed: Closure) -> list[Rows]:
        """Return the rows of x and of y of the touched points."""
        first = self._samples
        number = np.arange(first, self._states)
        measured = np.array([(touch.x, touch.y) for touch in self._touched])
        weight = 1.0 / np.array([touch.deviation for touch in self._touched])
        geometry, theta = values[: len(GEOMETRY)], states[first:]
        q_21 = self._read.values[first:, 1] - geometry[ZERO_1 + 1]
        rows = []
        for axis, (r_2, across, u_2, turned) in enumerate(
            (
                (np.cos(q_21), -np.sin(q_21), np.cos(theta), -np.sin(theta)),
                (np.sin(q_21), np.cos(q_21), np.sin(theta), np.cos(theta)),
            )
        ):
            by = np.zeros((len(number), len(values)))
            by[:, 2], by[:, 3] = r_2, u_2
            by[:, 5] = 1.0 if axis == 0 else 0.0
            by[:, 7] = -geometry[2] * across
            rows.append(
                Rows(
                    (closed.platform[first:, axis] - measured[:, axis]) * weight,
                    by * weight[:, None],
                    geometry[L_22] * turned * weight,
                    np.zeros(len(number)),
                    number,
                )
            )
        return rows

    def _cost(self, rows: Rows, values: FloatArray) -> float:
        moved = values - self._expected
        return float(rows.residual @ rows.residual + moved @ self._prior @ moved)

    def found_colour(self, fit: ClosureFit) -> float:
        """Return the factor by which correlated residuals widen the variances, at least 1."""
        rows = self._rows(fit.values, fit.states)
        step = reduced(rows, self._states)
        return max(1.0, self._misfit(rows), self._colour(rows, step))

    def _misfit(self, rows: Rows) -> float:
        return float(rows.residual @ rows.residual) / max(len(rows.residual) - self._states, 1)

    def result(self, fit: ClosureFit) -> Calibration:
        """Return the calibration of a fit.

        Raises:
            NotCalibratable: it does not cross the locus, or does not explain the recording.
        """
        values, states = fit.values, fit.states
        rows = self._rows(values, states)
        step = reduced(rows, self._states)
        misfit = self._misfit(rows) * self.colour
        closed, deviation = self._closure(values, states)
        self._refuse_unexplained(rows, closed, deviation)
        across = closed.across[: self._samples]
        crossings = _crossings(closed, across)
        if not crossings:
            raise NotCalibratable(
                f"no crossing: the motion stays in one assembly mode, |det A| of at least {np.min(np.abs(across)):.2f}:"
                " expected one that goes through the Type 2 locus and back"
            )
        rigid = closure(values[: len(GEOMETRY)], self._read.values, states).gap[: self._samples]
        yielding = float(np.sqrt(np.mean(rigid[np.abs(across) < NEAR] ** 2)))
        covariance = covariance_of(step.information + self._prior, self._before)
        # of what yields, a part is the same at every crossing
        common = np.zeros(len(rows.residual))
        common[: self._samples] = COMMON * yielding / deviation[: self._samples] / math.sqrt(self.colour)
        shift = covariance @ (projected(rows, step.response).T @ common)
        covariance += np.outer(shift, shift)
        return Calibration(
            start=self._start,
            values=values,
            covariance=covariance,
            before=self._before,
            information=step.information + self._prior - np.diag(1.0 / self._before**2),
            times=self._times,
            theta=states[: self._samples],
            platform=closed.platform[: self._samples],
            residuals=closed.gap[: self._samples],
            across=across,
            yielding=yielding,
            crossings=crossings,
            misfit=misfit,
            colour=self.colour,
            turning=self._turning,
            resolution=self._read.resolution,
            seen=len(self._seen),
        )

    def _refuse_unexplained(self, rows: Rows, closed: Closure, deviation: FloatArray) -> None:
        """Refuse a fit whose residuals are larger than what is declared of robot and sensors.

        The closure may stay open by the encoders' noise and by what transmissions yield, which is known before to
        their play; the angles may leave the gyroscope's by its noise.

        Raises:
            ContradictsRobot: they are.
        """
        residual = math.sqrt(float(np.mean(closed.gap**2)))
        yielding = np.sum((closed.by_motors * self._before[PLAY]) ** 2, axis=1)
        open_by = math.sqrt(float(np.mean(closed.gap**2 / (deviation**2 + yielding))))
        chained = rows.residual[self._states : self._states + self._samples - 1]
        turned_by = math.sqrt(self.colour * float(np.mean(chained**2)))
        if residual > LARGEST_RESIDUAL or max(open_by, turned_by) > EXPLAINED:
            raise ContradictsRobot(
                f"the recording contradicts the robot: the loop stays open by {1e3 * residual:.2g} mm, {open_by:.2g}"
                f" times what noise and play of the motors explain, and the link turns by {turned_by:.2g} times the"
                f" gyroscope's noise otherwise than it reads, expected at most {EXPLAINED:g}: are robot, tolerances,"
                " motor order and signs, and the IMU's place on the distal link of leg 2 those of the recording?"
            )

    def _colour(self, rows: Rows, step: Reduced) -> float:
        """Return the variance of the scores over blocks of time, relative to that of independent residuals."""
        scores = projected(rows, step.response) * rows.residual[:, None]
        moment = np.concatenate((self._times, np.full(self._states - self._samples, self._times[-1])))[rows.state]
        block = np.floor((moment - self._times[0]) / BLOCK).astype(np.int64)
        sums = np.stack([np.bincount(block, column) for column in scores.T], axis=1)
        scaled = self._before[:, None] * step.information * self._before
        strength, directions = np.linalg.eigh(scaled)
        seen = strength > 1.0
        along = (sums * self._before) @ directions[:, seen]
        return float(np.mean(np.sum(along**2, axis=0) / strength[seen])) if np.any(seen) else 1.0


def _directions(motors: FloatArray, resolution: float) -> FloatArray:
    """Return -1, 0 or 1 for the direction in which each motor turns, [n, 2]; 0 at rest."""
    number = np.arange(len(motors))
    before, after = np.maximum(number - SPAN, 0), np.minimum(number + SPAN, len(motors) - 1)
    moved = motors[after] - motors[before]
    return np.where(np.abs(moved) > 2.0 * resolution, np.sign(moved), 0.0)


def _distance(geometry: FloatArray, motors: FloatArray, theta: float, point: TouchedPoint) -> float:
    (place,) = closure(geometry, motors[None, :], np.array([theta])).platform
    return math.hypot(place[0] - point.x, place[1] - point.y)


def _crossings(closed: Closure, across: FloatArray) -> list[LocusPassage]:
    """Return the samples before a change of the sign of det A."""
    signs = np.sign(across)
    return [LocusPassage(int(k), closed.by_geometry[k]) for k in np.flatnonzero(signs[1:] * signs[:-1] < 0.0)]
