# SPDX-License-Identifier: Apache-2.0
"""The quadratic program of the predictive law: predicted errors of the horizon, weights and limits, and its solution.

With the torques u_i beyond friction as unknowns, the errors e_j and e_j' of the next N samples are linear in them;
`mpc` states the cost. The parts that do not depend on the motion are worked out once (`Weights`), what is left for a
sample is compiled by numba (`problem_of`).
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.compiling import compiled_and_kept

FloatArray = NDArray[np.float64]

MOST_ITERATIONS = 150
"""Iterations of the solver in a sample at most: a count, not a time, so that a run can be repeated bit for bit."""

LEAST_WEIGHT = 5e-4
"""Weight of the torques themselves, as a share of that of their changes, so that they are zero where they have no
effect."""

SCALE = 1e8
"""Factor of the cost: its second derivatives are then of the order of 1, to which the solver's tolerances refer."""


ROW = 14
"""Numbers in a row of a window."""

NO_PLAN: FloatArray = np.empty(0)


class Weights(NamedTuple):
    """The parts of the quadratic program that do not depend on the motion, N the horizon, h the period.

    Attributes:
        quadratic: float64[N, N], to be multiplied by G_i^T G_k.
        steps: float64[2N, 2N], weights of the changes of what departs from the plan.
        torques: float64[2N, 2N], with those of the torques.
        from_place: float64[N, N], from the errors of position at samples 1 to N to the gradient.
        from_speed: float64[N, N], the same from those of speed.
        to_place: float64[N, N], from accelerations over the intervals to positions.
        to_speed: float64[N, N], to speeds.
        times: float64[N], of the samples 1 to N (s).
        rows: float64[2(N - 1), 2N], changes of the torques from sample to sample.
    """

    quadratic: FloatArray
    steps: FloatArray
    torques: FloatArray
    from_place: FloatArray
    from_speed: FloatArray
    to_place: FloatArray
    to_speed: FloatArray
    times: FloatArray
    rows: FloatArray


def prediction_matrices(horizon: int, period: float) -> tuple[FloatArray, FloatArray]:
    """Return, float64[horizon, horizon] each, what an acceleration held over interval k adds at the end of interval j.

    The first is the change of position (s^2), the second that of velocity (s).
    """
    samples = np.arange(horizon, dtype=np.float64)
    after = np.maximum(samples[:, None] - samples[None, :] + 1.0, 0.0)
    to_place = period * period * np.where(after > 0.0, after - 0.5, 0.0)
    return to_place.astype(np.float64), (period * (after > 0.0)).astype(np.float64)


@cache
def weights_of(
    horizon: int, period: float, speed_time: float, end_weight: float, step_weight: float, weight: float
) -> Weights:
    """Return the constant parts of the quadratic program."""
    to_place, to_speed = prediction_matrices(horizon, period)
    stage = np.full(horizon, SCALE)
    stage[-1] *= end_weight
    from_place, from_speed = to_place.T * stage, to_speed.T * (stage * speed_time**2)
    changes = np.eye(2 * horizon) - np.eye(2 * horizon, k=-2)
    steps = SCALE * (step_weight * changes.T @ changes + weight * np.eye(2 * horizon))
    return Weights(
        quadratic=from_place @ to_place + from_speed @ to_speed,
        steps=steps,
        torques=steps + SCALE * LEAST_WEIGHT * step_weight * np.eye(2 * horizon),
        from_place=from_place,
        from_speed=from_speed,
        to_place=to_place,
        to_speed=to_speed,
        times=np.cumsum(to_speed[:, 0]),
        rows=np.ascontiguousarray(changes[2:]),
    )


class QuadraticProgram(NamedTuple):
    """The quadratic program of a sample: min u^T H u / 2 + g^T u, low <= (u, A u) <= high.

    u holds the torques beyond friction of both motors, sample by sample; A u are its changes.
    """

    quadratic: FloatArray
    gradient: FloatArray
    rows: FloatArray
    low: FloatArray
    high: FloatArray


class Solution(NamedTuple):
    """Torques beyond friction (Nm) of a quadratic program, and its duals; no torques where it did not finish."""

    torques: FloatArray | None
    duals: FloatArray | None


def solve(problem: QuadraticProgram, duals: FloatArray | None, unit: float) -> Solution:
    """Return the solution of a quadratic program, started from the duals of one that is close to it.

    The solver has the torques in a unit (Nm) of the robot's own size, to which its tolerances then refer.
    """
    # imported here, so that runs with other laws do not load it
    import daqp

    start: dict[str, Any] = {} if duals is None or duals.shape != problem.high.shape else {"dual_start": duals}
    torques, _, flag, details = daqp.solve(
        unit * unit * problem.quadratic,
        unit * problem.gradient,
        problem.rows,
        problem.high / unit,
        problem.low / unit,
        primal_tol=1e-9,
        iter_limit=MOST_ITERATIONS,
        **start,
    )
    return Solution(unit * torques, details["lam"]) if flag == 1 else Solution(None, None)


