# SPDX-License-Identifier: Apache-2.0
"""The environment of gymnasium against the compiled closed loop on the same crossings, in turns on one core."""

from __future__ import annotations

import math
from time import perf_counter
from typing import NamedTuple

import gymnasium

from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.engine import crossing
from fivebar_control.loop.sampled_plan import sampled
from fivebar_studies.benchmark.crossings import benchmark
from fivebar_studies.sweep.drawing import plan_of

ENVIRONMENTS, STEPS, ROUNDS = 64, 200, 12
"""Environments side by side, which draw from as many crossings, their steps in a turn, and turns; the best counts."""


class EnvironmentSpeed(NamedTuple):
    """Samples per second on one core.

    Attributes:
        steps: of all environments together, with random torques and beginnings of episodes.
        loop: of the compiled closed loop with `unified` and all joints measured, with its metrics.
    """

    steps: float
    loop: float


def environment_speed(rig: str, rounds: int = ROUNDS) -> EnvironmentSpeed:
    """Measure the environment, and the closed loop, on robots of a rig."""
    name = "fivebar_gym:fivebar/Crossing-v0"
    envs = gymnasium.make_vec(name, num_envs=ENVIRONMENTS, crossings=ENVIRONMENTS, rig=rig)
    # all crossings are drawn before it is measured
    envs.reset(seed=1, options={"crossing": range(ENVIRONMENTS)})
    envs.action_space.seed(1)
    case = benchmark()[0].on(rig)
    scenario = case.scenario("unified").model_copy(update={"estimator": "none"})
    looped = case_of(scenario), sampled(scenario.five_bar(), plan_of(case), scenario.rate_hz)
    samples = crossing(*looped).samples
    steps_s = loop_s = math.inf
    for _ in range(rounds):
        torques = [envs.action_space.sample() for _ in range(STEPS)]
        began = perf_counter()
        for torque in torques:
            envs.step(torque)
        between = perf_counter()
        crossing(*looped)
        steps_s, loop_s = min(steps_s, between - began), min(loop_s, perf_counter() - between)
    return EnvironmentSpeed(ENVIRONMENTS * STEPS / steps_s, samples / loop_s)
