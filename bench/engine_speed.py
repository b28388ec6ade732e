# SPDX-License-Identifier: Apache-2.0
"""The compiled closed loop against MuJoCo's step alone, in turns on one core."""

from __future__ import annotations

import math
import time
from typing import NamedTuple

import numpy as np

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.case import Case, case_of
from fivebar_bringup.simulation.engine import crossing, traced_crossing
from fivebar_control.loop.sampled_plan import Sampled, sampled
from fivebar_control.model.kinematics import state_from_platform
from fivebar_description.closed_loop import ClosedLoop
from mujoco_speed import STEP, MujocoFiveBar, loop_gap

MUJOCO_STEPS = 100
"""About as long as one of our crossings, so that a busy machine disturbs both alike."""

MUJOCO_GAP_STEPS = 2000

ROUNDS = 100
"""Turns of both; the best of each counts."""

FREE_START = (0.0, 0.13, 0.0, -0.3)
"""MuJoCo's motion: from there (m, m/s), free, down through the Type 2 locus."""


class EngineSpeed(NamedTuple):
    """Simulated seconds per second on one core and largest gap (m) between the tips: ours, and MuJoCo's step alone.

    Attributes:
        engine: of the whole closed loop: plant with friction, control laws, guard, the run's table and its figures.
        engine_gap: at its samples.
        estimated: `engine` for a scenario with encoders and estimator.
        mujoco: of the step alone, without controller and friction.
        mujoco_gap: after its steps.
        compile_s: what the first call took (s), from the cache on disk where it is there.
    """

    engine: float
    engine_gap: float
    estimated: float
    mujoco: float
    mujoco_gap: float
    compile_s: float

    @property
    def ratio(self) -> float:
        """How many times faster the closed loop is than MuJoCo's step."""
        return self.engine / self.mujoco


def engine_speed(scenario: Scenario, estimated: str = "middle_encoders") -> EngineSpeed:
    """Measure a scenario, another one with an estimator, and MuJoCo, in turns.

    Raises:
        ValueError: the scenario's integration steps are shorter than MuJoCo's, which would be no comparison.
    """
    robot = scenario.five_bar()
    plain, realistic = _prepared(scenario), _prepared(load_scenario(estimated))
    if abs(plain[0].numbers.step - STEP) > 1e-12:
        raise ValueError(f"{scenario.name} is integrated in steps of {plain[0].numbers.step} s, MuJoCo in {STEP} s")
    mode = scenario.working_mode
    other = MujocoFiveBar(robot, state_from_platform(robot, mode, *FREE_START))
    began = time.perf_counter()
    crossing(*plain)
    compile_s = time.perf_counter() - began
    crossing_s = estimated_s = mujoco_s = math.inf
    for _ in range(ROUNDS):
        mujoco_s = min(mujoco_s, other.seconds(MUJOCO_STEPS))
        crossing_s = min(crossing_s, _seconds(*plain))
        estimated_s = min(estimated_s, _seconds(*realistic))
    return EngineSpeed(
        engine=_simulated(*plain) / crossing_s,
        engine_gap=_gap(*plain),
        estimated=_simulated(*realistic) / estimated_s,
        mujoco=MUJOCO_STEPS * STEP / mujoco_s,
        mujoco_gap=loop_gap(other, MUJOCO_GAP_STEPS),
        compile_s=compile_s,
    )


def _prepared(scenario: Scenario) -> tuple[Case, Sampled]:
    plan = sampled(scenario.five_bar(), scenario.plan(), scenario.rate_hz, scenario.lead_samples)
    return case_of(scenario), plan


def _seconds(case: Case, plan: Sampled) -> float:
    began = time.perf_counter()
    crossing(case, plan)
    return time.perf_counter() - began


def _simulated(case: Case, plan: Sampled) -> float:
    return (crossing(case, plan).samples - 1) / case.numbers.rate_hz


def _gap(case: Case, plan: Sampled) -> float:
    """Return the largest gap between the tips at the samples of a run, by Pinocchio."""
    _, trace = traced_crossing(case, plan)
    loop = ClosedLoop(case.numbers.actual)
    return max(math.hypot(*loop.tip_gap(np.ascontiguousarray(row[:4])).gap) for row in trace)
