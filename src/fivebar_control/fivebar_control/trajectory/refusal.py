"""The planner's error, and how messages name a place."""

from __future__ import annotations

from fivebar_description.strict_yaml import InputError

ELBOWS_UNKNOWN = "the elbows pass each other, and the robot's file does not say whether they can (elbows_pass: unknown)"
"""How a motion through the folded branch of the locus is called attention to."""


class PlanRefused(InputError):
    """The motion is not possible; the message gives place and reason."""


def place(x: float, y: float) -> str:
    """Return a place (m) as messages give it."""
    # the sum makes a rounded -0 a 0
    return f"({round(x, 4) + 0.0:.4f}, {round(y, 4) + 0.0:.4f}) m"
