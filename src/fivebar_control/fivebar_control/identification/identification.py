# SPDX-License-Identifier: Apache-2.0
"""From recorded motor angles and torques to inertias, mass and friction with intervals."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.identification.cutoff import Cutoffs, choose_cutoffs
from fivebar_control.identification.equations import (
    COLUMNS,
    LEAST_KAPPA,
    MASS,
    MASS_APART,
    PARAMETERS,
    SLOW_WIDTHS,
    Equations,
    Record,
    bridged,
    filtered_equations,
)
from fivebar_control.identification.harmonics import SeenHarmonics, seen_harmonics, with_harmonics
from fivebar_control.identification.least_squares import Fit, fit, widened
from fivebar_description.parameters import FiveBar
from fivebar_description.strict_yaml import InputError

FloatArray = NDArray[np.float64]

CORRELATION = 1.25
"""Periods of the parallel filter's cut-off after which residuals are taken for independent."""

OTHER_CUTOFFS = (0.75, 1.3)
"""Factors on the filters' cut-offs, by which errors of the model show."""

LEAST_INDEPENDENT = 5.0
"""Independent rows that each motor must have."""

LARGEST_CONDITION = 100.0
"""Largest condition number of the regressor with unit columns: above it some parameters cannot be distinguished."""

NAMED = 0.3
"""Least part of a parameter in the weakest direction for it to be named."""

LARGEST_MISFIT = 0.3
"""Largest residual, as a part of the torque (both root mean square), of a model that is taken for the robot's."""

LEAST_SAMPLES = 64
"""Samples without a gap that the spectrum of the motion is taken from."""

NEVER_NEGATIVE = PARAMETERS[:5]
"""Parameters that are positive and must be known better than by their own size; offsets may be anything."""


class NotIdentifiable(InputError):
    """The record does not determine the parameters; the text names them and the reason."""


class Identification(NamedTuple):
    """Result of an identification.

    Attributes:
        fit: parameters in the order of `COLUMNS`, intervals, residuals; behind them the cosine and sine of each of the
            harmonics.
        harmonics: periods in a turn of the cogging that is seen, of each motor.
        cutoffs: of the filters.
        equations: that were solved.
        misfit: of each motor, root mean square of the residual over that of the torque.
        used_s: of each motor, the time that its equations cover (s).
    """

    fit: Fit
    harmonics: SeenHarmonics
    cutoffs: Cutoffs
    equations: Equations
    misfit: tuple[float, float]
    used_s: tuple[float, float]

    def constants_ratio(self) -> tuple[float, float]:
        """Return actual over assumed torque constant of motor 2, relative to that of motor 1, and its half width."""
        mass, apart = self.fit.values[MASS], self.fit.values[MASS_APART]
        ratio = (mass + apart) / (mass - apart)
        by = 2.0 / (mass - apart) ** 2 * np.array([-apart, mass])
        pair = self.fit.covariance[np.ix_([MASS, MASS_APART], [MASS, MASS_APART])]
        quantile = self.fit.half_widths[MASS] / math.sqrt(self.fit.covariance[MASS, MASS])
        return float(ratio), float(quantile * math.sqrt(by @ pair @ by))


def parameter_values(robot: FiveBar) -> tuple[float, ...]:
    """Return a robot's parameters in the order of `PARAMETERS`."""
    leg1, leg2 = robot.leg1, robot.leg2
    return leg1.inertia, leg2.inertia, robot.mass, leg1.coulomb, leg2.coulomb, leg1.offset, leg2.offset


def identify(robot: FiveBar, record: Record) -> Identification:
    """Return the parameters that a record determines; the robot gives lengths and the widths of its friction only.

    Raises:
        NotIdentifiable: the record is too short, excites too little, or does not fit the model.
    """
    cutoffs, record = choose_cutoffs(longest_stretch(record.angles), record.rate_hz), bridged(record)
    equations = filtered_equations(robot, record, cutoffs)
    lag = max(1, round(CORRELATION / cutoffs.parallel_hz * equations.rate_hz))
    used = np.isfinite(equations.regressor).all(axis=2) & np.isfinite(equations.torque)
    for motor in range(2):
        _refuse_too_little(robot, equations, used, motor, LEAST_INDEPENDENT * lag)
    solution = fit(equations.regressor, equations.torque, lag)
    _refuse_ill_conditioned(solution)
    seen = seen_harmonics(record, cutoffs, equations, solution)
    if any(seen):
        solution = fit(with_harmonics(record, cutoffs, equations, seen), equations.torque, lag)
    solution = widened(solution, [_through_others(robot, record, cutoffs, seen, factor) for factor in OTHER_CUTOFFS])
    misfit = [
        float(
            np.sqrt(
                np.nanmean(solution.residuals[:, motor] ** 2) / np.mean(equations.torque[used[:, motor], motor] ** 2)
            )
        )
        for motor in range(2)
    ]
    _refuse_misfit(misfit)
    _refuse_without_information(solution)
    return Identification(
        fit=solution,
        harmonics=seen,
        cutoffs=cutoffs,
        equations=equations,
        misfit=(misfit[0], misfit[1]),
        used_s=(float(used[:, 0].sum() / equations.rate_hz), float(used[:, 1].sum() / equations.rate_hz)),
    )


