# SPDX-License-Identifier: Apache-2.0
"""The engine for callers: one case in, its outcome out, and the table of which that is made.

The loop is compiled with the laws of a controller. For laws that numba cannot compile it is interpreted, around a
compiled estimator and robot.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, partial
from typing import Any

import numpy as np

from fivebar_bringup.simulation.case import Case, EngineRun, FloatArray
from fivebar_bringup.simulation.engine_estimator import (
    estimated,
    measured,
    unestimated,
    unmeasured,
)
from fivebar_bringup.simulation.engine_robot import (
    moved,
    moved_ideal,
    moved_with_effects,
    started,
    started_ideal,
    started_with_effects,
)
from fivebar_bringup.simulation.engine_sensors import sensed
from fivebar_bringup.simulation.engine_table import RunEnd, TraceRow, metrics_of_table
from fivebar_bringup.simulation.robot import (
    ideal_later,
    ideal_sensed,
    ideal_start,
    later_with_effects,
    sensed_with_effects,
    start_with_effects,
)
from fivebar_bringup.simulation.run_metrics import RunMetrics
from fivebar_bringup.simulation.table_rows import concluded, empty_table, ends, recorded, recorded_estimate
from fivebar_control.compiling import bound, bound_apart, compiled_and_kept, is_of_compiler, kept_by_itself
from fivebar_control.estimation.constants import EstimatorModel
from fivebar_control.estimation.frozen import FrozenMemory
from fivebar_control.estimation.late_sensors import with_readings
from fivebar_control.estimation.readings import EstimatorMemory
from fivebar_control.estimation.step import EstimatorStep, estimator_step, filter_functions, first_update
from fivebar_control.laws.registry import CONTROLLERS
from fivebar_control.laws.torque import Torque
from fivebar_control.loop.closed_loop import LoopSettings, first_memory, law_functions, run_loop
from fivebar_control.loop.plan_sample import PlanSample
from fivebar_control.loop.sampled_plan import Sampled, planned_in, platforms_of
from fivebar_control.model.state import WorkingMode
from fivebar_description.extra_sensor import ExtraSensor
from fivebar_description.parameters import FiveBar
from fivebar_sim.effects.mechanism import Mechanism

Functions = Mapping[str, Callable[..., Any]]


def planned_at(run: EngineRun, moment: int) -> PlanSample:
    """Return the plan at the moment of a sample."""
    return planned_in(run.case.control, run.plan.rows[moment], run.plan.references, moment)


RUN: Functions = {"empty_log": empty_table, "plan_at": planned_at, "ended": ends, "conclude": concluded}
IDEAL: Functions = {"begin": started_ideal, "advance": moved_ideal}
WITH_EFFECTS: Functions = {"begin": started_with_effects, "advance": moved_with_effects}
MEASURED: Functions = {"first_known": unmeasured, "estimate": measured, "record": recorded}
ESTIMATED: Functions = {"first_known": unestimated, "estimate": estimated, "record": recorded_estimate}
"""The engine's run, the robots that it can have, and what can be known of them, by the names under which the closed
loop knows their functions: a loop is compiled for what a scenario has."""

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

_refused: set[str] = set()
"""Names of the laws from elsewhere that could not be compiled."""

robot_start: Callable[..., Any] = ideal_start
robot_later: Callable[..., Any] = ideal_later
robot_sensed: Callable[..., Any] = ideal_sensed
"""The robot whose steps are compiled for the interpreted loop, to be replaced before."""


@cache
def _loop(effects: bool, has_estimator: bool, extra: ExtraSensor | None, **of_laws: Callable[..., Any]) -> Any:
    robot = WITH_EFFECTS if effects else IDEAL
    known = _estimated_with(extra) if has_estimator else MEASURED
    return compiled_and_kept(run_loop, **of_laws, **robot, **known, **RUN)


@cache
def _estimated_with(extra: ExtraSensor | None) -> Functions:
    """Return the functions of an estimator, with those of a sensor from another package."""
    if extra is None:
        return ESTIMATED
    names, read = filter_functions(extra)._asdict(), bound(sensed, extra_read=extra.read)
    estimate = bound_apart(extra.expected.__name__, estimated, **names, sensed=read)
    return {**ESTIMATED, "first_known": bound(unestimated, **names), "estimate": estimate}


def crossing(case: Case, plan: Sampled) -> RunMetrics:
    """Return the metrics of a run of the case, see `traced_crossing`."""
    return traced_crossing(case, plan)[0]


def traced_crossing(case: Case, plan: Sampled) -> tuple[RunMetrics, FloatArray]:
    """Run a case along a sampled plan (`case.sampled`); return its metrics and its table.

    The table is float64[samples, len(TraceRow._fields)], a row for each sample.

    The first call of a controller in an installation compiles for some seconds. The interpreter's lock is not held by
    machine code: threads run side by side, and nothing is shared between calls.

    Raises:
        ValueError: the plan is longer than the case, such as one that is sampled at another rate.
    """
    samples, known = len(plan.rows) - case.numbers.lead, min(len(case.numbers.lost), len(case.numbers.missing))
    # machine code reads beyond the end of an array
    if samples > known:
        raise ValueError(f"a plan of {samples} samples for a case of {known}: expected that of the case's own scenario")
    trace = np.empty((len(plan.rows), len(TraceRow._fields)))
    ended = _run(case, plan, trace)
    table = trace[: ended.samples]
    return metrics_of_table(case, plan, table, ended), table


def _run(case: Case, plan: Sampled, trace: FloatArray) -> RunEnd:
    """Run a case, and fill its table.

    A law of this package says whether numba compiles it. One from elsewhere may say nothing, and is tried once in a
    process.
    """
    controller, numbers = case.controller, case.numbers
    control, of_robot = numbers.control, (numbers.mechanism is not None, numbers.estimation is not None)
    last, feed_forward = len(plan.rows) - 1 - numbers.lead, of_robot[1] and numbers.estimation.feed_forward
    settings = LoopSettings(control, 0, last, numbers.lead, feed_forward)
    of_run = (
        EngineRun(numbers, plan, trace),
        settings,
        first_memory(controller, control, lambda: platforms_of(plan.rows)),
    )
    if controller.compiles and controller.name not in _refused:
        try:
            ended: RunEnd = _loop(*of_robot, case.extra, **law_functions(controller))(*of_run)
            return ended
        except Exception as error:
            if controller.name in CONTROLLERS or not is_of_compiler(error):
                raise
            _refused.add(controller.name)
    return _interpreted_loop(case)(*of_run)


def _interpreted_loop(case: Case) -> Callable[..., RunEnd]:
    """Return the loop for laws that are not compiled, which look ahead as far as they need."""
    controller, control = case.controller, case.numbers.control
    constraint = 0 if controller.constraint is None else controller.constraint.samples_ahead(control.constraint)
    count = max(controller.nominal.samples_ahead(control.nominal), constraint)
    known = MEASURED
    if case.numbers.estimation is not None:
        known = _estimated_with(case.extra)
        known = {**known, "estimate": bound(known["estimate"], estimator_step=_compiled_step(case.extra))}
    of_run: Functions = {**RUN, "plan_at": partial(planned_with_ahead, count)}
    robot = _compiled_robot(case.numbers.mechanism is not None)
    return bound(run_loop, **law_functions(controller), **robot, **known, **of_run)


def planned_with_ahead(count: int, run: EngineRun, moment: int) -> PlanSample:
    """Return the plan at the moment of a sample, with the reference of the `count` samples that follow."""
    # after the end the platform rests at the last waypoint
    last = len(run.plan.rows) - 1
    numbers = [min(moment + later, last) for later in range(1, count + 1)]
    return planned_at(run, moment)._replace(ahead=tuple(platforms_of(run.plan.rows[numbers])))


@cache
def _compiled_robot(effects: bool) -> Functions:
    """Return the steps of an ideal robot or of one with effects, by the names under which the loop knows them."""
    start = compiled_and_kept(_start, robot_start=start_with_effects if effects else ideal_start)
    later = compiled_and_kept(_later, robot_later=later_with_effects if effects else ideal_later)
    sensed = compiled_and_kept(_sensed, robot_sensed=sensed_with_effects if effects else ideal_sensed)
    return {
        "begin": partial(started, start=start, sensed=sensed),
        "advance": partial(moved, later=later, sensed=sensed),
    }


@cache
def _compiled_step(extra: ExtraSensor | None) -> Any:
    """Return the step of the filter with a sensor from another package, or without."""
    return compiled_and_kept(_step, estimator_step=filter_functions(extra).estimator_step)


# callers of functions of robot and filter, of which the engine keeps the machine code for compiled callers only


def _start(robot: FiveBar, actual: FiveBar, mode: WorkingMode, mechanism: Mechanism | None, x: float, y: float) -> Any:
    return robot_start(robot, actual, mode, mechanism, x, y)


def _later(
    actual: FiveBar,
    mechanism: Mechanism | None,
    steps: int,
    step: float,
    plant: Any,
    number: int,
    applied: Torque,
) -> Any:
    return robot_later(actual, mechanism, steps, step, plant, number, applied)


def _sensed(mechanism: Mechanism | None, plant: Any) -> Any:
    return robot_sensed(mechanism, plant)


def _step(
    model: EstimatorModel,
    memory: EstimatorMemory,
    frozen: FrozenMemory,
    start: int,
    commands: FloatArray,
    first: int,
    coasts: bool,
) -> EstimatorStep:
    return estimator_step(model, memory, frozen, start, commands, first, coasts)
