# SPDX-License-Identifier: Apache-2.0
"""Subcommands for motions on request: goto, stand."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from fivebar_bringup.cli.app import (
    BAD_INPUT,
    COMPLETED,
    FAILED,
    Group,
    JsonOption,
    NamespaceOption,
    OutOption,
    OwnDomainOption,
    PageOption,
    RealtimeOption,
    ScenarioArgument,
    SetOption,
    command,
    input_errors,
    print_outcome,
)
from fivebar_bringup.cli.printing import Printer
from fivebar_bringup.cli.progress import progress_bar
from fivebar_bringup.cli.status import graph_domain
from fivebar_bringup.cli.viewing import ViewOption, live_page
from fivebar_bringup.graph.node_spec import Mode
from fivebar_bringup.recorded.outcome import EXIT_STATUS
from fivebar_bringup.runs.namespace import read_namespace
from fivebar_control.model.state import WorkingMode
from fivebar_description.errors import InputError
from fivebar_description.interrupts import keyboard_interrupts
from fivebar_description.ros_environment import HIGHEST_DOMAIN, check_ros_environment

if TYPE_CHECKING:
    from fivebar_bringup.motions.start import Start
    from fivebar_control.planning.timed_points import TimedPoints

DEFAULT_CONTROLLER = "unified"
"""Controller of a motion that `goto` runs itself."""

LONGEST_WAIT = 120.0
"""s, for the end of a motion on a running graph."""

OF_ITS_OWN = (
    "expected without --live: the running graph has its own robot, start, controller, limits and results; only --mode,"
    " --working-mode, --duration, --via and --blend-radius go with a goal, and nothing with --trajectory"
)
"""Why most options have no effect on a running graph: its own scenario has set what they set."""


# a negative coordinate must not be taken for an option
@command(
    Group.RUN,
    idle={"--plan-only": ("--out", "--no-page", "--offline", "--ros")},
    context_settings={"ignore_unknown_options": True},
)
def goto(
    x: Annotated[float | None, typer.Argument(help="Goal, m.", show_default=False)] = None,
    y: Annotated[float | None, typer.Argument(help="Goal, m.", show_default=False)] = None,
    mode: Annotated[
        str | None,
        typer.Option(
            "--mode",
            metavar="+|-",
            help="Assembly mode at the goal: the sign of det A [default: the one that the goal has]",
        ),
    ] = None,
    working_mode: Annotated[
        tuple[int, int] | None,
        typer.Option("--working-mode", metavar="S1 S2", help="Elbow sides at the goal [default: those of the start]"),
    ] = None,
    start: Annotated[
        tuple[float, float] | None,
        typer.Option("--from", metavar="X Y", help="Where the robot rests, m [default: home_m of its file]"),
    ] = None,
    start_mode: Annotated[
        tuple[int, int] | None,
        typer.Option("--from-mode", metavar="S1 S2", help="Its elbow sides [default: {home_mode}]"),
    ] = None,
    after: Annotated[
        Path | None, typer.Option("--after", metavar="DIR", help="Begin where the run in DIR has ended.")
    ] = None,
    seen: Annotated[
        str | None,
        typer.Option("--seen", metavar="SCENARIO", help="Begin where the camera of this scenario sees the robot."),
    ] = None,
    controller: Annotated[
        str | None, typer.Option(help=f"One of {{crossing_controllers}} [default: {DEFAULT_CONTROLLER}]")
    ] = None,
    judge: Annotated[
        str | None,
        typer.Option(
            metavar="timed|path",
            help="By which distance the motion is judged, from its reference or from its path, by screen, odds and run"
            " [default: timed, or that of --after]",
        ),
    ] = None,
    robot: Annotated[
        str | None, typer.Option(help="A shipped robot, or a robot file [default: dextar, or that of --after]")
    ] = None,
    torque_limit: Annotated[
        float | None,
        typer.Option(help="Of both motors, Nm [default: that of the robot's file, else {torque_limit}]"),
    ] = None,
    speed_limit: Annotated[
        float | None,
        typer.Option(help="Of both motors, rad/s [default: that of the robot's file, else {speed_limit}]"),
    ] = None,
    duration: Annotated[
        float | None, typer.Option(help="Of the whole motion, s [default: comfortably within the limits]")
    ] = None,
    via: Annotated[
        list[str] | None,
        typer.Option("--via", metavar="X,Y", help="A point on the way, m, with straight lines to it; may be repeated."),
    ] = None,
    blend_radius: Annotated[
        list[float] | None,
        typer.Option(
            "--blend-radius",
            metavar="R",
            help="Round the corners at the via points within R m, without a rest; once, or once for each --via"
            " [default: 0, a rest]",
        ),
    ] = None,
    trajectory: Annotated[
        Path | None,
        typer.Option(
            "--trajectory",
            metavar="FILE.csv",
            help="In place of X Y: go through the rows of a file, columns time_s, x_m, y_m, or q1_rad, q2_rad.",
        ),
    ] = None,
    retime: Annotated[
        bool, typer.Option("--retime", help="With --trajectory: keep the path of the file and choose the pace.")
    ] = False,
    changes: SetOption = None,
    fastest: Annotated[bool, typer.Option("--fastest", help="As fast as the limits allow.")] = False,
    plan_only: Annotated[
        bool, typer.Option("--plan-only", help="Plan and check the motion without running it.")
    ] = False,
    offline: Annotated[
        bool | None,
        typer.Option(
            "--offline/--ros",
            help="Simulate it in this process, or with all nodes in lockstep [default: in this process]",
            show_default=False,
        ),
    ] = None,
    live: Annotated[
        bool, typer.Option("--live", help="Send the goal to the graph in --domain, such as that of `fivebar stand`.")
    ] = False,
    domain: Annotated[
        int | None,
        typer.Option(
            "--domain",
            min=0,
            max=HIGHEST_DOMAIN,
            help="ROS_DOMAIN_ID of that graph [default: the environment's, else that of the one run going on, else 0]",
        ),
    ] = None,
    namespace: NamespaceOption = "",
    timeout: Annotated[
        float | None,
        typer.Option(help=f"With --live: longest wait for the motion's end, s [default: {LONGEST_WAIT:g}]"),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="New or empty directory for the results [default: runs/goto-DATE-TIME]"),
    ] = None,
    page: PageOption = True,
    as_json: JsonOption = False,
) -> None:
    """Plan a motion to the point X Y, check it, and run it.

    Where the goal is in the other assembly mode, the motion goes through the Type 2 locus. It is planned and checked
    first: where to cross the locus, how fast, and whether torque, speeds, margins and dwell near the locus keep their
    limits. Where no motion is feasible, the command gives the reason (exit status 2).

    `--set` changes keys of the scenario that the motion is run by, as `fivebar simulate --set` does; what an option of
    its own decides, or the planner, is refused with the name of that.

    With `--trajectory` the motion goes through the rows of a CSV file at their times, and starts in its first row. What
    is refused names the row. `--retime` keeps the path and chooses the pace; the run's directory has the file as it was
    followed.

    It is simulated in this process, without ROS. With `--ros` all nodes run it, in lockstep: the same bag and report,
    somewhat later.

    Example: `fivebar goto 0 0.02 --mode - --fastest`

    Example: `fivebar goto 0.03 0.02 --via 0.04,0.13 --blend-radius 0.02`

    Example: `fivebar goto --trajectory figure.csv --retime`
    """
    from fivebar_bringup.motions.likely import plan_likely
    from fivebar_bringup.motions.request import Request, check_positive, within_drives
    from fivebar_bringup.motions.transfer_report import as_json as transfer_as_json
    from fivebar_bringup.motions.transfer_report import as_text
    from fivebar_bringup.runs.offline import run_offline
    from fivebar_bringup.scenarios.changes import read_changes
    from fivebar_control.planning.timing import Speed
    from fivebar_control.trajectory.rounded import RESTS
    from fivebar_description.scenario_file import DEFAULT_ROBOT

    with input_errors(), keyboard_interrupts():
        if fastest and duration is not None:
            raise InputError("--fastest and --duration: expected one of them")
        if trajectory is None:
            _refuse_given({"--retime": retime or None}, "expected with --trajectory")
            if x is None or y is None:
                raise InputError("X Y: expected the goal, or --trajectory FILE.csv")
            goal = x, y
        else:
            decided: dict[str, object] = {
                "X Y": x,
                "--mode": mode,
                "--working-mode": working_mode,
                "--duration": duration,
            }
            decided |= {"--via": via, "--blend-radius": blend_radius, "--seen": seen, "--fastest": fastest or None}
            _refuse_given(decided, "expected without --trajectory, whose file says how the robot moves")
        file = None if trajectory is None else _points_of(trajectory)
        points = [_point(text) for text in via or ()]
        radii = _radii(blend_radius or list(RESTS), len(points))
        if live:
            without_effect = {
                "--from": start,
                "--from-mode": start_mode,
                "--after": after,
                "--seen": seen,
                "--controller": controller,
                "--judge": judge,
                "--robot": robot,
                "--torque-limit": torque_limit,
                "--speed-limit": speed_limit,
                "--set": changes or None,
                "--fastest": fastest or None,
                "--retime": retime or None,
                "--plan-only": plan_only or None,
                "--offline": offline or None,
                "--ros": offline is False or None,
                "--out": out,
                "--no-page": None if page else True,
            }
            _refuse_given(without_effect, OF_ITS_OWN)
            check_ros_environment()
            # here, because it loads ROS
            from fivebar_bringup.motions.live import goal_fields

            wait = LONGEST_WAIT if timeout is None else timeout
            check_positive("--timeout", wait)
            if duration is not None:
                check_positive("--duration", duration)
            asked: dict[str, float] | TimedPoints
            asked = goal_fields(*goal, mode, working_mode, duration, points, radii) if file is None else file
            _live(
                asked,
                graph_domain(domain, environment_first=True),
                read_namespace(namespace),
                wait,
                as_json,
            )
        of_live = {"--domain": domain, "--namespace": namespace or None, "--timeout": timeout}
        _refuse_given(of_live, "expected with --live: this motion is run on its own")
        with_nodes = offline is False
        if with_nodes and not plan_only:
            check_ros_environment()
        if file is not None and start is None and after is None:
            start = file.start()
        begin = _start(start, start_mode, after, robot, seen)
        known = DEFAULT_ROBOT if begin.scenario is None else begin.scenario.robot
        torque, speed = within_drives(known if robot is None else robot, torque_limit, speed_limit)
        request = Request(
            x=begin.x if x is None else x,
            y=begin.y if y is None else y,
            assembly=mode,
            working_mode=working_mode,
            start=begin,
            controller=DEFAULT_CONTROLLER if controller is None else controller,
            robot=known if robot is None else robot,
            torque_limit=torque,
            motor_speed=speed,
            rate_hz=500 if begin.scenario is None else begin.scenario.rate_hz,
            duration=duration if duration is not None else Speed.FASTEST if fastest else Speed.COMFORTABLE,
            via=tuple(points),
            blend_radius=radii or RESTS,
            judge=judge,
            changes=read_changes(changes),
            trajectory="" if trajectory is None else str(trajectory),
        )
        began = time.monotonic()
        with ExitStack() as files:
            with progress_bar("planning", as_json):
                if retime:
                    # here, because other motions need no solver of paces
                    from fivebar_bringup.motions.trajectory import at_another_pace

                    request = files.enter_context(at_another_pace(request))
                likely = plan_likely(request)
            planning_s = time.monotonic() - began
            plan = transfer_as_json(request, likely, planning_s)
            if not as_json:
                Printer(soft_wrap=True).print(as_text(request, likely, planning_s), highlight=False)
            if plan_only:
                if as_json:
                    print(json.dumps({"plan": plan}, indent=2, allow_nan=False))
                raise typer.Exit(COMPLETED)
            scenario = likely.scenario
            with progress_bar("goto", as_json) as progress:
                if with_nodes:
                    # here, because a simulation needs no node
                    from fivebar_bringup.runs.launcher import RunOptions
                    from fivebar_bringup.runs.run import run_with_ros

                    lockstep = RunOptions(Mode.LOCKSTEP, out, None, progress, with_page=page, odds=likely.known_odds)
                    directory, summary = run_with_ros(scenario, lockstep)
                else:
                    directory, summary = run_offline(scenario, out, progress, page, likely.known_odds)
    if as_json:
        print(json.dumps({"plan": plan, "summary": summary.as_dict()}, indent=2, allow_nan=False))
    else:
        print_outcome(directory, summary)
    raise typer.Exit(EXIT_STATUS[summary.outcome])


@command(Group.RUN)
def stand(
    scenario: ScenarioArgument = "unified_middle",
    seconds: Annotated[
        float | None,
        typer.Option(min=0.0, help="How long the robot rests afterwards, in simulated time [default: until Ctrl-C]"),
    ] = None,
    realtime: RealtimeOption = False,
    domain: OwnDomainOption = None,
    view: ViewOption = False,
    namespace: NamespaceOption = "",
    out: OutOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run a motion, then keep the robot ready for goals.

    The robot stands where the motion of SCENARIO has ended, and moves when a goal comes: from `fivebar goto --live`, by
    a click on the live page, or on the topic goal.

    Example: `fivebar stand unified_middle --realtime --domain 7 --seconds 300`
    """
    from fivebar_bringup.motions.stand import stand as rest
    from fivebar_bringup.runs.admission import load_with_odds
    from fivebar_bringup.runs.launcher import RunOptions

    with input_errors(), keyboard_interrupts():
        check_ros_environment()
        within = read_namespace(namespace)
        admitted = load_with_odds(scenario)
        loaded = admitted.scenario
        mode = Mode.REALTIME if realtime else Mode.LOCKSTEP
        how_long = "until Ctrl-C" if seconds is None else f"for {seconds:g} s of simulated time"
        Printer(stderr=True, soft_wrap=True).print(f"after its motion the robot rests {how_long} and accepts goals")
        with live_page(view, domain, within) as live, progress_bar(loaded.name, as_json, until_begun=True) as progress:
            # until Ctrl-C there is no end to count to
            shown = progress if seconds is not None else lambda done, total: progress(done, 0)
            options = RunOptions(mode, out, live.domain, shown, within, odds=admitted.kept)
            directory, summary = rest(loaded, seconds, options)
            live.tell(directory, summary)
    if as_json:
        print(json.dumps(summary.as_dict(), indent=2, allow_nan=False))
    else:
        print_outcome(directory, summary)
    raise typer.Exit(EXIT_STATUS[summary.outcome])


