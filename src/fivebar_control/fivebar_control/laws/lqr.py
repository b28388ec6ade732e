# SPDX-License-Identifier: Apache-2.0
"""Time-varying linear-quadratic regulator along the planned motion, in platform coordinates, a published method.

The motion is tracked with the torques that it needs, u_d = G^-1 (xddot_d - a_0), and with the feedback
u = u_d - K(t) xi on the error xi = (x - x_d, x' - x_d'). K follows from the Riccati equation, backwards in time along
the linearisation of x'' = G u + a_0. In platform coordinates this linearisation is regular on the Type 2 locus, and so
is K: the direction that is uncontrollable for an instant is controllable over the rest of the motion. The motion has to
meet the dynamic criterion, by which u_d is finite on the locus; otherwise u_d grows as 1 / kappa.

The plan has to be known beforehand. For a reference outside of the plan, as one held after a fault, the torque is that
of `unified`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.compiling import as_machine_code
from fivebar_control.laws.gains import (
    DEXTAR_WEIGHTS,
    FALLBACK_KD,
    FALLBACK_KP,
    FALLBACK_WEIGHT,
    SPEED_TIME,
    TORQUE_LIMIT,
    UnifiedSettings,
)
from fivebar_control.laws.law import Feedback, Instant, Law
from fivebar_control.laws.reference import Reference
from fivebar_control.laws.torque import Torque
from fivebar_control.laws.unified import INITIAL_MEMORY as NOTHING_OBSERVED
from fivebar_control.laws.unified import InputMap, acceleration, input_map, unified_step
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.state import Platform, WorkingMode
from fivebar_description.parameters import FiveBar, with_floats
from fivebar_description.settings import Setting

FloatArray = NDArray[np.float64]

STEPS = 1e-6, 1e-6, 1e-4, 1e-4
"""Steps (m, m, m/s, m/s) of the finite differences that linearise the model."""

LEAST_INPUT = 6e-8
"""Share of the trace of G^T G that is added to it, so that u_d is defined within some nanometres of the locus too."""

REST_SAMPLES = 1000
"""Samples of rest after the motion from which the Riccati equation starts, enough for its gain to converge."""


class LqrSettings(NamedTuple):
    """Settings of the linear-quadratic regulator.

    A robot's file may determine those of the law that stands in; see `UnifiedSettings`.
    """

    speed_time: Annotated[float, SPEED_TIME] = 0.018
    weight: Annotated[
        float, Setting("Weight r of the torque that departs from u_d.", "(m/Nm)^2", at_least=1e-16, at_most=1e6)
    ] = DEXTAR_WEIGHTS["lqr"]["weight"]
    torque_limit: Annotated[float | None, TORQUE_LIMIT] = None
    fallback_kp: Annotated[float, FALLBACK_KP] = UnifiedSettings().kp
    fallback_kd: Annotated[float, FALLBACK_KD] = UnifiedSettings().kd
    fallback_weight: Annotated[float, FALLBACK_WEIGHT] = UnifiedSettings().weight


class Gain(NamedTuple):
    """The law at an instant of the plan: u_d (Nm) and the rows of K for x, y (Nm/m), vx and vy (Nm s/m)."""

    u1: float
    u2: float
    row1: tuple[float, float, float, float]
    row2: tuple[float, float, float, float]


def lqr_gains(
    robot: FiveBar, mode: WorkingMode, references: Sequence[Platform], period: float, settings: LqrSettings
) -> dict[Platform, Gain]:
    """Return the law at every reference of a plan, from the Riccati equation backwards in time.

    References at which the model is not defined, as out of reach, are left out with all before them.
    """
    motion = np.array(references, dtype=np.float64)
    rows = as_machine_code(write_gains)(
        with_floats(robot), mode, motion, period, float(settings.speed_time), float(settings.weight)
    )
    known = zip(references, rows.tolist(), strict=True)
    defined = [(reference, row) for reference, row in known if not math.isnan(row[0])]
    # backwards, so that of equal references the first one counts
    return {
        reference: Gain(u1, u2, (k11, k12, k13, k14), (k21, k22, k23, k24))
        for reference, (u1, u2, k11, k12, k13, k14, k21, k22, k23, k24) in reversed(defined)
    }


def write_gains(
    robot: FiveBar, mode: WorkingMode, motion: FloatArray, period: float, speed_time: float, weight: float
) -> FloatArray:
    """Return the same as rows, NaN where there is no gain: float64[N, 10] as in `Gain`, of a motion [N, 6]."""
    rows = np.full((len(motion), 10), math.nan)
    weights = np.diag(np.array([1.0, 1.0, speed_time * speed_time, speed_time * speed_time]))
    value, last = 1e2 * weights, len(motion) - 1
    for number in range(last, -1, -1):
        m = motion[number]
        reference = Platform(float(m[0]), float(m[1]), float(m[2]), float(m[3]), float(m[4]), float(m[5]))
        linear = linearised(robot, mode, reference, period)
        if linear is None:
            break
        # the rest after the motion is long enough for the gain to converge
        for _ in range(REST_SAMPLES if number == last else 1):
            value, feedback = riccati_step(linear, value, weights, weight)
        rows[number, 0], rows[number, 1] = linear.torques
        rows[number, 2:6], rows[number, 6:10] = feedback[0], feedback[1]
    return rows


class Linear(NamedTuple):
    """The error over a sample, xi+ = F xi + H (u - u_d): float64[4, 4], float64[4, 2], and u_d (Nm)."""

    transition: FloatArray
    inputs: FloatArray
    torques: tuple[float, float]


def linearised(robot: FiveBar, mode: WorkingMode, reference: Platform, period: float) -> Linear | None:
    """Return the linearisation at a reference; None where the model is not defined."""
    place = np.array([reference.x, reference.y, reference.vx, reference.vy])
    here = _map_at(robot, mode, place)
    if here is None:
        return None
    inputs = np.array([[here.g_x1, here.g_x2], [here.g_y1, here.g_y2]])
    wanted = np.array([reference.ax - here.a0_x, reference.ay - here.a0_y])
    across = np.ascontiguousarray(inputs.T)
    gram = across @ inputs
    torques = np.linalg.solve(gram + LEAST_INPUT * np.trace(gram) * np.eye(2), across @ wanted)
    u1, u2 = float(torques[0]), float(torques[1])
    change = np.zeros((4, 4))
    change[0, 2] = change[1, 3] = 1.0
    for column in range(4):
        step = STEPS[column]
        off = np.zeros(4)
        off[column] = step
        after, before = _map_at(robot, mode, place + off), _map_at(robot, mode, place - off)
        if after is None or before is None:
            return None
        ahead_x, ahead_y = acceleration(after, u1, u2)
        behind_x, behind_y = acceleration(before, u1, u2)
        change[2, column], change[3, column] = (ahead_x - behind_x) / (2.0 * step), (ahead_y - behind_y) / (2.0 * step)
    acting = np.zeros((4, 2))
    acting[2:] = inputs
    # torques are held over a sample; the third-order term is about 1e-6
    half = 0.5 * period * period
    transition = np.eye(4) + period * change + half * (change @ change)
    return Linear(transition, period * acting + half * (change @ acting), (u1, u2))


def riccati_step(
    linear: Linear, value: FloatArray, weights: FloatArray, weight: float
) -> tuple[FloatArray, FloatArray]:
    """Return the cost-to-go matrix one sample earlier, float64[4, 4], and the gain there, float64[2, 4]."""
    through = np.ascontiguousarray(linear.inputs.T) @ value
    solved = np.linalg.solve(through @ linear.inputs + weight * np.eye(2), through @ linear.transition)
    feedback = np.asarray(solved, dtype=np.float64)
    closed = linear.transition - linear.inputs @ feedback
    spent = np.ascontiguousarray(feedback.T) @ feedback
    before = weights + weight * spent + np.ascontiguousarray(closed.T) @ value @ closed
    return 0.5 * (before + before.T), feedback


def _map_at(robot: FiveBar, mode: WorkingMode, place: FloatArray) -> InputMap | None:
    """Return the map from torques to the acceleration at a position (m) and velocity (m/s), float64[4]."""
    x, y, vx, vy = float(place[0]), float(place[1]), float(place[2]), float(place[3])
    mapped = input_map(robot, state_from_platform(robot, mode, x, y, vx, vy))
    if mapped is None or math.isnan(mapped.g_x1):
        return None
    return mapped


def lqr_step(
    robot: FiveBar, instant: Instant, memory: dict[Platform, Gain], settings: LqrSettings
) -> tuple[Torque, dict[Platform, Gain]]:
    """Return the torque (Nm) of the regulator; its memory holds the gains of the plan."""
    state, reference = instant.state, instant.reference
    limit = math.inf if settings.torque_limit is None else settings.torque_limit
    gain = memory.get(platform_of(reference))
    if gain is None:
        standing_in = UnifiedSettings(
            kp=settings.fallback_kp,
            kd=settings.fallback_kd,
            weight=settings.fallback_weight,
            observer_rate=0.0,
            torque_limit=settings.torque_limit,
        )
        torque, _ = unified_step(robot, state, reference, NOTHING_OBSERVED, standing_in, instant.period)
        return torque, memory
    desired = reference.state
    error = state.x - desired.x, state.y - desired.y, state.vx - desired.vx, state.vy - desired.vy
    u1, u2 = (
        u - sum(k * e for k, e in zip(row, error, strict=True))
        for u, row in ((gain.u1, gain.row1), (gain.u2, gain.row2))
    )
    return Torque(
        min(max(u1 + reference.f1, -limit), limit),
        min(max(u2 + reference.f2, -limit), limit),
    ), memory


def platform_of(reference: Reference) -> Platform:
    """Return the platform of a reference, the key of its gains."""
    desired = reference.state
    return Platform(desired.x, desired.y, desired.vx, desired.vy, reference.ax, reference.ay)


def fallback_feedback(settings: LqrSettings) -> Feedback:
    """Return the feedback of the law that takes over: the weights of a cost over time have other units than gains."""
    return Feedback(settings.fallback_kp, settings.fallback_kd, settings.fallback_weight)


LAW = Law(
    name="lqr",
    title="linear-quadratic regulator",
    settings=LqrSettings,
    step=lqr_step,
    memory={},
    prepare=lqr_gains,
    compiles=False,
    feedback=fallback_feedback,
)
