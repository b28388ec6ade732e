# SPDX-License-Identifier: Apache-2.0
"""A start that nobody declares: seen in a rendered picture, planned from there, and run."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
import yaml

from fivebar_bringup.motions.start import start_seen
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.offline import simulate
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.scenario.sensors import homing_of
from fivebar_control.scenario.start import initial_joints
from fivebar_description.camera import CameraSettings
from fivebar_description.robot_file import load_robot
from fivebar_description.strict_yaml import InputError
from seen_starts import random_starts

UNDECLARED = {
    "name": "undeclared",
    "controller": "unified",
    "start": "seen",
    "stands": [-0.02, 0.03, 1, -1],
    "waypoints": [[0.0, 0.14]],
    "segment_duration": 0.5,
    "plant": {"encoder_counts": 20_000, "delay_samples": 1},
    "estimator": "ekf",
    "ekf": {"camera": True},
    "camera": {"on": True, "rate_hz": 5},
}


def written(folder: Path, **changes: Any) -> str:
    path = folder / "undeclared.yaml"
    path.write_text(yaml.safe_dump(UNDECLARED | changes), encoding="utf-8")
    return str(path)


def test_a_motion_is_planned_from_where_the_camera_sees_the_robot(tmp_path: Path) -> None:
    """Through the locus, from the assembly mode that the same motor angles do not tell."""
    path = written(tmp_path)
    scenario = load_scenario(path)
    (x, y), goal = scenario.waypoints
    assert 0.0 < math.hypot(x + 0.02, y - 0.03) < 5e-4
    assert goal == (0.0, 0.14)
    assert scenario.working_mode == (1, -1)
    assert homing_of(scenario).assembly == -1
    # the simulated robot stands where it did, not where it is thought to be
    assert initial_joints(scenario) == inverse_geometry(load_robot("dextar"), (1, -1), -0.02, 0.03)
    run = simulate(scenario)
    assert not run.faults
    assert len(run.samples) == 251
    begin = start_seen(path)
    assert (begin.x, begin.y, begin.working_mode) == (x, y, (1, -1))


def test_what_is_not_seen_is_not_planned(tmp_path: Path) -> None:
    aside = CameraSettings()._replace(on=True, x=1.0)._asdict()
    for changes, expected in (
        ({"camera": {**aside, "base_tags": list(aside["base_tags"])}}, "does not see the platform"),
        ({"stands": [0.0, 0.4, 1, -1]}, "out of reach"),
        ({"stands": None}, "expected stands"),
        ({"camera": {"on": True, "pictures": False}}, "with pictures"),
        ({"waypoints": []}, "expected at least one"),
        ({"start": "declared"}, "expected at least two"),
    ):
        with pytest.raises(InputError, match=expected):
            load_scenario(written(tmp_path, **changes))


@pytest.mark.parametrize("number", [4, pytest.param(24, marks=pytest.mark.extra)])
def test_random_starts_are_seen_rightly(number: int) -> None:
    starts = random_starts(number)
    assert all(one.right for one in starts)
    assert {one.actual.assembly for one in starts} == {1, -1}
