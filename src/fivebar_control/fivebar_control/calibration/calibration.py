"""Calibration of the geometry by least squares over encoders, gyroscope and touched points.

With two motors and two degrees of freedom the motors' encoders alone fit any geometry, but on the Type 2 locus. The
gyroscope of the distal link adds its angle theta_2, up to where it starts: between two samples it turns by the integral
of the readings, so that neither angles nor rates are differentiated. At every sample k the closure (see `closure`) must
hold within the encoders' noise, and between samples the angles theta_2,k follow the gyroscope within its own:

    F(q_11,k, q_21,k, theta_2,k) = n_q
    (1 + kappa) (theta_2,k+1 - theta_2,k) + b T_k - G_k = n_g,    G_k = integral of the readings.

Unknown are the geometry, the gyroscope's bias b, error kappa of its sensitivity and delay of its stamps, and all
theta_2,k. The geometry's tolerances before the calibration are part of the least squares, as what is known from
elsewhere: what cannot be seen stays as it was.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.calibration.arrow import Reduced, Rows, projected, reduced
from fivebar_control.calibration.closure import (
    GEOMETRY,
    L_22,
    ZERO_1,
    Closure,
    closure,
    distal_angles,
    geometry_of,
    locus_rows,
)
from fivebar_control.calibration.record import (
    Angles,
    CalibrationRecord,
    NotCalibratable,
    Turned,
    Turning,
    angles,
    turning,
)
from fivebar_control.calibration.turning_points import turning_points
from fivebar_control.identification.cutoff import encoder_resolution
from fivebar_description.imu import ImuSettings
from fivebar_description.parameters import FiveBar
from fivebar_description.tolerances import Tolerances

FloatArray = NDArray[np.float64]

SENSOR = ("gyro_bias", "gyro_scale", "imu_delay")
"""Bias (rad/s), sensitivity and delay (s) of the gyroscope's readings."""

DRIVE = ("play_1", "play_2", "compliance_1", "compliance_2")
"""By how much a motor is ahead of its link: half of the play (rad), and rad per Nm of torque."""

PARAMETERS = (*GEOMETRY, *SENSOR, *DRIVE)
"""What is calibrated."""

BIAS, SCALE, DELAY = range(len(GEOMETRY), len(GEOMETRY) + len(SENSOR))
PLAY = slice(DELAY + 1, DELAY + 3)
COMPLIANCE = slice(DELAY + 3, DELAY + 5)

BIAS_BOUND, DELAY_BOUND, PLAY_BOUND, COMPLIANCE_BOUND = 0.2, 0.02, 1e-3, 1e-3
"""Standard deviations of the gyroscope's bias (rad/s) and delay (s), and of play (rad) and compliance (rad/Nm), before
the calibration."""

HELD = 1e-9
"""Standard deviation of a parameter whose tolerance is 0 (m, rad)."""

NEAR = 0.3
"""|det A| below which an angle theta_2 is not told from its mirror image to begin with."""

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

BLOCK = 0.25
"""Time (s) after which residuals are taken for independent."""

LEAST_TIME = 1.0
"""Shortest recording (s)."""

LARGEST_RESIDUAL, LARGEST_MISFIT = 3e-4, 1000.0
"""Root mean square (m) of the closure's residuals, and mean of all squared ones, about 1 expected, beyond which the
recording is that of another robot."""

CONFIDENCE, QUANTILE = 0.95, 1.959964
"""Of the intervals, and of the normal distribution for it."""


class TouchedPoint(NamedTuple):
    """A measured place of the platform: readings of both motors there (rad), x and y (m), and their deviation (m)."""

    q11: float
    q21: float
    x: float
    y: float
    deviation: float


class Crossing(NamedTuple):
    """A passage through the Type 2 locus: its sample, and the row of the elbow gap's derivatives, [8]."""

    sample: int
    row: FloatArray


