# SPDX-License-Identifier: Apache-2.0
"""Chooses what the nodes answer with: the parts of the control cycle plain, or as machine code.

Each node loads its own part. Numba takes most of a second to import.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fivebar_control.loop.node_parts import LawPart, SupervisorPart

if TYPE_CHECKING:
    from fivebar_control.estimation.estimator import StateEstimator
    from fivebar_control.laws.law import TunedLaw
    from fivebar_control.loop.guard_part import GuardPart
    from fivebar_control.trajectory.planner import Plan
    from fivebar_description.parameters import FiveBar


def law_part(law: TunedLaw, compiled: bool, robot: FiveBar, plan: Plan, rate_hz: int, lead_samples: int) -> LawPart:
    """Return a law's part, as machine code where that is wanted and numba compiles the law, else plain."""
    from fivebar_control.loop.plain_law import PlainLaw

    of_law = law, robot, plan, rate_hz, lead_samples
    if compiled and law.law.compiles and not law.samples_ahead:
        from fivebar_control.compiling import is_of_compiler
        from fivebar_control.loop.compiled_node_parts import CompiledLaw

        try:
            return CompiledLaw(*of_law)
        except Exception as error:
            # a law from elsewhere may not say whether numba compiles it
            if law.law.step.__module__.startswith("fivebar_control.") or not is_of_compiler(error):
                raise
    return PlainLaw(*of_law)


def estimator_part(compiled: bool) -> type[StateEstimator]:
    """Return the estimator."""
    if compiled:
        from fivebar_control.estimation.compiled_estimator import CompiledEstimator

        return CompiledEstimator
    from fivebar_control.estimation.estimator import StateEstimator

    return StateEstimator


def supervisor_part(compiled: bool) -> type[SupervisorPart]:
    """Return the supervisor's part."""
    if not compiled:
        return SupervisorPart
    from fivebar_control.loop.compiled_node_parts import CompiledSupervisor

    return CompiledSupervisor


def guard_part(compiled: bool) -> type[GuardPart]:
    """Return the guard's part."""
    if compiled:
        from fivebar_control.loop.compiled_node_parts import CompiledGuard

        return CompiledGuard
    from fivebar_control.loop.guard_part import GuardPart

    return GuardPart
