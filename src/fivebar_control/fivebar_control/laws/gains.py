# SPDX-License-Identifier: Apache-2.0
"""The settings that several laws share: gains, limits, and those of the unified law, which others fall back on."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, NamedTuple

from fivebar_control.laws.law import Feedback
from fivebar_description.settings import Setting

KP = Setting("Proportional gain.", "1/s^2", at_least=0.0, at_most=1e6, tunable=True)
KD = Setting("Derivative gain.", "1/s", at_least=0.0, at_most=1e5, tunable=True)
DISTURBANCE_LIMIT = Setting(
    "Largest disturbance torque that the observer assumes of either motor.", "Nm", at_least=0.0, at_most=1e3
)
SPEED_TIME = Setting(
    "Time T_v that weighs the speed error: 1 mm/s counts as much as T_v times 1 mm/s of position error.",
    "s",
    at_least=0.0,
    at_most=1.0,
)
WEIGHT = Setting(
    "Weight w of the torque, which regularises the uncontrollable direction.",
    "(m/s^2 / Nm)^2",
    at_least=1e-12,
    at_most=1e12,
    tunable=True,
)
FALLBACK_KP, FALLBACK_KD, FALLBACK_WEIGHT = (
    replace(setting, description=f"`{name}` of the unified law where it stands in.", tunable=False)
    for name, setting in (("kp", KP), ("kd", KD), ("weight", WEIGHT))
)
TORQUE_LIMIT = Setting(
    "Largest torque that the law may choose for either motor; by default the drives' limit.",
    "Nm",
    above=0.0,
    at_most=1e6,
)

DEXTAR_WEIGHTS = {"mpc": {"step_weight": 2e-6, "weight": 3e-7}, "lqr": {"weight": 4e-7}}
"""Weights of the torque ((m/Nm)^2) in laws with a cost over time, by law and setting, for the torques of DexTAR."""

MIN_NORM, FULL_FRICTION, FULL_INVERSE = 0, 1, 2

RESOLUTIONS = {"min_norm": MIN_NORM, "full_friction": FULL_FRICTION, "full_inverse": FULL_INVERSE}
"""The resolutions by name, in the order of their numbers."""

RESOLUTION = Setting("How the two motors share the torque that enforces the constraint.", choices=tuple(RESOLUTIONS))


class Gains(NamedTuple):
    """Gains of a blended controller: of its nominal law, and of its constraint law on the locus."""

    kp: Annotated[float, KP] = 2500.0
    kd: Annotated[float, KD] = 100.0
    kp_vhc: Annotated[float, KP] = 2500.0
    kd_vhc: Annotated[float, KD] = 100.0


class UnifiedSettings(NamedTuple):
    """Settings of the unified law.

    A robot's file may scale `weight` and `disturbance_limit` to the torque of its crossings (`drives`), and give the
    gains and `observer_rate` (`tuning`); the defaults here are those of DexTAR.
    """

    kp: Annotated[float, KP] = Feedback().kp
    kd: Annotated[float, KD] = Feedback().kd
    weight: Annotated[float, WEIGHT] = 3.0
    observer_rate: Annotated[
        float, Setting("Bandwidth of the disturbance observer, 0 for none.", "1/s", at_least=0.0, at_most=1e4)
    ] = 40.0
    disturbance_limit: Annotated[float, DISTURBANCE_LIMIT] = 0.5
    torque_limit: Annotated[float | None, TORQUE_LIMIT] = None
