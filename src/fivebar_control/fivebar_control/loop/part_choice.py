# SPDX-License-Identifier: Apache-2.0
"""Chooses what the nodes answer with: the parts of the control cycle plain, or as machine code."""

from __future__ import annotations

from fivebar_control.compiling import is_of_compiler
from fivebar_control.laws.law import TunedLaw
from fivebar_control.loop.node_parts import PLAIN, LawPart, Parts
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar


def law_part(law: TunedLaw, compiled: bool, robot: FiveBar, plan: Plan, rate_hz: int, lead_samples: int) -> LawPart:
    """Return a law's part, as machine code where that is wanted and numba compiles the law, else plain."""
    of_law = law, robot, plan, rate_hz, lead_samples
    if compiled and law.law.compiles and not law.samples_ahead:
        try:
            return parts(True).law(*of_law)
        except Exception as error:
            # a law from elsewhere may not say whether numba compiles it
            if law.law.step.__module__.startswith("fivebar_control.") or not is_of_compiler(error):
                raise
    return PLAIN.law(*of_law)


def parts(compiled: bool) -> Parts:
    """Return the parts of the nodes, as machine code or plain."""
    if not compiled:
        return PLAIN
    # numba takes most of a second to import
    from fivebar_control.loop.compiled_node_parts import COMPILED

    return COMPILED
