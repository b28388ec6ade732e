"""The loop of the engine for laws that numba cannot compile: interpreted, around a compiled estimator and robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, partial
from typing import Any

from fivebar_bringup.simulation import engine
from fivebar_bringup.simulation.case import Case, EngineRun, FloatArray, Sampled, platforms_of
from fivebar_bringup.simulation.engine_estimator import EngineKnown, unestimated
from fivebar_bringup.simulation.engine_robot import Robot, moved, started
from fivebar_bringup.simulation.measures import EngineLog, unmeasured
from fivebar_bringup.simulation.outcome import Outcome
from fivebar_bringup.simulation.planned import planned_at
from fivebar_bringup.simulation.robot import (
    ideal_later,
    ideal_sensed,
    ideal_start,
    later_with_effects,
    sensed_with_effects,
    start_with_effects,
)
from fivebar_control.compiling import bound, compiled_and_kept, is_of_compiler
from fivebar_control.estimation.compiled import compiled_step
from fivebar_control.laws.registry import CONTROLLERS
from fivebar_control.loop.closed_loop import run_loop
from fivebar_control.loop.plan_sample import PlanSample
from fivebar_control.loop.setup import first_memory, law_functions
from fivebar_description.parameters import FiveBar
from fivebar_sim.effects.mechanism import Mechanism

_refused: set[str] = set()
"""Names of the laws from elsewhere that could not be compiled."""

robot_start: Callable[..., Any] = ideal_start
robot_later: Callable[..., Any] = ideal_later
robot_sensed: Callable[..., Any] = ideal_sensed
"""The robot whose steps are compiled below, to be replaced before."""


def crossing(case: Case, plan: Sampled, trace: FloatArray = engine.NO_TRACE) -> Outcome:
    """Return what :func:`engine.crossing` does, from there where numba compiles the controller.

    A law of this package says whether it does. One from elsewhere may say nothing, and is tried once in a process.
    """
    controller = case.controller
    if controller.compiles and controller.name not in _refused:
        try:
            return engine.crossing(case, plan, trace)
        except Exception as error:
            if controller.name in CONTROLLERS or not is_of_compiler(error):
                raise
            _refused.add(controller.name)
    return _interpreted(case, plan, trace)


def traced_crossing(case: Case, plan: Sampled) -> tuple[Outcome, FloatArray]:
    """Return the same with the trace, as :func:`engine.traced_crossing` does."""
    return engine.traced_crossing(case, plan, crossing)


def _interpreted(case: Case, plan: Sampled, trace: FloatArray) -> Outcome:
    controller, control = case.controller, case.numbers.control
    constraint = 0 if controller.constraint is None else controller.constraint.samples_ahead(control.constraint)
    count = max(controller.nominal.samples_ahead(control.nominal), constraint)
    of_run: dict[str, Callable[..., Any]] = {
        **engine.RUN,
        "estimate": bound(engine.RUN["estimate"], estimator_step=compiled_step()),
        "plan_at": partial(planned_with_ahead, count),
    }
    loop: Callable[..., Outcome] = bound(
        run_loop,
        **law_functions(controller),
        **of_run,
        **_compiled_robot(case.numbers.mechanism is not None),
    )
    memory = first_memory(controller, control, lambda: platforms_of(plan.rows))
    return engine.run_with(loop, memory, case, plan, trace)


def planned_with_ahead(count: int, run: EngineRun, moment: int) -> PlanSample:
    """Return the plan at the moment of a sample, with the reference of the `count` samples that follow."""
    # after the end the platform rests at the last waypoint
    last = len(run.plan.rows) - 1
    numbers = [min(moment + later, last) for later in range(1, count + 1)]
    return planned_at(run, moment)._replace(ahead=tuple(platforms_of(run.plan.rows[numbers])))


@cache
def _compiled_robot(effects: bool) -> Mapping[str, Callable[..., Any]]:
    """Return the steps of an ideal robot or of one with effects, by the names under which the loop knows them."""
    start = compiled_and_kept(_start, robot_start=start_with_effects if effects else ideal_start)
    later = compiled_and_kept(_later, robot_later=later_with_effects if effects else ideal_later)
    sensed = compiled_and_kept(_sensed, robot_sensed=sensed_with_effects if effects else ideal_sensed)

    def begun(run: EngineRun) -> tuple[Robot, EngineKnown, EngineLog]:
        robot = started(run, start, sensed)
        return robot, unestimated(run, robot), unmeasured(run)

    return {"begin": begun, "advance": partial(moved, later=later, sensed=sensed)}


# callers of the robot's functions, of which the engine keeps the machine code for compiled callers only


def _start(
    robot: FiveBar, actual: FiveBar, mode1: int, mode2: int, mechanism: Mechanism | None, x: float, y: float
) -> Any:
    return robot_start(robot, actual, mode1, mode2, mechanism, x, y)


def _later(
    actual: FiveBar,
    mechanism: Mechanism | None,
    steps: int,
    step: float,
    plant: Any,
    number: int,
    tau1: float,
    tau2: float,
) -> Any:
    return robot_later(actual, mechanism, steps, step, plant, number, tau1, tau2)


def _sensed(mechanism: Mechanism | None, plant: Any) -> Any:
    return robot_sensed(mechanism, plant)
