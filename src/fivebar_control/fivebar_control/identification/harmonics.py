# SPDX-License-Identifier: Apache-2.0
"""Cogging where it is seen: harmonics of a motor's angle that the torques need beside links and friction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.identification.cutoff import Cutoffs
from fivebar_control.identification.equations import COLUMNS, Equations, Record, cogging_waves
from fivebar_control.identification.least_squares import Fit

FloatArray = NDArray[np.float64]
SeenHarmonics = tuple[tuple[int, ...], tuple[int, ...]]

MOST = 2
"""Harmonics of a motor, as many as a robot file takes."""

HIGHEST = 168
"""Largest number of periods in a turn that is looked for."""

LEAST_SHARE = 0.25
"""Part of the residual's variance that a harmonic has to explain."""

LEAST_AMPLITUDE = 0.01
"""Least amplitude, relative to the motor's Coulomb friction."""

LEAST_RATIO = 15.0
"""Least ratio of the variance that a harmonic explains to what is left, each by its degrees of freedom. Of hundreds of
harmonics that are tried on noise, the largest of F(2, 30) is above that in fewer than one record of a hundred."""


SEPARATE = 0.1
"""Least part of a harmonic that links, friction and other harmonics do not explain."""

EXCHANGES = 3
"""Times that each chosen harmonic is looked for again beside the others."""


def seen_harmonics(record: Record, cutoffs: Cutoffs, equations: Equations, solution: Fit) -> SeenHarmonics:
    """Return the periods in a turn of the cogging that a record shows, of each motor, the strongest first.

    Args:
        record: of the motion.
        cutoffs: of the filters.
        equations: of the record, without cogging.
        solution: of them.
    """
    waves = cogging_waves(record, cutoffs, range(1, HIGHEST + 1))
    return (
        _of_motor(equations, solution, waves[:, 0], 0),
        _of_motor(equations, solution, waves[:, 1], 1),
    )


class Explained(NamedTuple):
    """A harmonic: its periods in a turn, 0 for none, and the part of the residual's squares that it explains."""

    periods: int
    squares: float


def _of_motor(equations: Equations, solution: Fit, waves: FloatArray, motor: int) -> tuple[int, ...]:
    regressor, residual = equations.regressor[:, motor], solution.residuals[:, motor]
    used = np.isfinite(residual) & np.isfinite(waves).all(axis=1)
    own = np.any(regressor[used] != 0.0, axis=0)
    plain, _ = np.linalg.qr(regressor[used][:, own])
    waves, residual = waves[used], residual[used]
    least = LEAST_AMPLITUDE * abs(float(solution.values[COLUMNS.index("f_s11") + motor]))
    chosen: list[int] = []
    while len(chosen) < MOST:
        new = _strongest(waves, residual, _beside(plain, waves, chosen), chosen, least)
        basis = _beside(plain, waves, chosen)
        before = _without(residual, basis)
        total, freedom = float(before @ before), solution.independent - basis.shape[1] - 2.0
        enough = new.squares > LEAST_SHARE * total and freedom > 0.0
        if new.periods == 0 or not enough or 0.5 * new.squares * freedom < LEAST_RATIO * (total - new.squares):
            break
        chosen.append(new.periods)
        # with a motion of a part of a turn, neighbours look alike as long as another harmonic is missing
        for _ in range(EXCHANGES):
            for place in range(len(chosen)):
                others = chosen[:place] + chosen[place + 1 :]
                best = _strongest(waves, residual, _beside(plain, waves, others), others, least)
                chosen[place] = best.periods or chosen[place]
    return tuple(chosen)


def _beside(plain: FloatArray, waves: FloatArray, chosen: Sequence[int]) -> FloatArray:
    """Return an orthonormal basis of links, friction and chosen harmonics."""
    columns = [waves[:, 2 * periods - 2 : 2 * periods] for periods in chosen]
    return np.linalg.qr(np.concatenate((plain, *columns), axis=1))[0]


def _strongest(
    waves: FloatArray, residual: FloatArray, basis: FloatArray, taken: Sequence[int], least: float
) -> Explained:
    """Return the harmonic of at least some amplitude (Nm) that explains most of what a basis leaves of a residual."""
    left, best = _without(residual, basis), Explained(0, 0.0)
    for periods in range(1, HIGHEST + 1):
        columns = waves[:, 2 * periods - 2 : 2 * periods]
        new = _without(columns, basis)
        if periods in taken or np.linalg.norm(new, axis=0).min() < SEPARATE * np.linalg.norm(columns, axis=0).max():
            continue
        turned, triangle = np.linalg.qr(new)
        parts = turned.T @ left
        squares = float(parts @ parts)
        if squares > best.squares and np.linalg.norm(np.linalg.solve(triangle, parts)) > least:
            best = Explained(periods, squares)
    return best


def _without(values: FloatArray, basis: FloatArray) -> FloatArray:
    """Return what is left of values beside an orthonormal basis."""
    left: FloatArray = values - basis @ (basis.T @ values)
    return left


def with_harmonics(record: Record, cutoffs: Cutoffs, equations: Equations, seen: SeenHarmonics) -> FloatArray:
    """Return the regressor of a record with cosine and sine of each motor's harmonics behind it."""
    parts = [equations.regressor]
    for motor, harmonics in enumerate(seen):
        waves = cogging_waves(record, cutoffs, harmonics)
        for number in range(len(harmonics)):
            own = np.zeros((len(equations.time), 2, 2))
            own[:, motor] = waves[:, motor, 2 * number : 2 * number + 2]
            parts.append(own)
    return np.concatenate(parts, axis=2)
