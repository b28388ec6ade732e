# SPDX-License-Identifier: Apache-2.0
"""A requested motion: from the command's options to a planned transfer and the scenario that runs it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from fivebar_bringup.motions.start import Start
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.changes import changed_scenario, refuse_decided
from fivebar_control.estimation.homing import check_declared, homing_at
from fivebar_control.laws import registry
from fivebar_control.model.state import WorkingMode
from fivebar_control.planning.course import Course
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.planning.line_of_sight import Point
from fivebar_control.planning.pacing import Task
from fivebar_control.planning.postures import mode_name, place_at
from fivebar_control.planning.timing import Speed
from fivebar_control.planning.transfer import Transfer, plan_transfer
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_control.scenario.motion_limits import scenario_limits
from fivebar_control.scenario.sensors import sensing_if_estimated
from fivebar_control.trajectory.path_distance import KEPT_TO
from fivebar_control.trajectory.rounded import RESTS
from fivebar_description.known_drives import LARGEST_SPEED
from fivebar_description.other_units import in_other_unit
from fivebar_description.plausibility import too_strong
from fivebar_description.robot_file import load_robot, read_robot
from fivebar_description.settings import plain_keys
from fivebar_description.strict_yaml import InputError, validate
from fivebar_description.suggestion import expected_one_of

ASSEMBLY_MODES = {"+": 1, "-": -1}
"""The assembly modes by name: the sign of det A."""


class Request(NamedTuple):
    """A request for a motion.

    Attributes:
        x, y: goal (m).
        assembly: "+" or "-", None for the assembly mode that the goal has.
        working_mode: in which the goal is to be reached, None for that of the start.
        start: where the robot rests.
        controller: one that is meant to cross the Type 2 locus.
        robot: a shipped robot's name, or the path of a robot file.
        torque_limit: of both motors (Nm).
        motor_speed: allowed for both motors (rad/s).
        rate_hz: of the controllers.
        duration: s, or how to choose it.
        via: points (m) on the way.
        blend_radius: within which each corner there is rounded (m), 0 for a rest; one for all, or one for each.
        judge: "timed" or "path", by which distance the motion is judged; None for that of the run before.
        changes: values of further keys of the scenario, by their names with dots.
        trajectory: path of a CSV file whose rows the motion goes through, in place of goal and duration; "" for none.
    """

    x: float
    y: float
    assembly: str | None
    working_mode: WorkingMode | None
    start: Start
    controller: str
    robot: str
    torque_limit: float
    motor_speed: float
    rate_hz: int
    duration: float | Speed
    via: tuple[Point, ...] = ()
    blend_radius: tuple[float, ...] = RESTS
    judge: str | None = None
    changes: Mapping[str, Any] = MappingProxyType({})
    trajectory: str = ""


DECIDED = {
    "name": "--out",
    "controller": "--controller",
    "robot": "--robot",
    "judge": "--judge",
    "waypoints": "the goal X Y, --from and --via",
    "trajectory": "--trajectory",
    "working_mode": "--working-mode and --from-mode",
    "working_modes": "a scenario, since `goto` stays in one working mode",
    "start": "--seen",
    "stands": "--from",
    "segment_duration": "--duration or --fastest",
    "time_law": "--fastest, since the planner chooses it",
    "blend_radius": "--blend-radius",
    "plant.torque_limit": "--torque-limit",
    "rate_hz": "a scenario with `fivebar simulate`",
    "force": "a scenario with `fivebar simulate`, since `goto` runs no motion that is refused",
    "drives_file": "`fivebar run --hardware`",
}
"""Keys of the scenario that a request decides itself, and what to use in their place."""

OF_A_MOTION = ("working_modes", "trajectory", "start", "stands", "segment_duration", "time_law", "blend_radius")
"""Keys of a run before that say how it moved."""


def within_drives(robot: str, torque_limit: float | None, speed_limit: float | None) -> tuple[float, float]:
    """Return limits of torque (Nm) and motor speed (rad/s): as given, else of the robot's file, else the usual ones.

    Raises:
        InputError: the robot's file is missing or does not describe a five-bar, or a limit is not one of such a robot.
    """
    file = read_robot(robot)
    beyond = None if torque_limit is None else too_strong(file, torque_limit)
    if beyond is not None:
        raise InputError(f"--torque-limit: {beyond}")
    if speed_limit is not None and speed_limit > LARGEST_SPEED:
        unit = in_other_unit("rad/s", lambda size: size * speed_limit <= LARGEST_SPEED)
        raise InputError(f"--speed-limit: {speed_limit:g}: expected at most {LARGEST_SPEED:g} rad/s{unit}")
    drives, usual = file.drives, MotionLimits()
    torques = torque_limit, drives.torque_limit, usual.torque
    speeds = speed_limit, drives.joint_speed_limit, usual.motor_speed
    torque, speed = (next(limit for limit in limits if limit is not None) for limits in (torques, speeds))
    return torque, speed


def plan_request(request: Request, judge_loads: bool = True) -> Transfer:
    """Plan the motion.

    Args:
        request: what is asked for.
        judge_loads: refuse crossings that the declared loads displace too far; False where the odds decide about them.

    Raises:
        InputError: a value is impossible, or there is no feasible motion; says why.
        HomingContradicted: the estimator could not tell the assembly mode at the start.
    """
    refuse_malformed(request)
    start = request.start
    if request.working_mode is not None and request.working_mode != start.working_mode:
        raise InputError(
            f"--working-mode: {mode_name(request.working_mode)}: the robot rests in working mode"
            f" {mode_name(start.working_mode)}, and another one is reached only through a Type 1 singularity:"
            " see working_modes in a scenario"
        )
    if request.trajectory:
        return _followed(request, judge_loads)
    task = task_of_request(request, judge_loads)
    transfer = plan_transfer(
        task,
        (start.x, start.y),
        (request.x, request.y),
        None if request.assembly is None else ASSEMBLY_MODES[request.assembly],
        request.duration,
        request.via,
        request.blend_radius,
    )
    if asked_scenario(request).estimated:
        check_declared(task.robot, homing_at(task.robot, start.working_mode, start.x, start.y))
    return transfer


def _followed(request: Request, judge_loads: bool) -> Transfer:
    """Return the motion through the rows of a file."""
    asked, task = asked_scenario(request), task_of_request(request, judge_loads)
    plan = asked.plan()
    verdict = task.judge_run(plan)
    asked.refuse_infeasible(verdict)
    start, end = asked.waypoints
    signs = [place_at(task.robot, task.working_mode, *point).assembly for point in (start, end)]
    if asked.estimated:
        check_declared(task.robot, homing_at(task.robot, task.working_mode, *start))
    return Transfer(plan, verdict, Course((start, end)), asked.durations(), signs[0], signs[1])


def task_of_request(request: Request, judge_loads: bool = True) -> Task:
    """Return the task of a request; arguments as for `plan_request`."""
    asked = asked_scenario(request)
    # settings are the defaults, those of torques in the robot's size
    if request.changes:
        follower = tuned_controller(asked)
    else:
        follower = registry.default_tuning(registry.find_controller(request.controller), read_robot(request.robot))
    limits = scenario_limits(asked, None, follower, request.torque_limit, request.motor_speed)
    return Task(
        load_robot(request.robot),
        request.start.working_mode,
        request.rate_hz,
        follower,
        limits if judge_loads else limits.without_loads(),
        sensing_if_estimated(asked),
    )


def scenario_of(request: Request, transfer: Transfer) -> Scenario:
    """Return the scenario that runs a transfer; what it does not say is as in the run before, if there was one.

    Raises:
        InputError: the run before has settings that do not go with the request.
    """
    before, asked = request.start.scenario, asked_scenario(request)
    if request.trajectory:
        return asked
    content = {} if before is None else before.model_dump(mode="json", exclude={"working_modes", "trajectory"})
    content |= {
        "name": "goto",
        "controller": request.controller,
        "robot": request.robot,
        "working_mode": list(request.start.working_mode),
        "waypoints": [list(point) for point in transfer.waypoints],
        "segment_duration": list(transfer.durations),
        "time_law": transfer.course.time_law,
        "blend_radius": list(transfer.course.blend_radius) if transfer.course.rounded else 0.0,
        "rate_hz": request.rate_hz,
        "judge": asked.judge,
        "plant": plain_keys(asked.plant),
    }
    return changed_scenario(content, request.changes) if request.changes else validate(content, Scenario, "goto")


def asked_scenario(request: Request) -> Scenario:
    """Return the run before with all of a request but its motion: the robot, the rate, the torque, what judges it.

    Where there was no run before, the rest are the defaults of the robot.
    """
    start, before = request.start, request.start.scenario
    here = [start.x, start.y]
    motion: dict[str, Any] = {"working_mode": list(start.working_mode)}
    motion |= {"waypoints": [here]} if request.trajectory else {"waypoints": [here, [request.x, request.y]]}
    motion |= {"trajectory": request.trajectory} if request.trajectory else {}
    content = {"name": "goto", "controller": request.controller, "robot": request.robot, **motion}
    if before is None:
        before = validate(content, Scenario, "goto")
    elif request.trajectory or before.trajectory:
        kept = before.model_dump(mode="json", exclude={*OF_A_MOTION})
        content = kept | content
        before = validate(content, Scenario, "goto")
    else:
        content = before.model_dump(mode="json") | {"controller": request.controller, "robot": request.robot}
    if request.changes:
        refuse_decided(request.changes, DECIDED)
        before = changed_scenario(content, request.changes)
    update: dict[str, object] = {
        "robot": request.robot,
        "rate_hz": request.rate_hz,
        "plant": before.plant._replace(torque_limit=request.torque_limit),
        "judge": before.judge if request.judge is None else request.judge,
    }
    return before.model_copy(update=update)


def refuse_malformed(request: Request) -> None:
    """Refuse a request with impossible values.

    Raises:
        InputError: names the option.
    """
    if request.assembly is not None and request.assembly not in ASSEMBLY_MODES:
        raise InputError(f"--mode: {request.assembly!r}: expected + or -, the sign of det A")
    for option, mode in (("--working-mode", request.working_mode), ("--from-mode", request.start.working_mode)):
        if mode is not None and any(sign not in (-1, 1) for sign in mode):
            raise InputError(f"{option}: {list(mode)}: expected two signs, each 1 or -1")
    if request.controller not in registry.CONTROLLERS or not registry.CONTROLLERS[request.controller].crosses:
        able = registry.crossing_controllers()
        raise InputError(f"--controller: {request.controller!r}: {expected_one_of(request.controller, able)}")
    if request.judge is not None and request.judge not in KEPT_TO:
        raise InputError(f"--judge: {request.judge!r}: {expected_one_of(request.judge, tuple(KEPT_TO))}")
    figures = {"--torque-limit": request.torque_limit, "--speed-limit": request.motor_speed}
    if not isinstance(request.duration, Speed):
        figures["--duration"] = request.duration
    for option, value in figures.items():
        check_positive(option, value)


def check_positive(option: str, value: float) -> None:
    """Refuse the value of an option that is no positive number.

    Raises:
        InputError: it is zero, negative or not finite.
    """
    if not (math.isfinite(value) and value > 0.0):
        raise InputError(f"{option}: {value}: expected a positive number")