class Calibration(NamedTuple):
    """A calibrated geometry.

    Attributes:
        start: [15], parameters before, in the order of `PARAMETERS`.
        values: [15], and after.
        covariance: [15, 15], with what was known before.
        before: [15], standard deviations before.
        information: [15, 15], of the recording alone.
        times: [k], of the samples that were used (s).
        theta: [k], the distal link's angle there (rad).
        platform: [k, 2], the platform there (m).
        residuals: [k], of the closure (m).
        across: [k], det A.
        yielding: by how much play and elasticity of the transmissions open the loop near the locus, root mean square
            (m): an estimator that takes them as rigid finds the geometry wrong by that.
        crossings: passages through the locus.
        misfit: mean of the squared residuals in units of their variances; 1 where robot and noise are as modelled.
        colour: factor by which correlated residuals widen the variances.
        turning: readings of the gyroscope, None without one.
        resolution: of the encoders (rad).
    """

    start: FloatArray
    values: FloatArray
    covariance: FloatArray
    before: FloatArray
    information: FloatArray
    times: FloatArray
    theta: FloatArray
    platform: FloatArray
    residuals: FloatArray
    across: FloatArray
    yielding: float
    crossings: list[Crossing]
    misfit: float
    colour: float
    turning: Turning | None
    resolution: float

    @property
    def half_widths(self) -> FloatArray:
        """Half widths of the intervals, [15]."""
        return QUANTILE * np.sqrt(np.diag(self.covariance))

    def gaps_before(self) -> FloatArray:
        """Return the elbow gap (m) of the geometry before at the crossings, by that after the calibration."""
        change = (self.start - self.values)[: len(GEOMETRY)]
        return np.array([row @ change for _, row in self.crossings])

    def gap_half_widths(self) -> FloatArray:
        """Return half widths (m) of the elbow gap's intervals at the crossings."""
        part = self.covariance[: len(GEOMETRY), : len(GEOMETRY)]
        return QUANTILE * np.sqrt([row @ part @ row for _, row in self.crossings])

    def locus_half_widths(self) -> FloatArray:
        """Return half widths (m) of the elbow gap's intervals all over the Type 2 locus (`locus_rows`)."""
        part = self.covariance[: len(GEOMETRY), : len(GEOMETRY)]
        rows = locus_rows(self.values[: len(GEOMETRY)])
        widths: FloatArray = QUANTILE * np.sqrt(np.sum((rows @ part) * rows, axis=1))
        return widths


def calibrate(
    robot: FiveBar,
    tolerances: Tolerances,
    record: CalibrationRecord,
    imu: ImuSettings | None = None,
    touched: tuple[TouchedPoint, ...] = (),
) -> Calibration:
    """Return the geometry that explains a recording.

    Args:
        robot: the geometry before.
        tolerances: how exactly it is known; parameters whose tolerance is 0 are held.
        record: readings of a motion through the Type 2 locus.
        imu: rough mounting of the IMU.
        touched: measured places of the platform.

    Raises:
        NotCalibratable: the recording is too short, does not cross the locus, or is that of another robot.
    """
    turned = turning(record, (imu or ImuSettings()).rotation()[2])
    problem = _Problem(robot, tolerances, record, turned, touched)
    fit = min((problem.fitted(*start) for start in problem.starts()), key=lambda one: one.cost)
    # weighed against what was known before by what the residuals turn out to be
    problem.colour = problem.found_colour(fit)
    return problem.result(problem.fitted(fit.values, fit.states))


def calibrate_by_turning_points(robot: FiveBar, tolerances: Tolerances, record: CalibrationRecord) -> Calibration:
    """Return the geometry that explains the motors' turning points on the Type 2 locus; the IMU is not used.

    Only the elbow gap at the places of the crossings is seen; the platform and theta_2 are those of the locus.

    Args:
        robot: the geometry before.
        tolerances: how exactly it is known.
        record: readings of a motion through the locus.

    Raises:
        NotCalibratable: it does not cross the locus.
    """
    points = turning_points(robot, record)
    count = len(GEOMETRY)
    start = np.concatenate((geometry_of(robot), np.zeros(len(SENSOR) + len(DRIVE))))
    before = deviations_before(tolerances)
    deviation = np.array([one.deviation for one in points])
    rows = np.zeros((len(points), len(PARAMETERS)))
    rows[:, :count] = np.array([one.row for one in points]) / deviation[:, None]
    gaps = np.array([one.gap for one in points]) / deviation
    prior = np.diag(1.0 / before**2)
    information = rows.T @ rows
    covariance = _inverse(information + prior, before)
    change = -covariance @ (rows.T @ gaps)
    left = gaps + rows @ change
    misfit = float(left @ left) / len(left)
    samples = np.array([one.sample for one in points])
    theta = distal_angles(start[:count], record.motors[samples]).mean(axis=1)
    closed = closure((start + change)[:count], record.motors[samples], theta)
    return Calibration(
        start=start,
        values=start + change,
        covariance=covariance,
        before=before,
        information=information,
        times=record.times[samples],
        theta=theta,
        platform=closed.platform,
        residuals=left * deviation,
        across=np.zeros(len(points)),
        yielding=0.0,
        crossings=[Crossing(number, one.row) for number, one in enumerate(points)],
        misfit=misfit,
        colour=1.0,
        turning=None,
        resolution=encoder_resolution(record.motors),
    )


