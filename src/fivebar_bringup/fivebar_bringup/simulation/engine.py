"""The compiled loop for callers: one case in, its outcome or its trace out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np

from fivebar_bringup.simulation.case import Case, EngineRun, FloatArray, Sampled, platforms_of
from fivebar_bringup.simulation.engine_estimator import EngineKnown, estimated, unestimated
from fivebar_bringup.simulation.engine_robot import (
    Robot,
    moved_ideal,
    moved_with_effects,
    started_ideal,
    started_with_effects,
)
from fivebar_bringup.simulation.measures import EngineLog, concluded, ends, lead_of, recorded, unmeasured
from fivebar_bringup.simulation.outcome import Outcome, TraceRow
from fivebar_bringup.simulation.planned import planned_at
from fivebar_bringup.simulation.robot import (
    ideal_later,
    ideal_sensed,
    ideal_start,
    later_with_effects,
    sensed_with_effects,
    start_with_effects,
)
from fivebar_control.compiling import compiled_and_kept, kept_by_itself
from fivebar_control.estimation.readings import with_readings
from fivebar_control.estimation.step import estimator_step, first_update
from fivebar_control.loop.closed_loop import LoopSettings, run_loop
from fivebar_control.loop.cycle import CycleMemory
from fivebar_control.loop.setup import first_memory, law_functions
from fivebar_description.strict_yaml import InputError


def begun_ideal(run: EngineRun) -> tuple[Robot, EngineKnown, EngineLog]:
    """Return the rigid robot, the estimator and the metrics before the first sample."""
    robot = started_ideal(run)
    return robot, unestimated(run, robot), unmeasured(run)


def begun_with_effects(run: EngineRun) -> tuple[Robot, EngineKnown, EngineLog]:
    """Return the robot with effects, the estimator and the metrics before the first sample."""
    robot = started_with_effects(run)
    return robot, unestimated(run, robot), unmeasured(run)


RUN: Mapping[str, Callable[..., Any]] = {
    "estimate": estimated,
    "plan_at": planned_at,
    "record": recorded,
    "ended": ends,
    "conclude": concluded,
}
IDEAL: Mapping[str, Callable[..., Any]] = {"begin": begun_ideal, "advance": moved_ideal}
WITH_EFFECTS: Mapping[str, Callable[..., Any]] = {"begin": begun_with_effects, "advance": moved_with_effects}
"""The engine's run, and the robots that it can have, by the names under which the closed loop knows their functions."""

PARTS: tuple[Callable[..., Any], ...] = (
    ideal_start,
    ideal_later,
    ideal_sensed,
    start_with_effects,
    later_with_effects,
    sensed_with_effects,
    first_update,
    with_readings,
    estimator_step,
)
"""Functions that the loops of all controllers share: the types of their arguments do not depend on the laws."""

for part in PARTS:
    kept_by_itself(part)

NO_TRACE = np.zeros((0, len(TraceRow._fields)))


@cache
def _loop(effects: bool, **of_laws: Callable[..., Any]) -> Any:
    return compiled_and_kept(run_loop, **of_laws, **(WITH_EFFECTS if effects else IDEAL), **RUN)


def run_with(
    loop: Callable[..., Outcome], memory: CycleMemory, case: Case, plan: Sampled, trace: FloatArray
) -> Outcome:
    """Return the metrics of a case along a sampled plan, by a loop that has been bound to it."""
    run, estimation = EngineRun(case.numbers, plan, trace), case.numbers.estimation
    lead = lead_of(run)
    last, feed_forward = len(plan.rows) - 1 - lead, estimation.on and estimation.feed_forward
    return loop(run, LoopSettings(case.numbers.control, 0, last, lead, feed_forward), memory)


def crossing(case: Case, plan: Sampled, trace: FloatArray = NO_TRACE) -> Outcome:
    """Return the metrics of a case along a sampled plan (`case.sampled`), whose samples are written into the trace.

    The first call of a controller in an installation compiles for some seconds. The interpreter's lock is not held:
    threads run side by side, and nothing is shared between calls.

    Raises:
        InputError: numba cannot compile the law.
    """
    if not case.controller.compiles:
        raise InputError(
            f"controller: {case.controller.name!r}: cannot be compiled, since a library solves its problem: expected"
            " another controller here; fivebar run, simulate, compare, goto and sweep take it, the last without the"
            " engine"
        )
    loop = _loop(case.numbers.mechanism is not None, **law_functions(case.controller))
    memory = first_memory(case.controller, case.numbers.control, lambda: platforms_of(plan.rows))
    return run_with(loop, memory, case, plan, trace)


def traced_crossing(
    case: Case, plan: Sampled, run: Callable[[Case, Sampled, FloatArray], Outcome] = crossing
) -> tuple[Outcome, FloatArray]:
    """Return what a run of the case returns, with float64[samples, len(TraceRow._fields)], a row for each sample."""
    trace = np.zeros((len(plan.rows), len(TraceRow._fields)))
    outcome = run(case, plan, trace)
    return outcome, trace[: outcome.samples]
