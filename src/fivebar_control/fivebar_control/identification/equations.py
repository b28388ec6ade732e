# SPDX-License-Identifier: Apache-2.0
"""The filtered inverse dynamics, one equation per motor and row, without the samples that are not reliable.

Angles go through the differentiating filter, and the regressor is worked out at every sample from what it gives. The
torques go through that filter's own kernel, and the regressor and the torques both through the parallel filter: what
the filters do to one side of the equations they do to the other. The torque of a sample was held over the period before
it, and the kernels are integrated over just these periods.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.identification.cutoff import Cutoffs
from fivebar_control.identification.regressor import platform_load
from fivebar_control.identification.smoothing import (
    differentiator,
    filtered,
    filtered_torque,
    parallel_filter,
)
from fivebar_control.model.state import MotorMotion
from fivebar_description.parameters import FiveBar, LegParameters

FloatArray = NDArray[np.float64]

PARAMETERS = ("zz_11R", "zz_21R", "m", "f_s11", "f_s21", "f_off11", "f_off21")
"""Identified parameters, by the names of the robot file, in the order of the regressor's first columns."""

BESIDE = ("f_v11", "f_v21", "passive", "m_apart", "passive_apart")
"""Parameters that are identified beside them: viscous friction (Nm s/rad), Coulomb friction of each passive joint
(Nm), and by how much the mass (kg) and that friction are larger in the equation of motor 1, and smaller in that of
motor 2, than their mean: torques are commanded ones, and torque constants that are off by different shares scale
each equation by its own."""

COLUMNS = (*PARAMETERS, *BESIDE)
MASS, VISCOUS, PASSIVE, MASS_APART, PASSIVE_APART = (
    COLUMNS.index(name) for name in ("m", "f_v11", "passive", "m_apart", "passive_apart")
)

LEAST_KAPPA = 0.15
"""Least 1/cond(A) of a sample: nearer to the Type 2 locus A^-T amplifies small errors of the angles."""

SLOW_WIDTHS = 3.0
"""A motor is slow below so many widths of the smoothed sign(), where friction depends on more than the direction."""

SLOW_SHARE = 0.005
"""Part of the filters' weight that may lie on slow samples."""

BRIDGED = 0.01
"""Time (s) between two samples within which those that are missing are filled in."""

ROWS_PER_CUTOFF = 5.0
"""Rows per period of the parallel filter's cut-off: more would add no information."""


class Record(NamedTuple):
    """Recorded motor angles and torques, on the grid of the samples; NaN where a sample is missing.

    Attributes:
        rate_hz: samples per second.
        angles: [n, 2], q11 and q21 as measured by the encoders (rad).
        torques: [n, 2], held over the period before the sample (Nm).
        assembly: [n], sign of det A; 0 or NaN where it is not known.
    """

    rate_hz: float
    angles: FloatArray
    torques: FloatArray
    assembly: FloatArray


def bridged(record: Record) -> Record:
    """Return a record with its short gaps filled, as a busy machine leaves them: each would spoil the filters' reach.

    Angles go on along the cubic through two samples on either side, or straight where there is one only; torques go
    straight. The assembly mode is filled where it is the same on both sides.
    """
    known: NDArray[np.bool_] = np.all(np.isfinite(np.hstack([record.angles, record.torques])), axis=1)
    edges = np.flatnonzero(np.diff(known.astype(np.int8)))
    longest = BRIDGED * record.rate_hz
    angles, torques, assembly = (np.copy(part) for part in record[1:])
    for last, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        following = end + 1
        if known[following - 1] or not known[last] or following - last > longest:
            continue
        near = [k for k in (last - 1, last, following, following + 1) if 0 <= k < len(known)]
        on = near if len(near) == 4 and known[near].all() else [last, following]
        inside = np.arange(last + 1, following)
        angles[inside] = _through(record.angles[on], on, inside)
        torques[inside] = _through(record.torques[[last, following]], [last, following], inside)
        if assembly[last] == assembly[following]:
            assembly[inside] = assembly[last]
    return Record(record.rate_hz, angles, torques, assembly)


def _through(values: FloatArray, places: Sequence[int], wanted: NDArray[np.int_]) -> FloatArray:
    """Return [m, columns], the polynomial through values [n, columns] at n places, at other places (Lagrange)."""
    weights = np.ones((len(wanted), len(places)))
    for number, place in enumerate(places):
        for other in places:
            if other != place:
                weights[:, number] *= (wanted - other) / (place - other)
    filtered: FloatArray = weights @ values
    return filtered


class Equations(NamedTuple):
    """The equations of n rows and two motors.

    Attributes:
        rate_hz: rows per second.
        time: [n], since the first sample (s).
        regressor: [n, 2, 12], columns as in `COLUMNS`, NaN where the motor's equation is left out.
        torque: [n, 2], filtered, less `known` (Nm).
        known: [n, 2], what is known beforehand, filtered (Nm): see `PlatformLoad`.
        moving: bool[n, 2], where the motor is not slow.
        cogging: [n, 2, 2 h], for each of h harmonics cosine and sine of so many times the motor's angle.
    """

    rate_hz: float
    time: FloatArray
    regressor: FloatArray
    torque: FloatArray
    known: FloatArray
    moving: NDArray[np.bool_]
    cogging: FloatArray


