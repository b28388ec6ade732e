"""The compiled loop for callers: one case in, its outcome or its trace out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np

from fivebar_bringup.simulation.case import Case, FloatArray, Sampled
from fivebar_bringup.simulation.loop import run_loop
from fivebar_bringup.simulation.outcome import Outcome, TraceRow
from fivebar_bringup.simulation.robot import (
    ideal_later,
    ideal_sensed,
    ideal_start,
    later_with_effects,
    sensed_with_effects,
    start_with_effects,
)
from fivebar_control.compiling import compiled_and_kept, kept_by_itself
from fivebar_control.estimation.readings import with_motors
from fivebar_control.estimation.step import estimator_step, first_update
from fivebar_control.laws.law import unchanged
from fivebar_control.laws.registry import Controller
from fivebar_control.loop.setup import first_memory, steps_of
from fivebar_description.strict_yaml import InputError

IDEAL: Mapping[str, Callable[..., Any]] = {
    "robot_start": ideal_start,
    "robot_later": ideal_later,
    "robot_sensed": ideal_sensed,
}
WITH_EFFECTS: Mapping[str, Callable[..., Any]] = {
    "robot_start": start_with_effects,
    "robot_later": later_with_effects,
    "robot_sensed": sensed_with_effects,
}
"""The robots that the loop can have, by the names under which it knows their functions."""

PARTS: tuple[Callable[..., Any], ...] = (
    *IDEAL.values(),
    *WITH_EFFECTS.values(),
    first_update,
    with_motors,
    estimator_step,
)
"""What the loops of all controllers share: the types of their arguments do not depend on the laws."""

for part in PARTS:
    kept_by_itself(part)

NO_TRACE = np.zeros((0, len(TraceRow._fields)))


@cache
def _loop(effects: bool, **of_laws: Callable[..., Any]) -> Any:
    return compiled_and_kept(run_loop, **of_laws, **(WITH_EFFECTS if effects else IDEAL))


def law_functions(controller: Controller) -> dict[str, Callable[..., Any]]:
    """Return what the loop calls of a controller's laws, by the names under which it knows these functions."""
    nominal, constraint = steps_of(controller)
    after = unchanged if controller.constraint is None else controller.constraint.after_gap
    return {
        "nominal_step": nominal,
        "constraint_step": constraint,
        "nominal_after_gap": controller.nominal.after_gap,
        "constraint_after_gap": after,
    }


def refuse_uncompiled(controller: Controller) -> None:
    """Refuse a controller whose law numba cannot compile.

    Raises:
        InputError: the law cannot be compiled.
    """
    if not controller.compiles:
        raise InputError(
            f"controller: {controller.name!r}: cannot be compiled, since a library solves its problem: expected another"
            " controller here; fivebar run, simulate, compare, goto and sweep take it, the last without the engine"
        )


def crossing(case: Case, plan: Sampled) -> Outcome:
    """Return the metrics of a case along a sampled plan (`case.sampled`).

    The first call of a controller in an installation compiles for some seconds. The interpreter's lock is not held:
    threads run side by side, and nothing is shared between calls.
    """
    return _called(case, plan, NO_TRACE)


def traced_crossing(case: Case, plan: Sampled) -> tuple[Outcome, FloatArray]:
    """Return the same with float64[samples, len(TraceRow._fields)], a row for each sample that was made."""
    lead = case.numbers.equipment.delay_samples if case.numbers.estimation.on else 0
    trace = np.zeros((len(plan.rows) - lead, len(TraceRow._fields)))
    outcome = _called(case, plan, trace)
    return outcome, trace[: outcome.samples]


def _called(case: Case, plan: Sampled, trace: FloatArray) -> Outcome:
    refuse_uncompiled(case.controller)
    loop = _loop(case.numbers.mechanism is not None, **law_functions(case.controller))
    outcome: Outcome = loop(first_memory(case.controller, case.numbers.control, list), case.numbers, plan, trace)
    return outcome
