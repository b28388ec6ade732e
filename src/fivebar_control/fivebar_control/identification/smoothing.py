# SPDX-License-Identifier: Apache-2.0
"""Zero-phase filters for angles with their derivatives, and for the torques that belong to them.

The differentiating filter is a Gaussian whose response is made flat at low frequencies. With x = (2 pi f s)^2 / 2 a
Gaussian of standard deviation s (s) passes e^-x; with its Taylor corrections up to order p that becomes
e^-x (1 + x + ... + x^p / p!), which departs from 1 by no more than x^(p+1) / (p+1)! and falls without ripple. In time,
x is the operator -(s^2 / 2) d^2/dt^2, so that the kernel and its derivatives are Hermite polynomials times a Gaussian,
in closed form: angle, rate and acceleration see exactly the same response. All kernels are symmetric, which makes their
phase zero in one pass, and end: a missing sample spoils no more than its surroundings.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.polynomial.hermite_e import hermeval
from numpy.typing import NDArray
from scipy.special import gammainccinv

FloatArray = NDArray[np.float64]

FLATNESS = 4
"""Order p of the differentiating filter."""

REACH = 8.0
"""Standard deviations at which its kernels end, below 1e-9 of their peaks."""

PARALLEL_REACH = 4.0
"""Standard deviations at which the parallel filter ends; both sides of the equations see the same cut."""

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)


class Differentiator(NamedTuple):
    """Taps of the differentiating filter, 2 h + 1 of each, for samples k + h down to k - h; of `torque` 2 h.

    Attributes:
        angle, rate, acceleration: give the filtered angle (rad) and its derivatives by time (rad/s, rad/s^2).
        torque: for torques held over the period before each sample: the kernel's integrals over the periods.
    """

    angle: FloatArray
    rate: FloatArray
    acceleration: FloatArray
    torque: FloatArray


def differentiator(cutoff_hz: float, rate_hz: float) -> Differentiator:
    """Return the filter that passes half the amplitude at `cutoff_hz`, for samples at `rate_hz`."""
    spread = math.sqrt(2.0 * float(gammainccinv(FLATNESS + 1, 0.5))) / (2.0 * math.pi * cutoff_hz)
    period = 1.0 / rate_hz
    reach = math.ceil(REACH * spread * rate_hz)
    times: FloatArray = period * np.arange(-reach, reach + 1, dtype=np.float64)
    angle, rate, acceleration = (period * _kernel(times, spread, order) for order in range(3))
    # cut off, the taps would see a small acceleration in an angle at rest, the larger the angle
    acceleration -= np.sum(acceleration) * angle
    middles: FloatArray = period * (np.arange(-reach, reach, dtype=np.float64) + 0.5)
    within = middles[:, None] + 0.5 * period * _NODES
    return Differentiator(angle, rate, acceleration, period * 0.5 * _kernel(within, spread, 0) @ _WEIGHTS)


def parallel_filter(cutoff_hz: float, rate_hz: float) -> FloatArray:
    """Return the taps [2 h + 1] of a Gaussian that passes half the amplitude at `cutoff_hz`."""
    spread = math.sqrt(2.0 * math.log(2.0)) / (2.0 * math.pi * cutoff_hz)
    reach = math.ceil(PARALLEL_REACH * spread * rate_hz)
    taps = np.exp(-0.5 * (np.arange(-reach, reach + 1) / (rate_hz * spread)) ** 2)
    normalised: FloatArray = taps / np.sum(taps)
    return normalised


def filtered(values: FloatArray, taps: FloatArray) -> FloatArray:
    """Return [n], values [n] through an odd number of taps; NaN where a value within reach is NaN or missing."""
    reach = len(taps) // 2
    return _convolved(values, taps, reach, reach)


def filtered_torque(torque: FloatArray, taps: FloatArray) -> FloatArray:
    """Return [n], torques [n] held over the period before each sample, filtered at the samples by an even number."""
    reach = len(taps) // 2
    return _convolved(torque, taps, reach - 1, reach)


def _convolved(values: FloatArray, taps: FloatArray, before: int, after: int) -> FloatArray:
    padded = np.concatenate([np.full(before, math.nan), values, np.full(after, math.nan)])
    if len(padded) < len(taps):
        return np.full_like(values, math.nan)
    return np.convolve(padded, taps, mode="valid")


def _kernel(times: FloatArray, spread: float, order: int) -> FloatArray:
    """Return the kernel's derivative of an order (0, 1, 2) by time (1/s^(order + 1)) at times (s)."""
    z = times / spread
    series = np.zeros(2 * FLATNESS + order + 1)
    for n in range(FLATNESS + 1):
        # d^k/dz^k e^(-z^2/2) = (-1)^k He_k(z) e^(-z^2/2)
        series[2 * n + order] = (-0.5) ** n / math.factorial(n) * (-1.0) ** order
    gaussian = np.exp(-0.5 * z * z) / (math.sqrt(2.0 * math.pi) * spread)
    values: FloatArray = gaussian * hermeval(z, series) / spread**order
    return values