def _through_others(robot: FiveBar, record: Record, cutoffs: Cutoffs, seen: SeenHarmonics, factor: float) -> Fit:
    """Return the fit of a record through filters whose cut-offs are another."""
    other = cutoffs.times(factor)
    equations = filtered_equations(robot, record, other)
    regressor = with_harmonics(record, other, equations, seen)
    return fit(regressor, equations.torque, max(1, round(CORRELATION / other.parallel_hz * equations.rate_hz)))


def longest_stretch(angles: FloatArray) -> FloatArray:
    """Return the rows of the longest stretch without a gap."""
    longest = max(stretches(angles), key=len, default=angles[:0])
    if len(longest) < LEAST_SAMPLES:
        raise NotIdentifiable(f"too short: {len(longest)} samples without a gap, expected at least {LEAST_SAMPLES}")
    return longest


def stretches(rows: FloatArray) -> list[FloatArray]:
    """Return the stretches of rows without a gap, in their order."""
    known = np.isfinite(rows).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]]).astype(np.int8))).reshape(-1, 2)
    return [rows[start:end] for start, end in edges.tolist()]


def _refuse_too_little(robot: FiveBar, equations: Equations, used: NDArray[np.bool_], motor: int, rows: float) -> None:
    count = int(used[:, motor].sum())
    if count >= rows:
        return
    name, expected = f"motor {motor + 1}", f"expected at least {rows / equations.rate_hz:.2f} s"
    within = int(np.isfinite(equations.torque[:, motor]).sum())
    if within < rows:
        raise NotIdentifiable(
            f"too short: the filters' reach at ends and gaps leaves {within / equations.rate_hz:.2f} s, {expected}"
        )
    moving = int((equations.moving[:, motor] & np.isfinite(equations.torque[:, motor])).sum())
    limit = SLOW_WIDTHS * (robot.leg1, robot.leg2)[motor].width
    if moving < rows:
        raise NotIdentifiable(
            f"not enough motion: {name} turns faster than {limit:g} rad/s, filters' reach included, for"
            f" {moving / equations.rate_hz:.2f} s only, {expected}"
        )
    raise NotIdentifiable(
        f"not enough motion away from the Type 2 locus: {name} moves where 1/cond(A) is above {LEAST_KAPPA:g}, filters'"
        f" reach included, for {count / equations.rate_hz:.2f} s only, {expected}"
    )


def _refuse_ill_conditioned(solution: Fit) -> None:
    if solution.condition <= LARGEST_CONDITION:
        return
    names = [name for name, part in zip(COLUMNS, solution.weakest.tolist(), strict=True) if abs(part) > NAMED]
    text = f"{solution.condition:.0f}" if math.isfinite(solution.condition) else "infinite"
    raise NotIdentifiable(
        f"the motion does not distinguish {' and '.join(names)}: the condition number of the regressor is {text},"
        f" expected at most {LARGEST_CONDITION:.0f}; move both motors both ways, slowly and fast"
    )


def _refuse_misfit(misfit: list[float]) -> None:
    worst = max(range(2), key=lambda motor: misfit[motor])
    if misfit[worst] > LARGEST_MISFIT:
        raise NotIdentifiable(
            f"the model leaves {misfit[worst]:.0%} of the torque of motor {worst + 1} unexplained, expected at most"
            f" {LARGEST_MISFIT:.0%}: are lengths, signs and assembly mode those of this robot?"
        )


def _refuse_without_information(solution: Fit) -> None:
    for name, value, half in zip(COLUMNS, solution.values.tolist(), solution.half_widths.tolist(), strict=False):
        if name not in NEVER_NEGATIVE:
            continue
        if half >= abs(value):
            raise NotIdentifiable(
                f"the motion determines {name} too poorly: {value:.3g} ± {half:.2g}, expected an interval narrower than"
                " the value"
            )
        if value < 0.0:
            raise NotIdentifiable(
                f"{name} comes out negative, {value:.3g} ± {half:.2g}: are lengths, signs and assembly mode those of"
                " this robot?"
            )
