"""Rest-to-rest polynomials: of fifth order (4.3 to 4.6), and of seventh order, which starts without a jerk."""

from __future__ import annotations


def rest_to_rest(u: float) -> tuple[float, float, float]:
    """Return s, ds/du, d2s/du2 of s = 10 u^3 - 15 u^4 + 6 u^5.

    It goes from 0 to 1 with zero speed and acceleration at both ends; outside [0, 1] the motion rests.
    """
    if u <= 0.0:
        return 0.0, 0.0, 0.0
    if u >= 1.0:
        return 1.0, 0.0, 0.0
    return (
        u * u * u * (10.0 + u * (6.0 * u - 15.0)),
        30.0 * u * u * (1.0 - u) * (1.0 - u),
        60.0 * u * (1.0 - u) * (1.0 - 2.0 * u),
    )


def rest_to_rest_without_jerk(u: float) -> tuple[float, float, float]:
    """Return s, ds/du, d2s/du2 of s = 35 u^4 - 84 u^5 + 70 u^6 - 20 u^7.

    It goes from 0 to 1 with zero speed, acceleration and jerk at both ends; outside [0, 1] the motion rests.
    """
    if u <= 0.0:
        return 0.0, 0.0, 0.0
    if u >= 1.0:
        return 1.0, 0.0, 0.0
    rest = u * (1.0 - u)
    return (
        u * u * u * u * (35.0 + u * (u * (70.0 - 20.0 * u) - 84.0)),
        140.0 * rest * rest * rest,
        420.0 * rest * rest * (1.0 - 2.0 * u),
    )
