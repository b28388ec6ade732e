# SPDX-License-Identifier: Apache-2.0
"""The closure of the loop by three angles: both motors' and that of the distal link that carries the gyroscope.

The platform stands at P = O_2 + l_21 r_2 + l_22 u_2, with r_2 along q_21 and u_2 along theta_2, and the elbow of leg 1
at E_1 = O_1 + l_11 r_1. The loop is closed where

    F(q_11, q_21, theta_2) = |P - E_1| - l_12 = 0.

F needs neither a working nor an assembly mode and is regular on both kinds of singularity: on the Type 2 locus, where
u_1 and u_2 are parallel, it does not depend on theta_2 and is the error of the elbows' distance along the links.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_description.parameters import FiveBar

FloatArray = NDArray[np.float64]

GEOMETRY = ("l_11", "l_12", "l_21", "l_22", "base_1", "base_2", "zero_1", "zero_2")
"""Parameters of the geometry, in the order of their vector: lengths and x of the bases (m), encoder zeros (rad)."""

L_11, L_12, L_21, L_22, BASE_1, BASE_2, ZERO_1, ZERO_2 = range(len(GEOMETRY))


class Closure(NamedTuple):
    """The closure at n postures and its derivatives.

    Attributes:
        gap: [n], F (m).
        by_geometry: [n, 8], by the parameters in the order of `GEOMETRY`.
        by_theta: [n], by theta_2 (m/rad).
        by_motors: [n, 2], by the readings of q_11 and q_21 (m/rad).
        platform: [n, 2], the platform P (m).
        across: [n], sin(theta_2 - theta_1): det A, 0 on the Type 2 locus.
    """

    gap: FloatArray
    by_geometry: FloatArray
    by_theta: FloatArray
    by_motors: FloatArray
    platform: FloatArray
    across: FloatArray


def geometry_of(robot: FiveBar) -> FloatArray:
    """Return the parameters, [8], of a robot whose encoders' zeros are right."""
    leg1, leg2 = robot.leg1, robot.leg2
    return np.array([leg1.proximal, leg1.distal, leg2.proximal, leg2.distal, leg1.base_x, leg2.base_x, 0.0, 0.0])


def closure(geometry: FloatArray, motors: FloatArray, theta: FloatArray) -> Closure:
    """Return the closure of a geometry [8] for readings q_11, q_21 [n, 2] and angles theta_2 [n] (rad)."""
    q_11, q_21 = motors[:, 0] - geometry[ZERO_1], motors[:, 1] - geometry[ZERO_2]
    r_1, r_2, u_2 = _along(q_11), _along(q_21), _along(theta)
    platform = geometry[L_21] * r_2 + geometry[L_22] * u_2
    platform[:, 0] += geometry[BASE_2]
    elbow = geometry[L_11] * r_1
    elbow[:, 0] += geometry[BASE_1]
    distal = platform - elbow
    distance = np.hypot(distal[:, 0], distal[:, 1])
    u_1 = distal / distance[:, None]
    by_q_11 = -geometry[L_11] * _dot(u_1, _across(r_1))
    by_q_21 = geometry[L_21] * _dot(u_1, _across(r_2))
    by_geometry = np.empty((len(theta), len(GEOMETRY)))
    by_geometry[:, L_11] = -_dot(u_1, r_1)
    by_geometry[:, L_12] = -1.0
    by_geometry[:, L_21] = _dot(u_1, r_2)
    by_geometry[:, L_22] = _dot(u_1, u_2)
    by_geometry[:, BASE_1] = -u_1[:, 0]
    by_geometry[:, BASE_2] = u_1[:, 0]
    by_geometry[:, ZERO_1] = -by_q_11
    by_geometry[:, ZERO_2] = -by_q_21
    sine = u_1[:, 0] * u_2[:, 1] - u_1[:, 1] * u_2[:, 0]
    return Closure(
        gap=distance - geometry[L_12],
        by_geometry=by_geometry,
        by_theta=geometry[L_22] * _dot(u_1, _across(u_2)),
        by_motors=np.stack((by_q_11, by_q_21), axis=1),
        platform=platform,
        across=sine,
    )


def distal_angles(geometry: FloatArray, motors: FloatArray) -> FloatArray:
    """Return theta_2 (rad), [n, 2], of both assembly modes, det A < 0 first, for readings [n, 2] (rad).

    Both are the direction from the elbow of leg 2 to that of leg 1, turned by the same angle to either side; where the
    elbows are too far apart, both are that direction.
    """
    q_11, q_21 = motors[:, 0] - geometry[ZERO_1], motors[:, 1] - geometry[ZERO_2]
    line = geometry[L_11] * _along(q_11) - geometry[L_21] * _along(q_21)
    line[:, 0] += geometry[BASE_1] - geometry[BASE_2]
    distance = np.hypot(line[:, 0], line[:, 1])
    l_12, l_22 = geometry[L_12], geometry[L_22]
    cosine = (distance**2 + l_22**2 - l_12**2) / (2.0 * distance * l_22)
    turned = np.arccos(np.clip(cosine, -1.0, 1.0))
    direction = np.arctan2(line[:, 1], line[:, 0])
    # u_1 x u_2 > 0 where the platform lies to the left of the line from elbow 1 to elbow 2
    return np.stack((direction + turned, direction - turned), axis=1)


def locus_rows(geometry: FloatArray, count: int = 72) -> FloatArray:
    """Return [n, 8], derivatives of the elbow gap by the geometry all over the Type 2 locus, in every working mode.

    Args:
        geometry: [8].
        count: angles q_11 over the whole turn; each has up to two places on the locus.
    """
    q_11 = np.linspace(-np.pi, np.pi, count, endpoint=False)
    elbow = geometry[L_11] * _along(q_11)
    elbow[:, 0] += geometry[BASE_1]
    # elbow 2 is l_12 + l_22 from elbow 1 and l_21 from O_2
    to_x, to_y = elbow[:, 0] - geometry[BASE_2], elbow[:, 1]
    distance = np.hypot(to_x, to_y)
    apart, proximal = geometry[L_12] + geometry[L_22], geometry[L_21]
    cosine = (distance**2 + proximal**2 - apart**2) / (2.0 * distance * proximal)
    reached = np.abs(cosine) <= 1.0
    turned, direction = np.arccos(cosine[reached]), np.arctan2(to_y, to_x)[reached]
    q_21 = np.concatenate((direction + turned, direction - turned))
    motors = np.stack((np.tile(q_11[reached], 2), q_21), axis=1) + geometry[[ZERO_1, ZERO_2]]
    return closure(geometry, motors, distal_angles(geometry, motors).mean(axis=1)).by_geometry


def _along(angle: FloatArray) -> FloatArray:
    return np.stack((np.cos(angle), np.sin(angle)), axis=1)


def _across(direction: FloatArray) -> FloatArray:
    return np.stack((-direction[:, 1], direction[:, 0]), axis=1)


def _dot(left: FloatArray, right: FloatArray) -> FloatArray:
    result: FloatArray = left[:, 0] * right[:, 0] + left[:, 1] * right[:, 1]
    return result
