"""Runs one crossing of the benchmark on the robots of rigs, with controllers of this project or from elsewhere."""

from __future__ import annotations

from fivebar_bringup.simulation.case import case_of, sampled
from fivebar_bringup.simulation.outcome import FAULT_NAMES
from fivebar_bringup.simulation.uncompiled import crossing as run_crossing
from fivebar_bringup.studies.benchmark.crossings import CROSSINGS, BenchmarkCrossing, benchmark
from fivebar_bringup.studies.benchmark.scoring import Result
from fivebar_bringup.studies.engine.study import StudySettings
from fivebar_bringup.studies.sweep.screening import planned
from fivebar_control.laws.registry import TIMED_CONTROLLERS
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.strict_yaml import InputError

NOT_STARTED = "not_started"
"""In place of a fault: the estimator could not tell the assembly mode at the start."""

NOT_FINISHED = "not_finished"
"""The run ended early, as where the plant's equations have no solution."""


class BenchmarkSettings(StudySettings):
    """The settings that determine the results of a benchmark.

    Attributes:
        rigs: whose robots make the crossings.
        controllers: by what.
        cases: the first so many crossings.
    """

    rigs: tuple[str, ...] = ("ideal",)
    controllers: tuple[str, ...] = TIMED_CONTROLLERS
    cases: int = CROSSINGS


def run_numbered(settings: BenchmarkSettings, number: int) -> list[Result]:
    """Return the results of a crossing, rig after rig."""
    crossing = benchmark()[number]
    return [result for rig in settings.rigs for result in results_on(rig, crossing, settings.controllers)]


def results_on(rig: str, crossing: BenchmarkCrossing, controllers: tuple[str, ...]) -> list[Result]:
    """Return the results of a crossing on the robot that a rig has for it, one for each controller."""
    case, number = crossing.on(rig), crossing.crossing
    try:
        plan = planned(case)
    except InputError:
        unknown = float("nan")
        return [Result(number, rig, controller, NOT_STARTED, 0, unknown, unknown, 0.0) for controller in controllers]
    results = []
    for controller in controllers:
        scenario = case.scenario(controller)
        samples = sampled(scenario.five_bar(), plan, scenario.rate_hz, scenario.lead_samples)
        outcome = run_crossing(case_of(scenario), samples)
        fault = FAULT_NAMES[outcome.fault]
        if outcome.fault == NO_FAULT and outcome.samples != plan.path.samples(scenario.rate_hz) + 1:
            fault = NOT_FINISHED
        torque = max(outcome.applied1, outcome.applied2)
        errors = outcome.error_peak, outcome.error_final
        results.append(Result(number, rig, controller, fault, outcome.mode_changes, *errors, torque))
    return results
