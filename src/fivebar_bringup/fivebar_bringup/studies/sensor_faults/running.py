"""Runs one random crossing of a rig's robot, soundly and with each fault of its sensors."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fivebar_bringup.odds.robot_errors import with_drawn_robot
from fivebar_bringup.odds.trials import FRESH_ROBOTS
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.engine import crossing
from fivebar_bringup.simulation.outcome import FAULT_NAMES
from fivebar_bringup.studies.engine.study import StudySettings
from fivebar_bringup.studies.rigs.named import find_rig
from fivebar_bringup.studies.sensor_faults.faults import drawn_faults
from fivebar_bringup.studies.sweep.drawing import PLANNED_FOR, RATE_HZ, Draw, draw
from fivebar_bringup.studies.sweep.planning import odds_seed, planned, sampled_case, timed
from fivebar_bringup.studies.sweep.running import verdict_on
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.strict_yaml import InputError

NOTICED_WITHIN = 0.05
"""Time (s) after it has left 5 mm within which a run has to have a fault."""

STREAM = 39
"""Random stream of the faults of a case, besides those of its motion and robot."""

REFUSED, SURVIVED, NOTICED, SILENT = "refused", "survived", "noticed", "silent"
"""Statuses of a run: the planner refuses the motion; it is made within 5 mm, in the planned mode; a fault stops it
in time; or neither."""


class SensorFaultSettings(StudySettings):
    """The settings that determine the results.

    Attributes:
        seed: of crossings, robots and faults.
        cases: random crossings, of which those that the planner, its screen and the odds refuse have no runs.
        rig: whose robots make them.
        controllers: that drive them, each the same robots with the same faults. Motions are planned for `PLANNED_FOR`.
        robots: of the rig that make each crossing soundly.
        faulty: of these that make it with each fault too.
    """

    seed: int = 1
    cases: int = 120
    rig: str = "good"
    controllers: tuple[str, ...] = (PLANNED_FOR,)
    robots: int = 72
    faulty: int = 6


class SensorFaultRow(NamedTuple):
    """A line of sensor_faults.csv: a run, or a crossing that is not feasible.

    Attributes:
        case: number of the crossing.
        controller: its name, "" where the crossing is not feasible.
        fault: injected, "" for a sound run.
        robot: number of the robot of the rig, 0 for the one that is drawn with the crossing.
        size: of the fault.
        time: when it begins (s).
        verdict: refused, survived, noticed, or silent.
        named: fault of the run, "" for none.
        left_time: when the platform left 5 mm (s), empty where it never did.
        fault_time: when the run was stopped (s), empty where it was not.
        error_peak: largest distance from the reference (m).
        misfit, offset, jump, error: largest of what the estimator's watch limits.
        use: largest share of such a limit.
    """

    case: int
    controller: str
    fault: str
    robot: int
    size: float
    time: float
    verdict: str
    named: str
    left_time: float | None
    fault_time: float | None
    error_peak: float
    misfit: float
    offset: float
    jump: float
    error: float
    use: float


def run_numbered(settings: SensorFaultSettings, number: int) -> list[SensorFaultRow]:
    """Return the rows of a crossing, of one controller after the other.

    Each robot makes it soundly, and the first ones with each fault too.
    """
    try:
        found = timed(draw(settings.seed, number, settings.rig))
        refused = bool(verdict_on(found, PLANNED_FOR)[1])
    except InputError:
        refused = True
    if refused:
        return [SensorFaultRow(number, "", "", 0, 0.0, 0.0, REFUSED, "", None, None, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)]
    return [row for controller in settings.controllers for row in _driven(settings, found.case, controller)]


def _driven(settings: SensorFaultSettings, case: Draw, controller: str) -> list[SensorFaultRow]:
    """Return the rows of a feasible crossing with a controller."""
    plan, own, errors = planned(case), case.scenario(controller), find_rig(settings.rig).errors
    rows, times = [], [one.time for one in plan.crossings]
    for robot in range(settings.robots):
        scenario = own
        if robot > 0:
            # a push meets one of the crossings
            met = times[robot % len(times)]
            scenario = with_drawn_robot(own, errors, odds_seed(case), FRESH_ROBOTS + robot, met)
        rows.append(_run(case, controller, scenario, "", robot, 0.0, 0.0))
        if robot < settings.faulty:
            random = np.random.default_rng((settings.seed, case.number, STREAM, robot))
            for one in drawn_faults(random, times[0], plan.path.duration):
                rows.append(_run(case, controller, one.on(scenario), one.fault, robot, one.size, one.at.time))
    return rows


def _run(
    case: Draw, controller: str, scenario: Scenario, fault: str, robot: int, size: float, time: float
) -> SensorFaultRow:
    run = case_of(scenario, stop_at_fault=True)
    outcome, limits = crossing(run, sampled_case(case)), run.numbers.estimation.model
    left = outcome.left_sample / RATE_HZ if outcome.left_sample >= 0 else None
    stopped = outcome.fault_sample / RATE_HZ if outcome.fault != NO_FAULT else None
    if stopped is not None:
        verdict = NOTICED if left is None or stopped <= left + NOTICED_WITHIN else SILENT
    else:
        right = left is None and outcome.mode_changes == len(planned(case).crossings)
        verdict = SURVIVED if right else SILENT
    return SensorFaultRow(
        case.number,
        controller,
        fault,
        robot,
        size,
        time,
        verdict,
        FAULT_NAMES[outcome.fault],
        left,
        stopped,
        outcome.error_peak,
        outcome.misfit,
        outcome.misfit_offset,
        outcome.misfit_jump,
        outcome.misfit_error,
        max(
            outcome.misfit / limits.misfit_limit,
            outcome.misfit_jump / limits.jump_limit,
            outcome.misfit_strain,
        ),
    )
