# SPDX-License-Identifier: Apache-2.0
"""Laws of the registry bound to a robot, a plan and settings, as a node binds them."""

from __future__ import annotations

from typing import Any

from fivebar_control.laws.law import TunedLaw
from fivebar_control.laws.registry import own_laws
from fivebar_control.loop.law_runner import LawRunner
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar


def bound_law(name: str, robot: FiveBar, plan: Plan, rate_hz: int, **settings: Any) -> LawRunner:
    """Return a law with some settings of its own and defaults for the rest."""
    law = own_laws()[name]
    return LawRunner(TunedLaw(law, law.settings(**settings)), robot, plan, rate_hz)
