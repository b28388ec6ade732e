# SPDX-License-Identifier: Apache-2.0
"""Runs one crossing of the benchmark on the robots of rigs, with controllers of this project or from elsewhere."""

from __future__ import annotations

from fivebar_bringup.odds.odds import FINAL_LIMIT, PEAK_LIMIT
from fivebar_bringup.simulation.case import Case
from fivebar_bringup.simulation.observation import Observation
from fivebar_bringup.simulation.run_metrics import RunMetrics
from fivebar_bringup.simulation.stepped_run import OUTSIDE, outside_case
from fivebar_control.laws.registry import timed_controllers
from fivebar_control.laws.robot_sizes import size_ratio
from fivebar_control.loop.closed_loop import FAULT_NAMES
from fivebar_control.loop.sampled_plan import Sampled, sampled
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.robot_file import load_robot
from fivebar_description.strict_yaml import InputError
from fivebar_studies.benchmark.crossings import CROSSINGS, BenchmarkCrossing, crossing_of, robot_of_all
from fivebar_studies.benchmark.policies import PolicyFailed, check_policy, run_policy
from fivebar_studies.benchmark.scoring import Result, SuccessLimits
from fivebar_studies.engine.study import StudySettings
from fivebar_studies.engine.turns import in_turns
from fivebar_studies.sweep.drawing import RATE_HZ, Draw, plan_of, torque_limit_of
from fivebar_studies.sweep.planning import planned
from fivebar_studies.sweep.running import run_and_judge

NOT_STARTED = "not_started"
"""In place of a fault: the estimator could not tell the assembly mode at the start."""

NOT_FINISHED = "not_finished"
"""The run ended early, as where the plant's equations have no solution."""

POLICY_FAILED = "policy_failed"
"""The policy raised an exception after it had answered the first sample, or did not return two numbers."""


class BenchmarkSettings(StudySettings):
    """The settings that determine the results of a benchmark.

    Attributes:
        rigs: whose robots make the crossings.
        controllers: by what.
        cases: the first so many crossings.
        robot: that makes crossings of its own, by the name of its file; "" for that of the rigs.
        policy: in place of a law, by its place MODULE:NAME; "" for none.
        observation: that the policy gets.
    """

    rigs: tuple[str, ...] = ("ideal",)
    controllers: tuple[str, ...] = timed_controllers()
    cases: int = CROSSINGS
    robot: str = ""
    policy: str = ""
    observation: Observation = Observation.ALL

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
    return [result for rig in settings.rigs for result in _results_on(rig, crossing, settings)]


def _results_on(rig: str, crossing: BenchmarkCrossing, settings: BenchmarkSettings) -> list[Result]:
    """Return the results of a crossing on the robot that a rig has for it: of each controller, and of the policy."""
    case, number = crossing.on(rig, settings.robot), crossing.crossing
    names = settings.controllers + ((settings.policy,) if settings.policy else ())

    def failed(name: str, fault: str) -> Result:
        unknown = float("nan")
        return Result(number, rig, name, fault, 0, unknown, unknown, 0.0)

    try:
        plan = planned(case)
    except InputError:
        return [failed(name, NOT_STARTED) for name in names]

    def result_of(name: str) -> Result:
        try:
            if name == settings.policy:
                outcome = run_policy(name, *outside(case), settings.observation)
            else:
                outcome, _ = run_and_judge(case.scenario(name), plan)
        except PolicyFailed:
            return failed(name, POLICY_FAILED)
        return result_from(outcome, crossing, rig, name, plan.path.samples(RATE_HZ) + 1)

    return in_turns(result_of, names, number)


def result_from(outcome: RunMetrics, crossing: BenchmarkCrossing, rig: str, name: str, samples: int) -> Result:
    """Return the result of a crossing on a rig by a controller or policy, of a motion of so many samples."""
    fault = FAULT_NAMES[outcome.fault]
    if outcome.fault == NO_FAULT and outcome.samples != samples:
        fault = NOT_FINISHED
    torque = max(outcome.applied1, outcome.applied2)
    errors = outcome.error_peak, outcome.error_final
    return Result(crossing.crossing, rig, name, fault, outcome.mode_changes, *errors, torque)


def outside(case: Draw) -> tuple[Case, Sampled]:
    """Return a case whose torques come from outside, with its sampled plan."""
    scenario = case.scenario(OUTSIDE)
    return outside_case(scenario), sampled(scenario.five_bar(), plan_of(case), RATE_HZ)


def check_policy_of(settings: BenchmarkSettings) -> None:
    """Check that the policy of settings, if there is one, answers the first sample of the first crossing.

    Raises:
        InputError: it does not.
    """
    if settings.policy:
        case = crossing_of(settings.make, 0).on(settings.rigs[0], settings.robot)
        try:
            check_policy(settings.policy, *outside(case), settings.observation)
        except InputError as error:
            raise InputError(f"--policy: {error}") from error
