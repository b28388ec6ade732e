# SPDX-License-Identifier: Apache-2.0
"""A program: planned step by step before anything moves, and carried out by the node graph."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from fivebar_bringup.drives.choice import write_drive_files
from fivebar_bringup.drives.run_files import Rehearsal
from fivebar_bringup.graph.crossing_graph import Work
from fivebar_bringup.graph.node_spec import EMULATED_ROBOT, PLANT, Mode, NodeSpec
from fivebar_bringup.graph.standing import LONGEST, check_takes_goals
from fivebar_bringup.motions.planner_with_odds import PlannerWithOdds
from fivebar_bringup.motions.request import within_drives
from fivebar_bringup.motions.stand import standing_graph
from fivebar_bringup.odds.odds import Odds, kept_odds
from fivebar_bringup.odds.robot_errors import has_odds
from fivebar_bringup.recorded.results import write_results
from fivebar_bringup.recorded.run_directory import RunDirectory, new_run_directory
from fivebar_bringup.recorded.summary import Summary
from fivebar_bringup.runs.launcher import GraphOutcome, RunOptions, run_graph
from fivebar_bringup.runs.processes import ProcessSpec, processes
from fivebar_bringup.runs.run import report_on, run_prepared
from fivebar_bringup.scenario import Scenario
from fivebar_control.planning.order_planning import plan_once
from fivebar_control.planning.orders import Planned, PlanningRequest
from fivebar_control.planning.program import (
    Carry,
    Follow,
    Instruction,
    LoadedProgram,
    Move,
    SetOutput,
    Wait,
    with_files,
)
from fivebar_control.planning.program_run import ENDED, SETTLING, ProgramState
from fivebar_control.planning.timed_points import request_from
from fivebar_control.planning.trajectory_file import TrajectoryFile, points_in
from fivebar_control.scenario.goal_conditions import conditions_of
from fivebar_control.trajectory.refusal import place
from fivebar_description.files import LARGEST_TABLE, read_text, share_file, yaml_path
from fivebar_description.interface import DEFAULT_PRIORITY, PAYLOAD
from fivebar_description.interrupts import interrupts_deferred
from fivebar_description.robot_file import read_robot
from fivebar_description.ros.scheduling import Scheduling
from fivebar_description.scenario_file import DEFAULT_ROBOT
from fivebar_description.strict_yaml import InputError, validate

OF_THE_MOTION = (
    "name",
    "waypoints",
    "trajectory",
    "segment_duration",
    "working_modes",
    "time_law",
    "blend_radius",
    "start",
    "stands",
)
"""Keys of a scenario that a program gives itself."""

PROGRAM_FILE = "program.yaml"
"""The program as carried out, in the directory of its run."""


STILL = Planned()
"""The plan of a step in which nothing moves."""


class PlannedStep(NamedTuple):
    """An instruction, how long it takes (s), and how it is planned, if it is a move."""

    instruction: Instruction
    duration: float
    planned: Planned = STILL


def program_path(name_or_path: str) -> Path:
    """Return the file of a program by the name of a shipped one or by path.

    Raises:
        InputError: no program of that name is shipped.
    """
    return yaml_path("program", name_or_path, share_file("fivebar_bringup", "config", "programs"))


def scenario_of_program(loaded: LoadedProgram, source: str) -> Scenario:
    """Return the scenario in which a program is carried out; its motion is the program's first move, not yet timed.

    Raises:
        InputError: a key is wrong, the controller follows no requests, or the first step is no move.
    """
    program = loaded.program
    for key in OF_THE_MOTION:
        if key in program.scenario:
            raise InputError(f"{source}: scenario.{key}: {program.scenario[key]!r}: a program says itself how it moves")
    first = loaded.instructions[0]
    if not isinstance(first.action, Move | Follow):
        raise InputError(f"{source}: {first.place}: expected a move as the first thing that is done")
    robot = str(program.scenario.get("robot", DEFAULT_ROBOT))
    start = program.start if program.start is not None else read_robot(robot).home_m
    motion: dict[str, Any]
    if isinstance(first.action, Follow):
        motion = {"trajectory": first.action.file, "waypoints": [list(start)]}
    else:
        motion = {"waypoints": [list(start), [first.action.x, first.action.y]]}
    plant = program.scenario.get("plant", {})
    content = {
        "controller": "unified",
        **program.scenario,
        "name": program.name,
        **motion,
        # as strong as a requested motion assumes the motors to be
        "plant": {"torque_limit": within_drives(robot, None, None)[0], **plant} if isinstance(plant, dict) else plant,
    }
    scenario = validate(content, Scenario, f"{source}: scenario")
    try:
        check_takes_goals(scenario)
    except InputError as error:
        raise InputError(f"{source}: scenario.{error}") from error
    return scenario


class PlannedProgram(NamedTuple):
    """A program that is planned step by step.

    Attributes:
        steps: the instructions with what they take.
        odds: how many of the drawn robots make all moves; None where nothing is declared to draw them from.
    """

    steps: tuple[PlannedStep, ...]
    odds: Odds | None = None


def plan_program(loaded: LoadedProgram, scenario: Scenario, source: str, mode: Mode = Mode.LOCKSTEP) -> PlannedProgram:
    """Plan and screen every step without moving, by the odds of each move where robots can be drawn.

    Raises:
        InputError: a move is refused; the message says which step, in which line, and why.
    """
    conditions = conditions_of(scenario, mode is Mode.REALTIME)
    likely = PlannerWithOdds(scenario, conditions) if has_odds(scenario) else None
    x, y = scenario.waypoints[0]
    at, payload = (x, y), 0.0
    robot = scenario.five_bar()
    steps, orders = [], []
    for instruction in loaded.instructions:
        action = instruction.action
        if isinstance(action, Move):
            order = PlanningRequest(
                at,
                scenario.working_mode,
                (action.x, action.y),
                action.assembly,
                action.duration,
                action.torque,
                action.speed,
                payload,
                action.via,
                action.blend_radius,
            )
            planned = plan_once(conditions, order) if likely is None else likely.plan(order)
            if planned.refused:
                raise InputError(f"{source}: {instruction.place}: {planned.refused}")
            steps.append(PlannedStep(instruction, sum(planned.durations), planned))
            orders.append(order)
            at = planned.course.waypoints[-1]
        elif isinstance(action, Follow):
            try:
                points = points_in(TrajectoryFile.at(action.file))
                unknown = (math.nan, math.nan)
                asked = request_from(robot, points, at, scenario.working_mode, unknown, payload)
            except InputError as error:
                raise InputError(f"{source}: {instruction.place}: {error}") from error
            planned = plan_once(conditions, asked)
            if planned.refused:
                raise InputError(f"{source}: {instruction.place}: {action.file}: {planned.refused}")
            steps.append(PlannedStep(instruction, sum(planned.durations), planned))
            at = planned.course.waypoints[-1]
        elif isinstance(action, Carry):
            payload = action.payload
            steps.append(PlannedStep(instruction, SETTLING))
        else:
            steps.append(PlannedStep(instruction, action.seconds if isinstance(action, Wait) else 0.0))
    return PlannedProgram(tuple(steps), None if likely is None else likely.together(orders))


def _by_way_of(move: Move) -> str:
    """Return by way of which points a move goes, in words; "" without any."""
    points = [
        f"{place(*point)} {f'within {radius:g} m' if radius else 'at rest'}"
        for point, radius in zip(move.via, move.blend_radius, strict=True)
    ]
    return f", by way of {', '.join(points)}" if points else ""


def words_of(instruction: Instruction) -> str:
    """Return what an instruction does, in words."""
    action = instruction.action
    if isinstance(action, Move):
        mode = {1: ", assembly mode +", -1: ", assembly mode -", 0: ""}[action.assembly]
        return f"move to {place(action.x, action.y)}{mode}{_by_way_of(action)}"
    if isinstance(action, Follow):
        return f"follow {action.file}"
    if isinstance(action, Wait):
        return f"dwell {action.seconds:g} s"
    if isinstance(action, SetOutput):
        return f"{'set' if action.on else 'reset'} {action.pin}"
    return f"payload {action.payload:g} kg"


def program_as_json(planned: PlannedProgram) -> dict[str, Any]:
    """Return a planned program as plain values; m, s, kg."""
    return {"steps": _steps_as_json(planned.steps), "odds": kept_odds(planned.odds)}


def _steps_as_json(steps: tuple[PlannedStep, ...]) -> list[dict[str, Any]]:
    return [
        {
            "step": step.instruction.number,
            "line": step.instruction.line,
            "rounds": [list(corner) for corner in step.instruction.rounds],
            "does": words_of(step.instruction),
            "duration_s": step.duration,
            "waypoints": [list(point) for point in step.planned.course.waypoints],
            "durations_s": list(step.planned.durations),
            "blend_radius": list(step.planned.course.blend_radius),
            "time_law": step.planned.course.time_law if step.planned.course.waypoints else None,
            "odds": step.planned.odds,
        }
        for step in steps
    ]


def refuse_payload(loaded: LoadedProgram, nodes: Sequence[NodeSpec]) -> None:
    """Check that the robot that is moved, simulated or emulated, can carry the program's payload.

    Raises:
        InputError: it cannot.
    """
    robot = next(node for node in nodes if node.executable in (PLANT, EMULATED_ROBOT))
    first = next((instruction for instruction in loaded.instructions if isinstance(instruction.action, Carry)), None)
    if first is not None and PAYLOAD not in robot.subscribes:
        raise InputError(
            f"{loaded.program.name}: {first.place}: {robot.executable} carries no payload: expected a program"
            " without pick and place, or --hardware simulated"
        )


def run_program(
    loaded: LoadedProgram,
    scenario: Scenario,
    planned: PlannedProgram,
    options: RunOptions,
    rehearse: bool = False,
) -> tuple[RunDirectory, Summary, Mapping[str, Any]]:
    """Carry out a planned program with all nodes; return the directory, the summary and the program's last status.

    With `rehearse`, bridge and emulated drives replace the plant.

    Raises:
        InputError: the output directory cannot be used, the scenario cannot be rehearsed, or the robot that would be
            moved cannot carry the program's payload.
    """
    first, odds = planned.steps[0].planned, planned.odds
    course = first.course
    update = {"waypoints": course.waypoints, "segment_duration": first.durations, "time_law": course.time_law}
    if course.rounded:
        update["blend_radius"] = course.blend_radius
    timed = scenario if scenario.trajectory else scenario.model_copy(update=update)
    last: dict[str, Any] = {}

    def specs() -> Sequence[ProcessSpec]:
        file = run.path / PROGRAM_FILE
        copies = {name: f"followed_{number}.csv" for number, name in enumerate(loaded.followed, start=1)}
        texts = {copies[name]: read_text(Path(path), LARGEST_TABLE) for name, path in loaded.followed.items()}
        write_results(run.path, {**texts, file.name: with_files(loaded.text, run.files_of(timed), copies)})
        rehearsal = Rehearsal(write_drive_files(timed, run.path)) if rehearse else None
        nodes = standing_graph(timed, options.mode, run, LONGEST, Work(str(file.absolute()), 1, loaded.pins), rehearsal)
        refuse_payload(loaded, nodes)
        return processes(nodes, options.mode, timed.rate_hz, Scheduling(DEFAULT_PRIORITY))

    def followed(status: Mapping[str, Any]) -> bool:
        last.update(status)
        return status.get("state") in ENDED

    def follow(specs: Sequence[ProcessSpec], chosen: int) -> GraphOutcome:
        return run_graph(specs, run, chosen, options, followed=followed)

    with interrupts_deferred():
        run = new_run_directory(options.out, timed, kept_odds(odds))
        outcome = run_prepared(timed, options, specs, follow, odds is not None)
        if last.get("state") not in (ProgramState.COMPLETED, *([] if outcome.faults else [ProgramState.RUNNING])):
            stopped = f"program_stopped: {last.get('reason', 'not completed')}"
            outcome = outcome._replace(faults=[*outcome.faults, stopped])
        return run, report_on(run, timed, options.mode, outcome, options.with_page), last