def deviations_before(tolerances: Tolerances) -> FloatArray:
    """Return standard deviations of all parameters, [15], before a calibration."""
    third = math.sqrt(3.0)
    length, base, zero = (max(one / third, HELD) for one in tolerances[:3])
    scale = max(tolerances.gyro_scale / third, HELD)
    drive = [PLAY_BOUND] * 2 + [COMPLIANCE_BOUND] * 2
    return np.array([length] * 4 + [base] * 2 + [zero] * 2 + [BIAS_BOUND, scale, DELAY_BOUND, *drive])


class _Fit(NamedTuple):
    values: FloatArray
    states: FloatArray
    cost: float


class _Problem:
    """The least squares: values, [15], and states, the angles theta_2 of the samples and of the touched points."""

    def __init__(
        self,
        robot: FiveBar,
        tolerances: Tolerances,
        record: CalibrationRecord,
        turned: Turning,
        touched: tuple[TouchedPoint, ...],
    ) -> None:
        covered = (record.times >= record.imu_times[0]) & (record.times <= record.imu_times[-1])
        self._times = record.times[covered]
        if len(self._times) < 3 or self._times[-1] - self._times[0] < LEAST_TIME:
            raise NotCalibratable(
                f"too short: motors and gyroscope overlap for {np.ptp(self._times) if self._times.size else 0.0:.2f} s,"
                f" expected at least {LEAST_TIME:g} s"
            )
        read = angles(record._replace(times=self._times, motors=record.motors[covered]))
        self._turning = turned
        self._start = np.concatenate((geometry_of(robot), np.zeros(len(SENSOR) + len(DRIVE))))
        self._before = deviations_before(tolerances)
        self._gyro = Turned(record.imu_times, turned)
        self._samples = len(self._times)
        places = np.array([(one.q11, one.q21) for one in touched]).reshape(-1, 2)
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
        known = self._gyro.known(self._times)
        self._chain_deviation = np.where(known, turned.noise * np.sqrt(turned.period * lasting), UNKNOWN)

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
        states.sort(key=lambda one: self._cost(self._rows(self._start, one), self._start))
        return [(self._start, one) for one in states[:2]]

    def fitted(self, values: FloatArray, states: FloatArray) -> _Fit:
        """Return the fit that begins at values and states."""
        damping = 0.0
        rows = self._rows(values, states)
        cost = self._cost(rows, values)
        for _ in range(ITERATIONS):
            step = reduced(rows, self._states, damping)
            prior = 1.0 / self._before**2
            gradient = step.gradient + (values - self._start) * prior
            scale = self._before
            matrix = (step.information + np.diag(prior * (1.0 + damping))) * np.outer(scale, scale)
            change = -scale * np.linalg.solve(matrix, scale * gradient)
            moved = step.offset + step.response @ change
            tried_values, tried_states = values + change, states + moved
            far = bool(np.any(np.abs(tried_values - self._start) > FARTHEST * self._before))
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
        return _Fit(values, states, cost)

    def _first_states(self, assembly: int, bias: float) -> FloatArray:
        """Return angles theta_2 that follow the gyroscope from an assembly mode on, held to the geometry's own.

        The assembly mode is 0 for det A < 0, else 1.
        """
        start = self._start[: len(GEOMETRY)]
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
                near = min((math.remainder(one - angle, 2.0 * math.pi) for one in pairs[number]), key=abs)
                if abs(near) < DRIFT:
                    angle += near
            states[number] = angle
        for number, point in enumerate(self._touched, self._samples):
            errors = [_distance(start, self._read.values[number], theta, point) for theta in pairs[number]]
            states[number] = pairs[number][errors.index(min(errors))]
        return states

    def _closure(self, values: FloatArray, states: FloatArray) -> tuple[Closure, FloatArray]:
        links = self._read.values - self._ahead * values[PLAY] - self._torques * values[COMPLIANCE]
        closed = closure(values[: len(GEOMETRY)], links, states)
        return closed, np.sqrt(np.sum(closed.by_motors**2 * self._read.variances, axis=1))

    def _rows(self, values: FloatArray, states: FloatArray) -> Rows:
        closed, deviation = self._closure(values, states)
        count, chained = self._states, self._samples - 1
        by = np.zeros((count, len(PARAMETERS)))
        by[:, : len(GEOMETRY)] = closed.by_geometry
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
        by = np.zeros((chained, len(PARAMETERS)))
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
        residual, by_parameters, by_state, by_next, number = (
            np.concatenate(columns) for columns in zip(*parts, strict=True)
        )
        share = 1.0 / math.sqrt(self.colour)
        return Rows(share * residual, share * by_parameters, share * by_state, share * by_next, number)

    def _touched_rows(self, values: FloatArray, states: FloatArray, closed: Closure) -> list[Rows]:
        """Return the rows of x and of y of the touched points."""
        first = self._samples
        number = np.arange(first, self._states)
        measured = np.array([(one.x, one.y) for one in self._touched])
        weight = 1.0 / np.array([one.deviation for one in self._touched])
        geometry, theta = values[: len(GEOMETRY)], states[first:]
        q_21 = self._read.values[first:, 1] - geometry[ZERO_1 + 1]
        rows = []
        for axis, (r_2, across, u_2, turned) in enumerate(
            (
                (np.cos(q_21), -np.sin(q_21), np.cos(theta), -np.sin(theta)),
                (np.sin(q_21), np.cos(q_21), np.sin(theta), np.cos(theta)),
            )
        ):
            by = np.zeros((len(number), len(PARAMETERS)))
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
        prior = (values - self._start) / self._before
        return float(rows.residual @ rows.residual + prior @ prior)

    def found_colour(self, fit: _Fit) -> float:
        """Return the factor by which correlated residuals widen the variances, at least 1."""
        rows = self._rows(fit.values, fit.states)
        step = reduced(rows, self._states)
        return max(1.0, self._misfit(rows), self._colour(rows, step))

    def _misfit(self, rows: Rows) -> float:
        return float(rows.residual @ rows.residual) / max(len(rows.residual) - self._states, 1)

    def result(self, fit: _Fit) -> Calibration:
        """Return the calibration of a fit.

        Raises:
            NotCalibratable: it does not cross the locus, or does not explain the recording.
        """
        values, states = fit.values, fit.states
        rows = self._rows(values, states)
        step = reduced(rows, self._states)
        misfit = self._misfit(rows) * self.colour
        closed, deviation = self._closure(values, states)
        residual = math.sqrt(float(np.mean(closed.gap**2)))
        if residual > LARGEST_RESIDUAL or misfit > LARGEST_MISFIT:
            raise NotCalibratable(
                f"the recording contradicts the robot: the loop stays open by {1e3 * residual:.2g} mm, and the"
                f" residuals are {math.sqrt(misfit):.0f} times the sensors' noise: are robot, tolerances, motor order"
                " and signs, and the IMU's place on the distal link of leg 2 those of the recording?"
            )
        across = closed.across[: self._samples]
        crossings = _crossings(closed, across)
        if not crossings:
            raise NotCalibratable(
                f"no crossing: the motion stays in one assembly mode, |det A| of at least {np.min(np.abs(across)):.2f}:"
                " expected one that goes through the Type 2 locus and back"
            )
        rigid = closure(values[: len(GEOMETRY)], self._read.values, states).gap[: self._samples]
        yielding = float(np.sqrt(np.mean(rigid[np.abs(across) < NEAR] ** 2)))
        covariance = _inverse(step.information + np.diag(1.0 / self._before**2), self._before)
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
            information=step.information,
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


def _inverse(information: FloatArray, scale: FloatArray) -> FloatArray:
    inverse: FloatArray = np.linalg.inv(information * np.outer(scale, scale)) * np.outer(scale, scale)
    return inverse


def _distance(geometry: FloatArray, motors: FloatArray, theta: float, point: TouchedPoint) -> float:
    (place,) = closure(geometry, motors[None, :], np.array([theta])).platform
    return math.hypot(place[0] - point.x, place[1] - point.y)


def _crossings(closed: Closure, across: FloatArray) -> list[Crossing]:
    """Return the samples before a change of the sign of det A."""
    signs = np.sign(across)
    return [Crossing(int(k), closed.by_geometry[k]) for k in np.flatnonzero(signs[1:] * signs[:-1] < 0.0)]
