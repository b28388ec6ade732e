# SPDX-License-Identifier: Apache-2.0
"""The tube: the response without a mismatch is that of the run, and runs on other robots stay within."""

from __future__ import annotations

import numpy as np
import pytest

from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.engine import traced_crossing
from fivebar_control.laws.gains import UnifiedSettings
from fivebar_control.laws.mpc import MpcSettings
from fivebar_control.laws.registry import CONTROLLERS, default_tuning
from fivebar_control.loop.sampled_plan import sampled
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.planning.predicted_run import predict_run
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_control.trajectory.planner import plan_motion
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.parameters import FiveBar
from fivebar_studies.benchmark.crossings import benchmark
from tube import Mismatch, tube

RATE_HZ = 500
OBLIQUE = ((0.0, 0.15), (0.04, 0.03))


@pytest.mark.parametrize(
    ("name", "settings", "least"),
    [("unified", UnifiedSettings(), 5e-5), pytest.param("mpc", MpcSettings(), 0.0, marks=pytest.mark.extra)],
)
def test_the_response_is_that_of_the_run_and_within_the_tube(
    dextar: FiveBar, name: str, settings: UnifiedSettings | MpcSettings, least: float
) -> None:
    plan = plan_motion(dextar, (1, -1), OBLIQUE, [0.5], RATE_HZ, ZoneRule())
    found = tube(dextar, plan, RATE_HZ, settings, Mismatch())
    run = predict_run(dextar, plan, RATE_HZ, default_tuning(CONTROLLERS[name]), 10.0)
    errors = np.array(
        [
            np.hypot(moment.x - place.x, moment.y - place.y)
            for number, moment in enumerate(run.moments[: len(found.radius)])
            for place in (plan.path.at(number / RATE_HZ),)
        ]
    )
    assert np.max(errors) > least
    assert np.max(errors) == pytest.approx(np.max(found.nominal), rel=0.03, abs=3e-6)
    assert np.all(errors < found.radius)


@pytest.mark.extra
def test_robots_off_the_model_stay_within_the_tube_of_the_mismatch() -> None:
    for crossing, (mass, inertia, friction) in zip(
        benchmark()[:3], ((0.9, 1.1, 1.2), (1.1, 0.9, 0.8), (1.1, 1.1, 1.2)), strict=False
    ):
        case = crossing.on("ideal")._replace(mass_scale=mass, inertia_scale=inertia, friction_scale=friction)
        scenario = case.scenario("unified")
        robot, plan = scenario.five_bar(), scenario.plan()
        settings = tuned_controller(scenario).nominal.settings
        assert isinstance(settings, UnifiedSettings)
        samples = sampled(robot, plan, RATE_HZ)
        _, trace = traced_crossing(case_of(scenario), samples)
        states = [state_from_joints(scenario.actual_robot(), *joints) for joints in trace[:, :8].tolist()]
        errors = np.hypot(*(np.array([(state.x, state.y) for state in states]) - samples.rows[: len(trace), :2]).T)
        believed, wide = (tube(robot, plan, RATE_HZ, settings, one) for one in (Mismatch(), Mismatch(0.1, 0.2)))
        count = min(len(errors), len(wide.radius))
        assert np.all(errors[:count] < wide.radius[:count])
        # the mismatch is what takes them that far
        assert np.any(errors[:count] > believed.radius[:count])
