# SPDX-License-Identifier: Apache-2.0
"""Computed torque control u1 in joint space (1.23, 1.24): the nominal law outside the blending zones."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_control.laws.gains import KD, KP
from fivebar_control.laws.law import MIN_AUTHORITY, Instant, Law
from fivebar_control.laws.reference import Reference
from fivebar_control.laws.torque import Torque
from fivebar_control.model.dynamics import inverse_dynamics
from fivebar_control.model.geometry import wrap
from fivebar_control.model.kinematics import joint_acceleration
from fivebar_control.model.state import Leg, State
from fivebar_description.parameters import FiveBar


def linearised_acceleration(measured: Leg, desired: Leg, ax: float, ay: float, kp: float, kd: float) -> float:
    """Return u = qddot^d + Kd (qdot^d - qdot) + Kp (q^d - q) of one motor in rad/s^2 (1.23)."""
    feedforward = joint_acceleration(desired, ax, ay)
    return feedforward + kd * (desired.dq1 - measured.dq1) + kp * wrap(desired.q1 - measured.q1)


def ctc_torque(robot: FiveBar, state: State, reference: Reference, kp: float, kd: float) -> Torque:
    """Return u1 (1.24) with the full model; kp in 1/s^2, kd in 1/s.

    Grows without bound towards the Type 2 locus, where it is undefined (NaN).
    """
    v1 = linearised_acceleration(state.leg1, reference.state.leg1, reference.ax, reference.ay, kp, kd)
    v2 = linearised_acceleration(state.leg2, reference.state.leg2, reference.ax, reference.ay, kp, kd)
    return Torque(*inverse_dynamics(robot, state, v1, v2, reference.f1, reference.f2))


class CtcSettings(NamedTuple):
    """Gains of the computed torque law."""

    kp: Annotated[float, KP] = 2500.0
    kd: Annotated[float, KD] = 100.0


def ctc_step(robot: FiveBar, instant: Instant, memory: None, settings: CtcSettings) -> tuple[Torque, None]:
    """Return u1 for a sample."""
    return ctc_torque(robot, instant.state, instant.reference, settings.kp, settings.kd), memory


LAW = Law(
    name="ctc",
    title="computed torque",
    settings=CtcSettings,
    step=ctc_step,
    executable="ctc_controller",
    regular_on_locus=False,
    min_authority=MIN_AUTHORITY,
)
