"""The gains and limits that the laws share, as settings."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, NamedTuple

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


class Gains(NamedTuple):
    """Gains of a blended controller: of its nominal law, and of its constraint law on the locus."""

    kp: Annotated[float, KP] = 2500.0
    kd: Annotated[float, KD] = 100.0
    kp_vhc: Annotated[float, KP] = 2500.0
    kd_vhc: Annotated[float, KD] = 100.0
