# SPDX-License-Identifier: Apache-2.0
"""The benchmark of controller and plant runs a whole motion, and MuJoCo's periods."""

from __future__ import annotations

from step_speed import mujoco_us, step_speed


def test_a_whole_motion_is_measured() -> None:
    found = step_speed("multi_model_criterion", compiled=False)
    assert found.samples == 151 and min(found.controller, found.plant) > 0.0
    assert mujoco_us("dextar", 2e-3, 5) > 0.0
