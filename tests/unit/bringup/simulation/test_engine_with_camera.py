# SPDX-License-Identifier: Apache-2.0
"""The estimator with a camera: the compiled loop against the offline runner, and what the camera makes possible."""

from __future__ import annotations

from typing import Any

import pytest
from engine_agreement import changed, expect_agreement

from fivebar_bringup.runs.admission import refuse_unfit
from fivebar_bringup.scenario import Scenario
from fivebar_control.trajectory.planner import PlanRefused

CAMERA = {"on": True, "pictures": False, "latency": 0.03, "jitter": 0.02, "dropped": 0.1}


def with_camera(duration: float, **fields: Any) -> Scenario:
    plant = {"encoder_counts": 20_000, "delay_samples": 1}
    settings = {"estimator": "ekf", "controller": "unified", "segment_duration": duration, **fields}
    return changed("unified_middle", plant, **settings)


def test_late_and_lost_positions_are_taken_as_by_the_offline_runner() -> None:
    scenario = with_camera(0.2, camera=CAMERA, ekf={"camera": True, "seen_start": True})
    run, _ = expect_agreement(scenario)
    assert not run.faults


@pytest.mark.parametrize("duration", [6.0, pytest.param(12.0, marks=pytest.mark.extra)])
def test_slow_segments_are_refused_without_a_camera_alone(duration: float) -> None:
    with pytest.raises(PlanRefused, match="time near the Type 2 locus"):
        refuse_unfit(with_camera(duration))
    refuse_unfit(with_camera(duration, camera=CAMERA, ekf={"camera": True}))
