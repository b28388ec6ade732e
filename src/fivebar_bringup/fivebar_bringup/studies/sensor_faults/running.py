"""Runs one random crossing of a rig's robot, soundly and with each fault of its sensors."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.outcome import FAULT_NAMES
from fivebar_bringup.simulation.uncompiled import crossing
from fivebar_bringup.studies.engine.study import StudySettings
from fivebar_bringup.studies.sensor_faults.faults import drawn_faults
from fivebar_bringup.studies.sweep.drawing import PLANNED_FOR, RATE_HZ, Draw, draw
from fivebar_bringup.studies.sweep.screening import planned, sampled_case, screened
from fivebar_bringup.studies.sweep.timing import timed_for_loads
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.strict_yaml import InputError

NOTICED_WITHIN = 0.05
"""Time (s) after it has left 5 mm within which a run has to have a fault."""

STREAM = 39
"""Random stream of the faults of a case, besides those of its motion and robot."""

REFUSED, SURVIVED, NOTICED, SILENT = "refused", "survived", "noticed", "silent"
"""What becomes of a run: the motion is not feasible; it is made within 5 mm, in the planned mode; it is stopped by a
fault in time; or neither."""


class SensorFaultSettings(StudySettings):
    """The settings that determine the results.

    Attributes:
        seed: of crossings, robots and faults.
        cases: random crossings, of which those that the screen refuses have no runs.
        rig: whose robots make them.
    """

    seed: int = 1
    cases: int = 300
    rig: str = "good"


class SensorFaultRow(NamedTuple):
    """A line of sensor_faults.csv: a run, or a crossing that is not feasible.

    Attributes:
        case: number of the crossing.
        fault: injected, "" for a sound run.
        size: of the fault.
        time: when it begins (s).
        verdict: refused, survived, noticed, or silent.
        named: fault of the run, "" for none.
        left_time: when the platform left 5 mm (s), empty where it never did.
        fault_time: when the run was stopped (s), empty where it was not.
        error_peak: largest distance from the reference (m).
        misfit, offset, jump: largest of what the estimator's watch limits.
    """

    case: int
    fault: str
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


def run_numbered(settings: SensorFaultSettings, number: int) -> list[SensorFaultRow]:
    """Return the rows of a crossing."""
    try:
        case = timed_for_loads(draw(settings.seed, number, settings.rig))
        plan = planned(case)
        feasible = screened(case, PLANNED_FOR).feasible
    except InputError:
        feasible = False
    if not feasible:
        return [SensorFaultRow(number, "", 0.0, 0.0, REFUSED, "", None, None, 0.0, 0.0, 0.0, 0.0)]
    scenario = case.scenario(PLANNED_FOR)
    random = np.random.default_rng((settings.seed, number, STREAM))
    rows = [_run(case, scenario, "", 0.0, 0.0)]
    for one in drawn_faults(random, plan.crossings[0].time, plan.path.duration):
        rows.append(_run(case, one.on(scenario), one.fault, one.size, one.at.time))
    return rows


def _run(case: Draw, scenario: Scenario, fault: str, size: float, time: float) -> SensorFaultRow:
    outcome = crossing(case_of(scenario, stop_at_fault=True), sampled_case(case))
    left = outcome.left_sample / RATE_HZ if outcome.left_sample >= 0 else None
    stopped = outcome.fault_sample / RATE_HZ if outcome.fault != NO_FAULT else None
    if stopped is not None:
        verdict = NOTICED if left is None or stopped <= left + NOTICED_WITHIN else SILENT
    else:
        right = left is None and outcome.mode_changes == len(planned(case).crossings)
        verdict = SURVIVED if right else SILENT
    return SensorFaultRow(
        case.number,
        fault,
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
    )
