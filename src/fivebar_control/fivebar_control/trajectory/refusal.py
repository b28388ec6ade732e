# SPDX-License-Identifier: Apache-2.0
"""The planner's error, and how messages name a place."""

from __future__ import annotations

import math

from fivebar_control.model.geometry import reach_margin
from fivebar_description.other_units import in_other_unit
from fivebar_description.parameters import LegParameters
from fivebar_description.strict_yaml import InputError

ELBOWS_UNKNOWN = "the elbows pass each other, and the robot's file does not say whether they can (elbows_pass: unknown)"
"""How a motion through the folded branch of the locus is called attention to."""


class PlanRefused(InputError):
    """The motion is not possible; the message gives place and reason."""


FAR = 3.0
"""Multiple of a leg's length beyond which a place is not taken for one in metres."""


def out_of_reach(leg: LegParameters, number: int, x: float, y: float) -> str | None:
    """Return in words by how much a place (m) is out of reach of a leg, None where it is within."""
    margin = reach_margin(leg, x, y)
    if margin >= 0.0:
        return None
    far = math.hypot(x - leg.base_x, y) > FAR * (leg.proximal + leg.distal)
    unit = in_other_unit("m", lambda size: far and reach_margin(leg, size * x, size * y) >= 0.0)
    words = f"{place(x, y)} is out of reach of leg {number} by {-margin * 1e3:.2f} mm"
    return f"{words}: expected metres{unit}" if unit else words


def place(x: float, y: float) -> str:
    """Return a place (m) as messages give it."""
    # the sum makes a rounded -0 a 0
    return f"({round(x, 4) + 0.0:.4f}, {round(y, 4) + 0.0:.4f}) m"
