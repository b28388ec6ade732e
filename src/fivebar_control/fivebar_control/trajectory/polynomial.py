"""The fifth-order rest-to-rest polynomial (4.3 to 4.6)."""

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
