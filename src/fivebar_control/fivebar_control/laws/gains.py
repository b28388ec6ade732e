"""The gains that the laws share, as settings."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting

KP = Setting("Proportional gain.", "1/s^2", at_least=0.0, at_most=1e6, tunable=True)
KD = Setting("Derivative gain.", "1/s", at_least=0.0, at_most=1e5, tunable=True)


class Gains(NamedTuple):
    """Gains of a blended controller: of its nominal law, and of its constraint law on the locus."""

    kp: Annotated[float, KP] = 2500.0
    kd: Annotated[float, KD] = 100.0
    kp_vhc: Annotated[float, KP] = 2500.0
    kd_vhc: Annotated[float, KD] = 100.0
