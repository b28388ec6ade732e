"""The 6x6 covariance of the filter as rows of floats, in the order x, y, vx, vy, d1, d2.

Written out for this one size: the last two states are random walks, so a transition is its first four rows, and a
measurement depends on the position alone, so its row is two numbers. Every result is symmetric to the last bit.
"""

from __future__ import annotations

from typing import NamedTuple

Vector6 = tuple[float, float, float, float, float, float]
Covariance = tuple[Vector6, Vector6, Vector6, Vector6, Vector6, Vector6]
Transition = tuple[Vector6, Vector6, Vector6, Vector6]
"""d (x, y, vx, vy) / d (x, y, vx, vy, d1, d2) over a period; the disturbances are constant in it."""


def diagonal(values: Vector6) -> Covariance:
    """Return the covariance of independent states with these variances."""
    a, b, c, d, e, f = values
    return (
        (a, 0.0, 0.0, 0.0, 0.0, 0.0),
        (0.0, b, 0.0, 0.0, 0.0, 0.0),
        (0.0, 0.0, c, 0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0, d, 0.0, 0.0),
        (0.0, 0.0, 0.0, 0.0, e, 0.0),
        (0.0, 0.0, 0.0, 0.0, 0.0, f),
    )


def _dot(one: Vector6, other: Vector6) -> float:
    return (
        one[0] * other[0]
        + one[1] * other[1]
        + one[2] * other[2]
        + one[3] * other[3]
        + one[4] * other[4]
        + one[5] * other[5]
    )


class ProcessNoise(NamedTuple):
    """Process noise of one period: white noise on both accelerations, and a random walk of each disturbance.

    Attributes:
        position, mixed, velocity: variances and covariance of each coordinate and its rate (m^2, m^2/s, m^2/s^2).
        disturbance: variance of each disturbance (Nm^2).
    """

    position: float
    mixed: float
    velocity: float
    disturbance: float


def process_noise(acceleration_density: float, disturbance_rate: float, period: float) -> ProcessNoise:
    """Return it for the acceleration's density (m/s^2 per root Hz), the walk's rate (Nm per root s) and T (s)."""
    power = acceleration_density * acceleration_density
    return ProcessNoise(
        position=power * period * period * period / 3.0,
        mixed=power * period * period / 2.0,
        velocity=power * period,
        disturbance=disturbance_rate * disturbance_rate * period,
    )


def propagated(covariance: Covariance, transition: Transition, noise: ProcessNoise) -> Covariance:
    """Return F P F^T + Q."""
    f0, f1, f2, f3 = transition
    p0, p1, p2, p3, p4, p5 = covariance
    # P is symmetric: the dot product with its row j is that with its column j
    g1: Vector6 = (_dot(f1, p0), _dot(f1, p1), _dot(f1, p2), _dot(f1, p3), _dot(f1, p4), _dot(f1, p5))
    g0: Vector6 = (_dot(f0, p0), _dot(f0, p1), _dot(f0, p2), _dot(f0, p3), _dot(f0, p4), _dot(f0, p5))
    g2: Vector6 = (_dot(f2, p0), _dot(f2, p1), _dot(f2, p2), _dot(f2, p3), _dot(f2, p4), _dot(f2, p5))
    g3: Vector6 = (_dot(f3, p0), _dot(f3, p1), _dot(f3, p2), _dot(f3, p3), _dot(f3, p4), _dot(f3, p5))
    xx, yy = _dot(g0, f0) + noise.position, _dot(g1, f1) + noise.position
    uu, vv = _dot(g2, f2) + noise.velocity, _dot(g3, f3) + noise.velocity
    xy, xv, yu, uv = _dot(g0, f1), _dot(g0, f3), _dot(g1, f2), _dot(g2, f3)
    xu, yv = _dot(g0, f2) + noise.mixed, _dot(g1, f3) + noise.mixed
    return (
        (xx, xy, xu, xv, g0[4], g0[5]),
        (xy, yy, yu, yv, g1[4], g1[5]),
        (xu, yu, uu, uv, g2[4], g2[5]),
        (xv, yv, uv, vv, g3[4], g3[5]),
        (g0[4], g1[4], g2[4], g3[4], p4[4] + noise.disturbance, p4[5]),
        (g0[5], g1[5], g2[5], g3[5], p5[4], p5[5] + noise.disturbance),
    )


def measured(covariance: Covariance, n_x: float, n_y: float, variance: float) -> tuple[Covariance, Vector6]:
    """Return the covariance after a measurement n_x x + n_y y + noise, and the gain (6) for its innovation."""
    p0, p1, p2, p3, p4, p5 = covariance
    a = p0[0] * n_x + p0[1] * n_y
    b = p1[0] * n_x + p1[1] * n_y
    c = p2[0] * n_x + p2[1] * n_y
    d = p3[0] * n_x + p3[1] * n_y
    e = p4[0] * n_x + p4[1] * n_y
    f = p5[0] * n_x + p5[1] * n_y
    inverse = 1.0 / (n_x * a + n_y * b + variance)
    column: Vector6 = (a, b, c, d, e, f)
    return (
        _less(p0, column, a, inverse),
        _less(p1, column, b, inverse),
        _less(p2, column, c, inverse),
        _less(p3, column, d, inverse),
        _less(p4, column, e, inverse),
        _less(p5, column, f, inverse),
    ), (a * inverse, b * inverse, c * inverse, d * inverse, e * inverse, f * inverse)


def _less(row: Vector6, column: Vector6, factor: float, inverse: float) -> Vector6:
    # multiply before dividing: the product commutes, so the result is symmetric to the last bit
    return (
        row[0] - factor * column[0] * inverse,
        row[1] - factor * column[1] * inverse,
        row[2] - factor * column[2] * inverse,
        row[3] - factor * column[3] * inverse,
        row[4] - factor * column[4] * inverse,
        row[5] - factor * column[5] * inverse,
    )
