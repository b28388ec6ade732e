# SPDX-License-Identifier: Apache-2.0
"""Plans a motion of a robot as its file declares it, and runs it on drawn robots and on variants of them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

from fivebar_bringup.motions.likely import plan_likely
from fivebar_bringup.odds.robot_errors import NO_ERRORS, RobotErrors
from fivebar_bringup.odds.trials import FRESH_ROBOTS, tries_of
from fivebar_bringup.scenario import Scenario
from fivebar_control.compiling import expect_many_motions
from fivebar_control.loop.closed_loop import FAULT_NAMES
from fivebar_control.trajectory.planner import Plan
from fivebar_description.errors import InputError
from fivebar_description.optional import CAMERA_PARTS, first_missing
from fivebar_description.robot_file import read_robot
from fivebar_description.strict_yaml import validate
from fivebar_studies.assess.rows import ACCEPTED, AS_IN_FILE, OUT_OF_REACH, RANDOM, REFUSED, UNLIKELY, AssessRow
from fivebar_studies.assess.typical import Typical, request_for, typical_motions
from fivebar_studies.engine.study import StudySettings
from fivebar_studies.rigs.declared import DECLARED, REACHABLE, REMOVED, SENSORS, TUNINGS, UPGRADES, rig_of
from fivebar_studies.rigs.named import find_rig
from fivebar_studies.rigs.rig import Rig
from fivebar_studies.sweep.drawing import PLANNED_FOR, Draw, draw, on_robot
from fivebar_studies.sweep.planning import odds_seed, planned, screened, timed, timed_for_loads
from fivebar_studies.sweep.running import verdict_on

TYPICAL_ROBOTS = 24
"""Robots that make a typical motion."""


class AssessSettings(StudySettings):
    """The settings that determine the rows of an assessment.

    Attributes:
        robot: by the name of its file.
        cases: random crossings that are run.
        robots: drawn robots that make each of them.
        seed: of all draws.
        controllers: the first one is also run on the variants of the robot.
    """

    robot: str = "dextar"
    cases: int = 60
    robots: int = 8
    seed: int = 1
    controllers: tuple[str, ...] = (PLANNED_FOR,)


def run_numbered(settings: AssessSettings, number: int) -> list[AssessRow]:
    """Return the rows of a motion: the typical ones come first, then those that are drawn."""
    expect_many_motions()
    typical = typical_motions(settings.robot)
    if number < len(typical):
        return _typical(settings, number, typical[number])
    return _random(settings, number)


@lru_cache(maxsize=4)
def variants_of(robot: str) -> list[str]:
    """Return the variants of a robot that differ from it as it is declared, and from each other."""
    different = {DECLARED: _plain(find_rig(rig_of(robot)))}
    # a robot without a camera can be assessed where the camera's packages were left out
    left_out = {"camera"} if first_missing(CAMERA_PARTS) else set()
    for name in (variant for variant in (*REMOVED, *SENSORS, *TUNINGS) if variant not in left_out):
        rig = _plain(find_rig(rig_of(robot, name)))
        if rig not in different.values():
            different[name] = rig
    return [*different][1:]


def typical_variants(robot: str) -> list[str]:
    """Return the variants of a robot whose planner is asked for a typical motion, until one accepts it.

    Of a robot that declares no errors also what `fivebar goto` makes of its file, where it counts as known exactly.
    """
    as_in_file = [] if read_robot(robot).declares_errors else [AS_IN_FILE]
    return [*as_in_file, DECLARED, *(name for name in UPGRADES if name in variants_of(robot))]


def _plain(rig: Rig) -> Rig:
    return rig.model_copy(update={"words": ""})


def _random(settings: AssessSettings, number: int) -> list[AssessRow]:
    case = draw(settings.seed, number, rig_of(settings.robot))
    try:
        timed_case = timed(case)
        _, reasons = verdict_on(timed_case, PLANNED_FOR)
    except InputError as refusal:
        return [AssessRow(number, RANDOM, REFUSED, str(refusal), mode1=case.mode1, mode2=case.mode2)]
    crossing, status = timed_case.motion, UNLIKELY if reasons else ACCEPTED
    if reasons and not (timed_case.odds is not None and timed_case.odds.robots):
        # not even tried: as it is timed for a robot that is known better
        within_reach = _within_reach(crossing)
        if within_reach is None:
            return [AssessRow(number, RANDOM, OUT_OF_REACH, "; ".join(reasons), mode1=case.mode1, mode2=case.mode2)]
        crossing = within_reach
    common = _common(number, RANDOM, status, "; ".join(reasons), planned(crossing))
    rows: list[AssessRow] = []
    for variant in (DECLARED, *variants_of(settings.robot)):
        rig = rig_of(settings.robot, variant)
        on = on_robot(crossing, rig)
        for controller in settings.controllers if variant == DECLARED else settings.controllers[:1]:
            start = common._replace(variant=variant, controller=controller)
            rows += _runs(start, on.scenario(controller), find_rig(rig).errors, odds_seed(case), settings.robots)
    return rows


def _within_reach(case: Draw) -> Draw | None:
    """Return a case as it is timed for the robot exactly known and with a gyroscope, None where that is infeasible."""
    better = on_robot(case, rig_of(case.robot_name, REACHABLE))
    try:
        timed_draw = timed_for_loads(better)
        planned(timed_draw)
    except InputError:
        return None
    if not screened(timed_draw, PLANNED_FOR, judge_loads=False).feasible:
        return None
    return on_robot(timed_draw, case.rig)


def _typical(settings: AssessSettings, number: int, motion: Typical) -> list[AssessRow]:
    rows: list[AssessRow] = []
    for variant in typical_variants(settings.robot):
        of_variant = list(_typical_of(settings, number, motion, variant))
        rows += of_variant
        if variant != AS_IN_FILE and of_variant[0].status == ACCEPTED:
            break
    return rows


def _typical_of(settings: AssessSettings, number: int, motion: Typical, variant: str) -> Iterator[AssessRow]:
    """Yield the rows of a typical motion of a variant of the robot."""
    as_in_file = variant == AS_IN_FILE
    request = request_for(motion, settings.robot, PLANNED_FOR, None if as_in_file else variant)
    try:
        planned = plan_likely(request).scenario
    except InputError as refusal:
        yield AssessRow(number, motion.name, REFUSED, str(refusal), variant)
        return
    common = _common(number, motion.name, ACCEPTED, "", planned.plan())._replace(variant=variant)
    for controller in settings.controllers:
        of_run = common._replace(controller=controller)
        if as_in_file:
            scenario = validate(planned.model_dump() | {"controller": controller}, Scenario, motion.name)
            yield from _runs(of_run, scenario, NO_ERRORS, settings.seed, 1)
            continue
        rig = find_rig(rig_of(settings.robot, variant))
        scenario = validate(rig.content(planned, controller, {}), Scenario, motion.name)
        yield from _runs(of_run, scenario, rig.errors, settings.seed, TYPICAL_ROBOTS)


def _common(number: int, motion: str, status: str, reason: str, plan: Plan) -> AssessRow:
    first = plan.crossings[0] if plan.crossings else None
    return AssessRow(
        number,
        motion,
        status,
        reason,
        mode1=plan.mode[0],
        mode2=plan.mode[1],
        crossing_x=None if first is None else first.x,
        crossing_y=None if first is None else first.y,
        distal_links="" if first is None else first.distal_links,
        duration=plan.path.duration,
    )


def _runs(common: AssessRow, scenario: Scenario, errors: RobotErrors, seed: int, robots: int) -> Iterator[AssessRow]:
    """Yield the rows of a motion's runs on drawn robots."""
    for run in tries_of(scenario, errors, seed, range(FRESH_ROBOTS, FRESH_ROBOTS + robots)):
        outcome = run.outcome
        yield common._replace(
            robot=run.robot,
            success=not run.missed,
            why_not="; ".join(run.missed),
            fault=FAULT_NAMES[outcome.fault],
            error_peak=outcome.error_peak,
            error_final=outcome.error_final,
            estimate_error=outcome.estimate_error,
        )
