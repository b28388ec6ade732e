# SPDX-License-Identifier: Apache-2.0
"""Runs one crossing of the benchmark on the robots of rigs, with controllers of this project or from elsewhere."""

from __future__ import annotations

from fivebar_bringup.odds.odds import FINAL_LIMIT, PEAK_LIMIT
from fivebar_bringup.simulation.outcome import FAULT_NAMES
from fivebar_control.laws.registry import timed_controllers
from fivebar_control.laws.robot_sizes import size_ratio
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.robot_file import load_robot
from fivebar_description.strict_yaml import InputError
from fivebar_studies.benchmark.crossings import CROSSINGS, BenchmarkCrossing, crossing_of, robot_of_all
from fivebar_studies.benchmark.scoring import Result, SuccessLimits
from fivebar_studies.engine.study import StudySettings
from fivebar_studies.engine.turns import in_turns
from fivebar_studies.sweep.drawing import torque_limit_of
from fivebar_studies.sweep.planning import planned
from fivebar_studies.sweep.running import run_and_judge

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
        robot: that makes crossings of its own, by the name of its file; "" for that of the rigs.
    """

    rigs: tuple[str, ...] = ("ideal",)
    controllers: tuple[str, ...] = timed_controllers()
    cases: int = CROSSINGS
    robot: str = ""

    @property
    def make(self) -> str:
        """The robot whose crossings are made, by the name of its file."""
        return robot_of_all(self.rigs, self.robot)

    @property
    def limits(self) -> SuccessLimits:
        """The limits of a success; distances go with the size of a robot that is not that of the rigs."""
        size = size_ratio(load_robot(self.robot)) if self.robot else 1.0
        return SuccessLimits(size * PEAK_LIMIT, size * FINAL_LIMIT, torque_limit_of(self.make))


def run_numbered(settings: BenchmarkSettings, number: int) -> list[Result]:
    """Return the results of a crossing, rig after rig."""
    crossing = crossing_of(settings.make, number)
    return [
        result for rig in settings.rigs for result in results_on(rig, crossing, settings.controllers, settings.robot)
    ]


def results_on(rig: str, crossing: BenchmarkCrossing, controllers: tuple[str, ...], robot: str = "") -> list[Result]:
    """Return the results of a crossing on the robot that a rig has for it, one for each controller."""
    case, number = crossing.on(rig, robot), crossing.crossing
    try:
        plan = planned(case)
    except InputError:
        unknown = float("nan")
        return [Result(number, rig, controller, NOT_STARTED, 0, unknown, unknown, 0.0) for controller in controllers]

    def result_of(controller: str) -> Result:
        scenario = case.scenario(controller)
        outcome, _ = run_and_judge(scenario, plan)
        fault = FAULT_NAMES[outcome.fault]
        if outcome.fault == NO_FAULT and outcome.samples != plan.path.samples(scenario.rate_hz) + 1:
            fault = NOT_FINISHED
        torque = max(outcome.applied1, outcome.applied2)
        errors = outcome.error_peak, outcome.error_final
        return Result(number, rig, controller, fault, outcome.mode_changes, *errors, torque)

    return in_turns(result_of, controllers, number)
