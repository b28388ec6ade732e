"""How the planner says no."""

from __future__ import annotations

from fivebar_description.strict_yaml import InputError


class PlanRefused(InputError):
    """The motion cannot be made; says where and why."""


def place(x: float, y: float) -> str:
    """Return a place (m) for a refusal."""
    return f"({x:.4f}, {y:.4f}) m"