def _live(
    asked: dict[str, float] | TimedPoints, domain: int, namespace: str, timeout: float, as_json: bool
) -> NoReturn:
    """Follow a goal on a running graph; exit status 2 where it is refused, 1 where a fault stops it."""
    from fivebar_bringup.motions.live import request_live
    from fivebar_bringup.odds.odds import told_odds

    def report(status: dict[str, Any]) -> None:
        if not as_json:
            detail = status.get("reason") or (f"{sum(status['durations_s']):.3f} s" if "durations_s" in status else "")
            if "odds" in status:
                detail += f"; odds: {told_odds(status['odds'])}"
            print(f"{status['state']}{': ' if detail else ''}{detail}", flush=True)

    last = request_live(asked, domain, timeout, report, namespace)
    if as_json:
        print(json.dumps(last, indent=2, allow_nan=False))
    raise typer.Exit({"arrived": COMPLETED, "refused": BAD_INPUT}.get(last["state"], FAILED))


def _refuse_given(options: Mapping[str, object], reason: str) -> None:
    """Refuse those of some options that have been given, which would have no effect, for a reason."""
    unused = [option for option, value in options.items() if value is not None]
    if unused:
        raise InputError(f"{', '.join(unused)}: {reason}")


def _points_of(path: Path) -> TimedPoints:
    """Return the points of a trajectory's file."""
    from fivebar_control.planning.trajectory_file import TrajectoryFile, points_in

    return points_in(TrajectoryFile.at(str(path)))


