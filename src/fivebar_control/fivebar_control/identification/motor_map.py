# SPDX-License-Identifier: Apache-2.0
"""The motors' part besides the links' inertia: torque per commanded torque, friction, and cogging over the angle.

The links are known here, weighed or identified before: the torque that they need shows how much of the commanded torque
arrives. Torques of friction and cogging are those that have to be commanded, in units of its command.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.identification.cutoff import choose_cutoffs
from fivebar_control.identification.equations import PASSIVE, VISCOUS, Equations, Record, bridged, filtered_equations
from fivebar_control.identification.identification import (
    CORRELATION,
    LARGEST_CONDITION,
    OTHER_CUTOFFS,
    NotIdentifiable,
    longest_stretch,
    parameter_values,
)
from fivebar_control.identification.least_squares import Fit, fit, widened
from fivebar_description.parameters import FiveBar

FloatArray = NDArray[np.float64]

LINKS, DIRECTION, OFFSET, SPEED, JOINTS, FIRST = range(6)
"""Columns of a motor: torque of its links, sign of its speed, one, its speed, friction of the passive joints, and from
here on cosines and sines of its angle."""


class MotorValue(NamedTuple):
    """A value and the half width of its 95 % interval."""

    value: float
    half_width: float


class Harmonic(NamedTuple):
    """Cogging with `periods` periods in a turn: the factors of cosine and sine (Nm), and its size (Nm)."""

    periods: int
    cosine: MotorValue
    sine: MotorValue
    amplitude: MotorValue


class MotorMap(NamedTuple):
    """One motor.

    Attributes:
        gain: actual torque over commanded torque.
        coulomb, offset: friction (Nm), as commanded.
        viscous: friction (Nm s/rad), as commanded.
        cogging: torque (Nm) that has to be commanded against the cogging at an angle, by harmonics.
    """

    gain: MotorValue
    coulomb: MotorValue
    offset: MotorValue
    viscous: MotorValue
    cogging: tuple[Harmonic, ...]

    def as_json(self) -> dict[str, Any]:
        """Return all values with their half widths."""
        plain: dict[str, Any] = {
            name: getattr(self, name)._asdict() for name in ("gain", "coulomb", "offset", "viscous")
        }
        plain["cogging"] = [
            {"periods": harmonic.periods}
            | {name: getattr(harmonic, name)._asdict() for name in ("cosine", "sine", "amplitude")}
            for harmonic in self.cogging
        ]
        return plain


def map_motors(robot: FiveBar, record: Record, harmonics: Sequence[int] = ()) -> tuple[MotorMap, MotorMap]:
    """Return the maps of both motors of a robot whose lengths, inertias and mass are known.

    Args:
        robot: its lengths, inertias, mass and widths of friction.
        record: of a motion that is fast for the gains, slow for friction and cogging.
        harmonics: periods of cogging in a turn.

    Raises:
        NotIdentifiable: the record is too short, or does not distinguish what is asked for.
    """
    cutoffs, record = choose_cutoffs(longest_stretch(record.angles), record.rate_hz), bridged(record)
    equations = filtered_equations(robot, record, cutoffs, harmonics)
    lag = max(1, round(CORRELATION / cutoffs.parallel_hz * equations.rate_hz))
    regressor = _columns(robot, equations)
    # what the residual inertias need is actual torque, and the gain applies to it as to the rest
    torque = equations.torque + equations.known
    used = int((np.isfinite(regressor).all(axis=2) & np.isfinite(torque)).sum())
    if used <= lag * regressor.shape[2]:
        raise NotIdentifiable(
            f"too short: {used / equations.rate_hz:.1f} s of motion are left for {regressor.shape[2]} values, expected"
            f" at least {lag * regressor.shape[2] / equations.rate_hz:.1f} s"
        )
    solution = fit(regressor, torque, lag)
    if solution.condition > LARGEST_CONDITION:
        raise NotIdentifiable(
            f"the motion does not distinguish gains, friction and these harmonics: condition number"
            f" {solution.condition:.3g}, expected at most {LARGEST_CONDITION:.0f}; turn both motors both ways through"
            " many periods, slowly and fast"
        )
    other_fits = []
    for factor in OTHER_CUTOFFS:
        through = filtered_equations(robot, record, cutoffs.times(factor), harmonics)
        other_fits.append(fit(_columns(robot, through), through.torque + through.known, lag))
    solution = widened(solution, other_fits)
    half = regressor.shape[2] // 2
    return _map_of(solution, 0, harmonics), _map_of(solution, half, harmonics)


def _columns(robot: FiveBar, equations: Equations) -> FloatArray:
    """Return [n, 2, p]: the columns of motor 1 and then those of motor 2, each in the rows of its motor."""
    zz_1, zz_2, mass = parameter_values(robot)[:3]
    rows, own = len(equations.time), FIRST + equations.cogging.shape[2]
    columns = np.zeros((rows, 2, 2 * own))
    for motor, inertia in enumerate((zz_1, zz_2)):
        regressor, begin = equations.regressor[:, motor], motor * own
        columns[:, motor, begin + LINKS] = (
            inertia * regressor[:, motor] + mass * regressor[:, 2] + equations.known[:, motor]
        )
        columns[:, motor, begin + DIRECTION] = regressor[:, 3 + motor]
        columns[:, motor, begin + OFFSET] = regressor[:, 5 + motor]
        columns[:, motor, begin + SPEED] = regressor[:, VISCOUS + motor]
        columns[:, motor, begin + JOINTS] = regressor[:, PASSIVE]
        columns[:, motor, begin + FIRST : begin + own] = equations.cogging[:, motor]
    return columns


def _map_of(solution: Fit, begin: int, harmonics: Sequence[int]) -> MotorMap:
    values, halves = solution.values.tolist(), solution.half_widths.tolist()

    def estimate(column: int) -> MotorValue:
        return MotorValue(values[begin + column], halves[begin + column])

    needed = estimate(LINKS)
    gain = MotorValue(1.0 / needed.value, needed.half_width / needed.value**2)
    return MotorMap(
        gain,
        estimate(DIRECTION),
        estimate(OFFSET),
        estimate(SPEED),
        tuple(
            Harmonic(
                periods,
                estimate(FIRST + 2 * number),
                estimate(FIRST + 2 * number + 1),
                _amplitude(solution, begin + FIRST + 2 * number),
            )
            for number, periods in enumerate(harmonics)
        ),
    )


def _amplitude(solution: Fit, column: int) -> MotorValue:
    """Return the size of a harmonic whose cosine is in a column and whose sine is in the next."""
    pair = slice(column, column + 2)
    values = solution.values[pair]
    size = float(np.linalg.norm(values))
    quantile = float(solution.half_widths[column] / math.sqrt(solution.covariance[column, column]))
    along = values / size if size > 0.0 else np.array([1.0, 0.0])
    return MotorValue(size, quantile * math.sqrt(float(along @ solution.covariance[pair, pair] @ along)))
