"""Plans a motion of a robot as its file declares it, and runs it on drawn robots and on variants of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache

from fivebar_bringup.motions.likely import plan_likely
from fivebar_bringup.odds.robot_errors import RobotErrors
from fivebar_bringup.odds.trials import FRESH_ROBOTS, tries_of
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.outcome import FAULT_NAMES
from fivebar_bringup.studies.assess.rows import ACCEPTED, OUT_OF_REACH, RANDOM, REFUSED, UNLIKELY, AssessRow
from fivebar_bringup.studies.assess.typical import Typical, request_for, typical_motions
from fivebar_bringup.studies.engine.study import StudySettings
from fivebar_bringup.studies.rigs.declared import (
    DECLARED,
    REACHABLE,
    REMOVED,
    SENSORS,
    TUNINGS,
    VARIANT,
)
from fivebar_bringup.studies.rigs.named import find_rig
from fivebar_bringup.studies.rigs.rig import OF_ROBOT, Rig
from fivebar_bringup.studies.sweep.drawing import PLANNED_FOR, Draw, draw, on_robot
from fivebar_bringup.studies.sweep.planning import TimedCase, odds_seed, planned, screened, timed, timed_for_loads
from fivebar_bringup.studies.sweep.running import verdict_on
from fivebar_control.compiling import expect_many_motions
from fivebar_control.trajectory.planner import Plan
from fivebar_description.errors import InputError

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


def is_complete(settings: AssessSettings, rows: Sequence[AssessRow]) -> bool:
    """Return whether these are all rows of a motion."""
    if rows[0].robot is None:
        return True
    controllers = len(settings.controllers)
    if rows[0].motion != RANDOM:
        return len(rows) == controllers * TYPICAL_ROBOTS
    return len(rows) == (controllers + len(variants_of(settings.robot))) * settings.robots


@lru_cache(maxsize=4)
def variants_of(robot: str) -> list[str]:
    """Return the variants of a robot that differ from it as it is declared."""
    declared = _plain(find_rig(f"{OF_ROBOT}{robot}"))
    names = (*REMOVED, *SENSORS, *TUNINGS)
    return [name for name in names if _plain(find_rig(f"{OF_ROBOT}{robot}{VARIANT}{name}")) != declared]


def _plain(rig: Rig) -> Rig:
    return rig.model_copy(update={"words": ""})


def _random(settings: AssessSettings, number: int) -> list[AssessRow]:
    name = f"{OF_ROBOT}{settings.robot}"
    case = draw(settings.seed, number, name)
    try:
        found = timed(case)
        _, reasons = verdict_on(found, PLANNED_FOR)
    except InputError as refusal:
        return [AssessRow(number, RANDOM, REFUSED, str(refusal), mode1=case.mode1, mode2=case.mode2)]
    status = UNLIKELY if reasons else ACCEPTED
    if reasons and not (found.odds is not None and found.odds.robots):
        # not even tried: as it is timed for a robot that is known better
        better = _within_reach(found.case)
        if better is None:
            return [AssessRow(number, RANDOM, OUT_OF_REACH, "; ".join(reasons), mode1=case.mode1, mode2=case.mode2)]
        found = TimedCase(better)
    common = _common(number, RANDOM, status, "; ".join(reasons), planned(found.case))
    rows: list[AssessRow] = []
    for variant in (DECLARED, *variants_of(settings.robot)):
        rig = f"{name}{VARIANT}{variant}" if variant else name
        on = on_robot(found.case, rig)
        for controller in settings.controllers if variant == DECLARED else settings.controllers[:1]:
            start = common._replace(variant=variant, controller=controller)
            rows += _runs(start, on.scenario(controller), find_rig(rig).errors, odds_seed(case), settings.robots)
    return rows


def _within_reach(case: Draw) -> Draw | None:
    """Return a case as it is timed for the robot exactly known and with a gyroscope, None where that is infeasible."""
    better = on_robot(case, f"{case.rig}{VARIANT}{REACHABLE}")
    try:
        found = timed_for_loads(better)
        planned(found)
    except InputError:
        return None
    if not screened(found, PLANNED_FOR, judge_loads=False).feasible:
        return None
    return on_robot(found, case.rig)


def _typical(settings: AssessSettings, number: int, motion: Typical) -> list[AssessRow]:
    rig = find_rig(f"{OF_ROBOT}{settings.robot}")
    try:
        found = plan_likely(request_for(motion, settings.robot, PLANNED_FOR)).scenario
    except InputError as refusal:
        return [AssessRow(number, motion.name, REFUSED, str(refusal))]
    common = _common(number, motion.name, ACCEPTED, "", found.plan())
    rows: list[AssessRow] = []
    for controller in settings.controllers:
        content = found.model_dump() | {"controller": controller}
        scenario = type(found).model_validate(rig.content(type(found).model_validate(content), controller, {}))
        rows += _runs(common._replace(controller=controller), scenario, rig.errors, settings.seed, TYPICAL_ROBOTS)
    return rows


def _common(number: int, motion: str, status: str, reason: str, plan: Plan) -> AssessRow:
    first = plan.crossings[0] if plan.crossings else None
    return AssessRow(
        number,
        motion,
        status,
        reason,
        mode1=plan.mode1,
        mode2=plan.mode2,
        crossing_x=None if first is None else first.x,
        crossing_y=None if first is None else first.y,
        distal_links="" if first is None else first.distal_links,
        duration=plan.path.duration,
    )


def _runs(common: AssessRow, scenario: Scenario, errors: RobotErrors, seed: int, robots: int) -> Iterator[AssessRow]:
    """Yield the rows of a motion's runs on drawn robots."""
    for one in tries_of(scenario, errors, seed, range(FRESH_ROBOTS, FRESH_ROBOTS + robots)):
        outcome = one.outcome
        yield common._replace(
            robot=one.robot,
            success=not one.missed,
            why_not="; ".join(one.missed),
            fault=FAULT_NAMES[outcome.fault],
            error_peak=outcome.error_peak,
            error_final=outcome.error_final,
            estimate_error=outcome.estimate_error,
        )