def _point(text: str) -> tuple[float, float]:
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--via: {text!r}: expected two coordinates in m, such as 0.04,0.13") from None
    return x, y


def _radii(radii: list[float], count: int) -> tuple[float, ...]:
    """Return the blend radius (m) of each of so many via points."""
    from fivebar_control.trajectory.refusal import PlanRefused
    from fivebar_control.trajectory.rounded import radii_at

    if any(radii) and not count:
        raise InputError("--blend-radius: expected with --via, whose corners are rounded")
    try:
        return radii_at(radii, count)
    except PlanRefused as refusal:
        raise InputError(f"--{str(refusal).replace('_', '-', 1)}") from refusal


def _start(
    start: tuple[float, float] | None,
    start_mode: WorkingMode | None,
    after: Path | None,
    robot: str | None,
    seen: str | None,
) -> Start:
    from fivebar_bringup.motions.start import HOME_MODE, Start, start_after, start_seen
    from fivebar_description.robot_file import read_robot
    from fivebar_description.scenario_file import DEFAULT_ROBOT

    if after is None and seen is None:
        return Start(*(start or read_robot(robot or DEFAULT_ROBOT).home_m), start_mode or HOME_MODE)
    if start is not None or start_mode is not None or (after is not None and seen is not None):
        raise InputError("--seen, --after and --from: expected one of them")
    return start_after(after) if after is not None else start_seen(seen or "")
