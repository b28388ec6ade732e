# SPDX-License-Identifier: Apache-2.0
"""Runs a crossing of a robot with an effect, and judges it.

The crossing is the middle one, of robots that are otherwise exact, or a random one of the robots of a rig.
"""

from __future__ import annotations

from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np

from fivebar_bringup.odds.robot_errors import with_drawn_robot
from fivebar_bringup.odds.trials import FRESH_ROBOTS
from fivebar_bringup.simulation.case import Case, case_of
from fivebar_bringup.simulation.engine import crossing
from fivebar_bringup.simulation.run_metrics import RunMetrics
from fivebar_control.laws.robot_sizes import size_ratio
from fivebar_control.loop.closed_loop import FAULT_NAMES
from fivebar_control.loop.sampled_plan import Sampled
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.robot_file import load_robot
from fivebar_description.strict_yaml import InputError
from fivebar_studies.engine.study import StudySettings
from fivebar_studies.rigs.named import find_rig
from fivebar_studies.robustness.effects import BURST, DRAWS, EFFECTS, condition_of, with_keys
from fivebar_studies.robustness.equipment import equipment_named, equipment_of, prepared
from fivebar_studies.robustness.sensor_effects import ALL_EFFECTS, drawn_faults
from fivebar_studies.sweep.drawing import PLANNED_FOR, RATE_HZ, ROBOT, Draw, draw
from fivebar_studies.sweep.planning import odds_seed, planned, sampled_case, timed
from fivebar_studies.sweep.rows import lost_silently
from fivebar_studies.sweep.running import verdict_on

LIMIT = 2e-3
"""The middle crossing of DexTAR fails where it leaves its reference by this distance (m)."""

DURATIONS = (0.5, 1.0, 2.0)
"""s."""

WRONG_MODE, FAR, IMPOSSIBLE = "wrong assembly mode", "off the reference", "impossible robot"
"""Failures besides the faults' names."""

STREAM = 39
"""Random stream of the faults of a random crossing, besides those of its motion and robot."""

REFUSED, SURVIVED, NOTICED, SILENT = "refused", "survived", "noticed", "silent"
"""Verdicts on a random crossing: the planner refuses it; it is made within 5 mm, in the planned mode; a fault stops it
in time; or neither."""


class RobustnessSettings(StudySettings):
    """The settings that determine the results of the study.

    Attributes:
        controllers: each from encoders alone and with a gyroscope, `unified` also as for elastic transmissions; with a
            rig on robots of that rig. Empty: the usual ones.
        effects: names of what grows, each alone.
        draws: of signs, directions and noise, of each size.
        durations: of the middle crossing (s).
        robot: that makes it, by the name of its file.
        rig: in place of the middle crossing, random ones of robots of this rig, whose sensors have random faults.
        cases: random crossings, of which those that the planner, its screen and the odds refuse have no runs.
        seed: of crossings, robots and faults.
        robots: of the rig that make each crossing soundly.
        faulty: of these that make it with each fault too.
    """

    controllers: tuple[str, ...] = ()
    effects: tuple[str, ...] = tuple(EFFECTS)
    draws: int = DRAWS
    durations: tuple[float, ...] = DURATIONS
    robot: str = ROBOT
    rig: str = ""
    cases: int = 120
    seed: int = 1
    robots: int = 72
    faulty: int = 6

    @property
    def compared(self) -> tuple[str, ...]:
        """The controllers. Random crossings are planned for `PLANNED_FOR`."""
        usual = (PLANNED_FOR,) if self.rig else ("unified", "multi_cartesian", "multi_joint")
        return self.controllers or usual


