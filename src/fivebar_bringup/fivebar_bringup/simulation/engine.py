"""The compiled loop for callers: one case in, its outcome or its trace out."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from fivebar_bringup.simulation.case import Case, FloatArray, Sampled
from fivebar_bringup.simulation.compiling import compiled_and_kept
from fivebar_bringup.simulation.loop import run_bound
from fivebar_bringup.simulation.outcome import Outcome, TraceRow
from fivebar_control.laws.law import Step
from fivebar_control.loop.setup import first_memory, steps_of

NO_TRACE = np.zeros((0, len(TraceRow._fields)))


@cache
def _loop(nominal: Step, constraint: Step) -> Any:
    return compiled_and_kept(run_bound, nominal_step=nominal, constraint_step=constraint)


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
    loop = _loop(*steps_of(case.controller))
    outcome: Outcome = loop(first_memory(case.controller), case.numbers, plan, trace)
    return outcome
