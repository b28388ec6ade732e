# SPDX-License-Identifier: Apache-2.0
"""The speed of the plain code: the control laws alone, and the whole closed loop without ROS."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.offline import Sample, simulate
from fivebar_control.laws.blend import blend
from fivebar_control.laws.reference import reference_from_platform
from fivebar_control.loop.law_runner import LawRunner
from fivebar_control.loop.supervisor import Supervisor
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.scenario.law_settings import tuned_controller


class PlainSpeed(NamedTuple):
    """Simulated seconds per second of the closed loop, and the time (us) that all laws together take per sample."""

    realtime_factor: float
    laws_us: float


def plain_speed(scenario: Scenario, repeats: int = 3) -> PlainSpeed:
    """Measure a scenario, best of some repeats; needs a controller with a constraint law."""
    best = float("inf")
    for _ in range(repeats):
        began = time.perf_counter()
        run = simulate(scenario)
        best = min(best, time.perf_counter() - began)
    simulated = (len(run.samples) - 1) / scenario.rate_hz
    answer = _all_laws(scenario)
    laws = float("inf")
    for _ in range(repeats):
        began = time.perf_counter()
        for sample in run.samples:
            answer(sample)
        laws = min(laws, time.perf_counter() - began)
    return PlainSpeed(simulated / best, laws / len(run.samples) * 1e6)


def _all_laws(scenario: Scenario) -> Callable[[Sample], object]:
    """Compute what all nodes of the graph together compute for a sample."""
    robot, plan, tuned = scenario.five_bar(), scenario.plan(), tuned_controller(scenario)
    supervise = Supervisor(plan, scenario.rate_hz, tuned.controller.weighting)
    nominal, constraint = (LawRunner(law, robot, plan, scenario.rate_hz) for law in tuned.laws)

    def answer(sample: Sample) -> object:
        state = state_from_joints(robot, *sample.measured.position, *sample.measured.velocity)
        desired = plan.path.at(sample.number / scenario.rate_hz)
        reference = reference_from_platform(robot, plan.mode, desired)
        sigma = supervise(sample.number, state).sigma
        return blend(sigma, nominal(sample.number, state, reference), constraint(sample.number, state, reference))

    return answer