class RobustnessRow(NamedTuple):
    """A line of robustness.csv: what became of a run, or a random crossing that is not feasible.

    Attributes:
        case: number of the run, or of the random crossing.
        effect: what the robot has, "" for a sound one.
        size: of the effect, in its unit; of a random fault in SI units.
        equipment: controller, sensors and settings, on a random crossing the controller.
        duration: of the crossing (s).
        draw: number of signs, directions and noise, or of the moment; on a random crossing that of the robot, 0 for the
            one that is drawn with it.
        cause: why it failed, "" for a success.
        time: when a random fault begins (s).
        left_time: when the platform left 5 mm (s), empty where it never did.
        fault_time: when the run was stopped (s), empty where it was not.
        error: largest distance from the reference (m).
        misfit, offset, jump, estimate: largest of what the estimator's watch limits.
        use: largest share of such a limit.
    """

    case: int
    effect: str
    size: float
    equipment: str
    duration: float
    draw: int
    cause: str = ""
    time: float | None = None
    left_time: float | None = None
    fault_time: float | None = None
    error: float = 0.0
    misfit: float = 0.0
    offset: float = 0.0
    jump: float = 0.0
    estimate: float = 0.0
    use: float = 0.0

    @property
    def named(self) -> str:
        """The fault of the run, "" for none."""
        return "" if self.cause in (WRONG_MODE, FAR, IMPOSSIBLE, REFUSED) else self.cause

    @property
    def verdict(self) -> str:
        """Whether a random crossing survived, was stopped in time, was lost silently or was refused."""
        if lost_silently(self.left_time, self.fault_time, self.cause != WRONG_MODE):
            return SILENT
        return NOTICED if self.fault_time is not None else self.cause or SURVIVED


def run_numbered(settings: RobustnessSettings, number: int) -> list[RobustnessRow]:
    """Return the rows of a case: of a run of the middle crossing, or of all runs of a random one."""
    return random_crossing(settings, number) if settings.rig else [middle_crossing(runs_of(settings)[number], settings)]


@lru_cache(maxsize=4)
def runs_of(settings: RobustnessSettings) -> tuple[RobustnessRow, ...]:
    """Return the runs of the middle crossing, whose outcomes are not known, first those without an effect."""
    equipment = equipment_of(settings.compared)
    sizes = [("", 0.0, equipped.name) for equipped in equipment]
    sizes += [
        (name, size, equipped.name)
        for name in settings.effects
        for equipped in equipment
        if equipped.gyro or not ALL_EFFECTS[name].needs_gyro
        for size in ALL_EFFECTS[name].sizes
    ]
    runs = [
        (effect, size, name, duration, draw)
        for effect, size, name in sizes
        for duration in settings.durations
        for draw in (ALL_EFFECTS[effect].draws(settings.draws, duration) if effect else range(settings.draws))
    ]
    return tuple(RobustnessRow(number, *run) for number, run in enumerate(runs))


def middle_crossing(run: RobustnessRow, settings: RobustnessSettings) -> RobustnessRow:
    """Run the middle crossing of an equipment on a robot with an effect."""
    scenario, samples = prepared(run.equipment, run.duration, settings.robot)
    crossings = scenario.plan().crossings
    first = crossings[0].time
    effect = ALL_EFFECTS[run.effect] if run.effect else None
    noise = 0 if effect is not None and effect.every else run.draw
    # the offset of a gyroscope is never zero
    bias = condition_of(noise, first).sign * find_rig("good").errors.gyro_bias
    sound = with_keys(scenario, {"seed": noise, "imu": {"gyro_bias": bias}})
    keys = {} if effect is None else effect.keys(run.size, run.draw, first)
    if not equipment_named(run.equipment).gyro:
        keys = {name: value for name, value in keys.items() if name != "tolerances"}
    try:
        case = case_of(with_keys(sound, keys), stop_at_fault=True)
    except InputError:
        return run._replace(cause=IMPOSSIBLE)
    for name in BURST:
        begin, count = keys.get(name, (0, 0))
        getattr(case.numbers, name)[begin : begin + count] = True
    return judged(run, case, samples, len(crossings), limit_of(settings.robot))


