# SPDX-License-Identifier: Apache-2.0
"""Random motions that the screen calls feasible, on a robot that differs from its model: all of them complete."""

from __future__ import annotations

import numpy as np
import pytest
from engine_agreement import expect_completed, outcome_of

from fivebar_bringup.scenario import Scenario
from fivebar_control.laws.registry import CONTROLLERS, default_tuning
from fivebar_control.planning.limits import motion_limits_of, speed_step_of
from fivebar_control.planning.pacing import Task
from fivebar_control.planning.postures import WORKING_MODES, place_at, rest_problem
from fivebar_control.planning.timing import Speed
from fivebar_control.planning.transfer import plan_transfer
from fivebar_description.robot_file import load_robot

pytestmark = pytest.mark.extra

RATE_HZ = 500
COUNTS = 100_000


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("controller", ["unified", "multi_cartesian"])
def test_a_transfer_between_assembly_modes_completes(controller: str, seed: int) -> None:
    robot, mode = load_robot("dextar"), WORKING_MODES[seed % 4]
    follower = default_tuning(CONTROLLERS[controller])
    limits = motion_limits_of(follower, torque=2.0, speed_step=speed_step_of(RATE_HZ, COUNTS))
    random = np.random.default_rng(seed)
    rests: list[tuple[float, float]] = []
    while len(rests) < 2:
        x, y = random.uniform((-0.13, -0.18), (0.13, 0.18)).tolist()
        wanted = -1 if rests else 1
        if rest_problem(robot, mode, x, y, limits) is None and place_at(robot, mode, x, y).assembly == wanted:
            rests.append((x, y))
    transfer = plan_transfer(
        Task(robot, mode, RATE_HZ, follower, limits), rests[0], rests[1], -1, list(Speed)[seed % 2]
    )
    mass, inertia, friction = random.uniform(0.85, 1.15, 3).tolist()
    plant = {
        "mass_scale": mass,
        "inertia_scale": inertia,
        "friction_scale": friction,
        "encoder_counts": COUNTS,
        "delay_samples": seed % 2,
        "torque_limit": 2.0,
    }
    scenario = Scenario.model_validate(
        {
            "name": "transfer",
            "controller": controller,
            "working_mode": mode,
            "waypoints": transfer.waypoints,
            "segment_duration": transfer.durations,
            "plant": plant,
        }
    )
    outcome = outcome_of(scenario)
    expect_completed(outcome, scenario, len(transfer.crossings))
    assert outcome.mode_changes >= 1
    assert outcome.error_peak < 0.05
    assert outcome.error_final < 0.002