class TorqueBounds(NamedTuple):
    """The bounds of the torques of a plan.

    Attributes:
        last: the torque of the sample before (Nm), NaN for none.
        limit: of either motor (Nm).
        step: largest change from sample to sample (Nm).
    """

    last: tuple[float, float]
    limit: float
    step: float


def problem_of(
    weights: Weights,
    rows: FloatArray,
    here: FloatArray,
    disturbance: tuple[float, float],
    plan: FloatArray,
    bounds: TorqueBounds,
) -> QuadraticProgram:
    """Return the quadratic program of a sample; numba compiles it.

    Args:
        weights: the constant parts.
        rows: float64[N, 14], of the window.
        here: float64[12], of the present sample position, velocity, input map and friction.
        disturbance: of each motor (Nm).
        plan: float64[2N], u as planned at the sample before (Nm), empty for none.
        bounds: of the torques.
    """
    last, torque_limit, torque_step = bounds
    count = len(rows)
    maps, off = np.empty((count, 6)), np.empty(2 * count)
    for sample in range(count):
        for entry in range(6):
            before = here[4 + entry] if sample == 0 else rows[sample - 1, 6 + entry]
            maps[sample, entry] = 0.5 * (before + rows[sample, 6 + entry])
        for motor in range(2):
            friction = here[10 + motor] if sample == 0 else rows[sample - 1, 12 + motor]
            off[2 * sample + motor] = friction - disturbance[motor]
    # the errors without any torque
    place_error, speed_error = np.empty((count, 2)), np.empty((count, 2))
    for sample in range(count):
        for axis in range(2):
            place, speed = here[axis] + weights.times[sample] * here[2 + axis], here[2 + axis]
            for other in range(sample + 1):
                place += weights.to_place[sample, other] * maps[other, 4 + axis]
                speed += weights.to_speed[sample, other] * maps[other, 4 + axis]
            place_error[sample, axis] = rows[sample, axis] - place
            speed_error[sample, axis] = rows[sample, 2 + axis] - speed
    gradient, quadratic = np.empty(2 * count), np.empty((2 * count, 2 * count))
    for sample in range(count):
        pull_x = pull_y = 0.0
        for other in range(sample, count):
            by_place, by_speed = weights.from_place[sample, other], weights.from_speed[sample, other]
            pull_x += by_place * place_error[other, 0] + by_speed * speed_error[other, 0]
            pull_y += by_place * place_error[other, 1] + by_speed * speed_error[other, 1]
        for motor in range(2):
            gradient[2 * sample + motor] = -(pull_x * maps[sample, motor] + pull_y * maps[sample, 2 + motor])
        for other in range(count):
            for motor in range(2):
                for second in range(2):
                    product = maps[sample, motor] * maps[other, second]
                    product += maps[sample, 2 + motor] * maps[other, 2 + second]
                    row, column = 2 * sample + motor, 2 * other + second
                    quadratic[row, column] = weights.quadratic[sample, other] * product + weights.torques[row, column]
    if len(plan) > 0:
        # a change of torque concerns a sample and its neighbours
        for row in range(2 * count):
            for column in range(max(row % 2, row - 2), min(2 * count, row + 3), 2):
                gradient[row] -= weights.steps[row, column] * plan[column]
    changes = 2 * count - 2 if math.isfinite(torque_step) else 0
    low, high = np.empty(2 * count + changes), np.empty(2 * count + changes)
    low[: 2 * count], high[: 2 * count] = -torque_limit - off, torque_limit - off
    if changes > 0:
        for motor in range(2):
            if not math.isnan(last[motor]):
                held = last[motor] - off[motor]
                low[motor], high[motor] = max(low[motor], held - torque_step), min(high[motor], held + torque_step)
        change = off[:-2] - off[2:]
        low[2 * count :], high[2 * count :] = change - torque_step, change + torque_step
    return QuadraticProgram(quadratic, gradient, weights.rows[:changes], low, high)


@cache
def compiled_problem_of() -> Any:
    """Return `problem_of` as machine code, kept on disk."""
    return compiled_and_kept(problem_of)


def warm_up() -> None:
    """Load the solver and the machine code of `problem_of`, and compile that where no earlier run has."""
    horizon, period = 2, 0.01
    weights = weights_of(horizon, period, 0.01, 1.0, 1.0, 1.0)
    maps = np.ones((horizon, ROW))
    unknown = (math.nan, math.nan)
    solve(
        compiled_problem_of()(weights, maps, np.ones(12), (0.0, 0.0), NO_PLAN, TorqueBounds(unknown, 1.0, 1.0)),
        None,
        1.0,
    )