def random_crossing(settings: RobustnessSettings, number: int) -> list[RobustnessRow]:
    """Return the rows of a random crossing, of one controller after the other.

    Each robot makes it soundly, and the first ones with each fault too.
    """
    try:
        timed_case = timed(draw(settings.seed, number, settings.rig))
        refused = bool(verdict_on(timed_case, PLANNED_FOR)[1])
    except InputError:
        refused = True
    if refused:
        return [RobustnessRow(number, "", 0.0, "", 0.0, 0, REFUSED)]
    return [row for controller in settings.compared for row in _random_runs(settings, timed_case.motion, controller)]


def _random_runs(settings: RobustnessSettings, case: Draw, controller: str) -> list[RobustnessRow]:
    """Return the rows of a feasible crossing with a controller."""
    plan, samples = planned(case), sampled_case(case)
    own, errors = case.scenario(controller), find_rig(settings.rig).errors
    rows, times = [], [passage.time for passage in plan.crossings]
    for robot in range(settings.robots):
        scenario = own
        if robot > 0:
            # a push meets one of the crossings
            met = times[robot % len(times)]
            scenario = with_drawn_robot(own, errors, odds_seed(case), FRESH_ROBOTS + robot, met)
        sound = RobustnessRow(case.number, "", 0.0, controller, plan.path.duration, robot)
        rows.append(judged(sound, case_of(scenario, stop_at_fault=True), samples, len(times)))
        if robot < settings.faulty:
            random = np.random.default_rng((settings.seed, case.number, STREAM, robot))
            for drawn in drawn_faults(random, times[0], plan.path.duration):
                run = sound._replace(effect=drawn.fault, size=drawn.size, time=drawn.at.time)
                faulty = case_of(with_keys(scenario, drawn.keys), stop_at_fault=True)
                rows.append(judged(run, faulty, samples, len(times)))
    return rows


def judged(
    run: RobustnessRow, case: Case, samples: Sampled, crossings: int, limit: float | None = None
) -> RobustnessRow:
    """Return the row of a run with what becomes of it.

    Args:
        run: row whose outcome is not known.
        case: robot, effect and controller.
        samples: the sampled plan.
        crossings: planned number of changes of the assembly mode.
        limit: distance from the reference (m) at which it fails; None: beyond 5 mm.
    """
    outcome, limits = crossing(case, samples), case.numbers.estimation.model
    shares = (outcome.misfit / limits.misfit_limit, outcome.misfit_jump / limits.jump_limit, outcome.misfit_strain)
    return run._replace(
        cause=cause_of(outcome, crossings, limit) or "",
        left_time=outcome.left_sample / RATE_HZ if outcome.left_sample >= 0 else None,
        fault_time=outcome.fault_sample / RATE_HZ if outcome.fault != NO_FAULT else None,
        error=outcome.error_peak,
        misfit=outcome.misfit,
        offset=outcome.misfit_offset,
        jump=outcome.misfit_jump,
        estimate=outcome.misfit_error,
        use=max(shares),
    )


def cause_of(outcome: RunMetrics, crossings: int, limit: float | None = LIMIT) -> str | None:
    """Return why a run fails, None if it does not.

    Args:
        outcome: of the run.
        crossings: planned number of changes of the assembly mode.
        limit: distance from the reference (m) at which it fails; None: beyond 5 mm.
    """
    if outcome.fault != NO_FAULT:
        return FAULT_NAMES[outcome.fault]
    if outcome.mode_changes != crossings:
        return WRONG_MODE
    # a NaN is a failure
    near = outcome.left_sample < 0 if limit is None else outcome.error_peak < limit
    return None if near else FAR


@cache
def limit_of(robot: str) -> float:
    """Return the distance from the reference (m) at which a run fails: in proportion to the size of the robot."""
    return LIMIT * size_ratio(load_robot(robot))


def failure_rule(robot: str) -> str:
    """Return the definition of a failure in words."""
    return (
        f"a fault, another assembly mode than planned, or {1e3 * limit_of(robot):.3g} mm and more from the reference at"
        " any time"
    )