def filtered_equations(robot: FiveBar, record: Record, cutoffs: Cutoffs, harmonics: Sequence[int] = ()) -> Equations:
    """Return the equations of a record; of the robot, lengths, residual inertias and widths are used.

    With `harmonics`, periods in a turn, come what cogging with so many periods adds to them.
    """
    taps = differentiator(cutoffs.derivative_hz, record.rate_hz)
    parallel = parallel_filter(cutoffs.parallel_hz, record.rate_hz)
    # the encoders round down: on average the angle is half a count further
    angles = record.angles + 0.5 * cutoffs.resolution
    q, dq, ddq = (_by_motor(angles, kernel) for kernel in (taps.angle, taps.rate, taps.acceleration))
    of_platform = _platform_loads(robot, record.assembly, q, dq, ddq)
    loads, known = _by_motor(of_platform[:, :2], parallel), _by_motor(of_platform[:, 2:4], parallel)
    # as the motors' own friction, which the filter of the angles has smoothed once
    passive = _by_motor(_by_motor(of_platform[:, 4:], taps.angle), parallel)
    samples = len(q)
    regressor = np.zeros((samples, 2, len(COLUMNS)))
    torque = np.empty((samples, 2))
    moving = np.empty((samples, 2), dtype=np.bool_)
    weight = np.abs(np.convolve(taps.angle, parallel))
    for motor, leg in enumerate((robot.leg1, robot.leg2)):
        regressor[:, motor, motor] = filtered(ddq[:, motor], parallel)
        share = 1.0 if motor == 0 else -1.0
        regressor[:, motor, MASS] = loads[:, motor]
        regressor[:, motor, MASS_APART] = share * loads[:, motor]
        regressor[:, motor, PASSIVE] = passive[:, motor]
        regressor[:, motor, PASSIVE_APART] = share * passive[:, motor]
        regressor[:, motor, VISCOUS + motor] = filtered(dq[:, motor], parallel)
        direction = filtered(filtered(np.tanh(dq[:, motor] / leg.width), taps.angle), parallel)
        regressor[:, motor, 3 + motor] = direction
        regressor[:, motor, 5 + motor] = 1.0
        torque[:, motor] = filtered(filtered_torque(record.torques[:, motor], taps.torque), parallel) - known[:, motor]
        moving[:, motor] = filtered(_slow(leg, dq[:, motor]), weight / np.sum(weight)) < SLOW_SHARE
    regressor[~moving] = math.nan
    stride = stride_of(record, cutoffs)
    rows = slice(None, None, stride)
    return Equations(
        rate_hz=record.rate_hz / stride,
        time=np.arange(samples)[rows] / record.rate_hz,
        regressor=regressor[rows],
        torque=torque[rows],
        known=known[rows],
        moving=moving[rows],
        cogging=cogging_waves(record, cutoffs, harmonics),
    )


def stride_of(record: Record, cutoffs: Cutoffs) -> int:
    """Return how many samples of a record have one row of its equations."""
    return max(1, int(record.rate_hz / (ROWS_PER_CUTOFF * cutoffs.parallel_hz)))


def cogging_waves(record: Record, cutoffs: Cutoffs, harmonics: Sequence[int]) -> FloatArray:
    """Return [n, 2, 2 h], in the rows of the equations: cosine and sine of each of h harmonics, filtered."""
    taps = differentiator(cutoffs.derivative_hz, record.rate_hz).angle
    both = np.convolve(taps, parallel_filter(cutoffs.parallel_hz, record.rate_hz))
    angles = _by_motor(record.angles + 0.5 * cutoffs.resolution, taps)
    beyond = np.full(len(both) // 2, math.nan)
    rows = slice(None, None, stride_of(record, cutoffs))
    waves = np.empty((len(angles[rows]), 2, 2 * len(harmonics)))
    for motor in range(2):
        for number, periods in enumerate(harmonics):
            for column, wave in enumerate((np.cos, np.sin), start=2 * number):
                values = np.concatenate((beyond, wave(periods * angles[:, motor]), beyond))
                # at these rows only; the kernel is symmetric
                waves[:, motor, column] = np.lib.stride_tricks.sliding_window_view(values, len(both))[rows] @ both
    return waves


def _by_motor(values: FloatArray, taps: FloatArray) -> FloatArray:
    return np.stack([filtered(values[:, motor], taps) for motor in range(2)], axis=1)


def _slow(leg: LegParameters, speed: FloatArray) -> FloatArray:
    """Return [n], 1 where a motor is slow, 0 where it is not, NaN where that is not known."""
    return np.where(np.isfinite(speed), np.abs(speed) < SLOW_WIDTHS * leg.width, math.nan)


def _platform_loads(robot: FiveBar, assembly: FloatArray, q: FloatArray, dq: FloatArray, ddq: FloatArray) -> FloatArray:
    """Return [n, 6]: motor torques per mass of the platform (Nm/kg), known beforehand (Nm), per passive friction.

    Near the Type 2 locus the first are NaN, the others 0.
    """
    loads = np.zeros((len(q), 6))
    loads[:, :2] = math.nan
    known = np.isfinite(ddq).all(axis=1) & (np.abs(assembly) > 0.0)
    for k in np.flatnonzero(known):
        motion = MotorMotion(*q[k].tolist(), *dq[k].tolist(), *ddq[k].tolist())
        load = platform_load(robot, int(assembly[k]), motion)
        if load.kappa >= LEAST_KAPPA:
            loads[k] = load[:6]
    return loads
