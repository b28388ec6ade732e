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

from fivebar_control.laws.gains import FALLBACK_KD, FALLBACK_KP, FALLBACK_WEIGHT, SPEED_TIME, TORQUE_LIMIT
from fivebar_control.laws.law import Instant, Law
from fivebar_control.laws.reference import Reference
from fivebar_control.laws.torque import Torque
from fivebar_control.laws.unified import INITIAL_MEMORY as NOTHING_OBSERVED
from fivebar_control.laws.unified import UnifiedSettings, input_map, unified_step
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.state import Platform
from fivebar_description.parameters import FiveBar
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
    ] = 4e-7
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
    robot: FiveBar, mode1: int, mode2: int, references: Sequence[Platform], period: float, settings: LqrSettings
) -> dict[Platform, Gain]:
    """Return the law at every reference of a plan, from the Riccati equation backwards in time.

    References at which the model is not defined, as out of reach, are left out with all before them.
    """
    gains: dict[Platform, Gain] = {}
    weights = np.diag([1.0, 1.0, settings.speed_time**2, settings.speed_time**2])
    value, last = 1e2 * weights, references[-1]
    for reference in reversed(references):
        linear = linearised(robot, mode1, mode2, reference, period)
        if linear is None:
            break
        # the rest after the motion is long enough for the gain to converge
        for _ in range(REST_SAMPLES if reference is last else 1):
            value, feedback = riccati_step(linear, value, weights, settings.weight)
        row1, row2 = ((float(a), float(b), float(c), float(d)) for a, b, c, d in feedback.tolist())
        gains[reference] = Gain(*linear.torques, row1, row2)
    return gains


class Linear(NamedTuple):
    """The error over a sample, xi+ = F xi + H (u - u_d): float64[4, 4], float64[4, 2], and u_d (Nm)."""

    transition: FloatArray
    inputs: FloatArray
    torques: tuple[float, float]


def linearised(robot: FiveBar, mode1: int, mode2: int, reference: Platform, period: float) -> Linear | None:
    """Return the linearisation at a reference; None where the model is not defined."""
    place = np.array(reference[:4])
    here = _map_at(robot, mode1, mode2, place)
    if here is None:
        return None
    inputs, drift = here
    wanted = np.array((reference.ax, reference.ay)) - drift
    gram = inputs.T @ inputs
    torques = np.linalg.solve(gram + LEAST_INPUT * np.trace(gram) * np.eye(2), inputs.T @ wanted)
    slopes = np.zeros((2, 4))
    for column, step in enumerate(STEPS):
        ends = []
        for sign in (1.0, -1.0):
            moved = place.copy()
            moved[column] += sign * step
            there = _map_at(robot, mode1, mode2, moved)
            if there is None:
                return None
            ends.append(there[0] @ torques + there[1])
        slopes[:, column] = (ends[0] - ends[1]) / (2.0 * step)
    change = np.zeros((4, 4))
    change[:2, 2:] = np.eye(2)
    change[2:] = slopes
    acting = np.vstack((np.zeros((2, 2)), inputs))
    # torques are held over a sample; the third-order term is about 1e-6
    transition = np.eye(4) + period * change + 0.5 * period**2 * change @ change
    return Linear(
        transition, period * acting + 0.5 * period**2 * change @ acting, (float(torques[0]), float(torques[1]))
    )


def riccati_step(
    linear: Linear, value: FloatArray, weights: FloatArray, weight: float
) -> tuple[FloatArray, FloatArray]:
    """Return the cost-to-go matrix one sample earlier, float64[4, 4], and the gain there, float64[2, 4]."""
    through = linear.inputs.T @ value
    feedback: FloatArray = np.linalg.solve(
        through @ linear.inputs + weight * np.eye(2), through @ linear.transition
    ).astype(np.float64, copy=False)
    closed = linear.transition - linear.inputs @ feedback
    before = weights + weight * feedback.T @ feedback + closed.T @ value @ closed
    return 0.5 * (before + before.T), feedback


def _map_at(robot: FiveBar, mode1: int, mode2: int, place: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Return G and a_0 at a position (m) and velocity (m/s)."""
    mapped = input_map(robot, state_from_platform(robot, mode1, mode2, *place.tolist()))
    if mapped is None or math.isnan(mapped.g_x1):
        return None
    return np.array(mapped[:4]).reshape(2, 2), np.array(mapped[4:])


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


LAW = Law(
    name="lqr",
    title="linear-quadratic regulator",
    settings=LqrSettings,
    step=lqr_step,
    memory={},
    prepare=lqr_gains,
    compiles=False,
)
