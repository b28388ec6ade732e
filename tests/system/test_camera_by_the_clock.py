# SPDX-License-Identifier: Apache-2.0
"""A camera in the rehearsal of an experiment: pictures rendered beside the clock, at what the machine can."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from fivebar_command import FivebarCommand

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_description.interface import VISION_PLATFORM

RATE_HZ = 100


def rehearsal() -> Scenario:
    """Return the shipped experiment, shorter, seen by a camera of a quarter of the pixels that asks for too much."""
    content = load_scenario("middle_robot").model_dump(mode="json") | {
        "name": "seen",
        "waypoints": [[0.0, 0.15], [0.0, 0.02]],
        "camera": {"on": True, "width": 640, "height": 480, "focal": 960.0, "rate_hz": 100},
    }
    content["ekf"]["camera"] = True
    # longer than a shared machine stands still
    content["safety"]["stop_cycles"] = RATE_HZ // 5
    return Scenario.model_validate(content)


@pytest.mark.clock
@pytest.mark.extra
def test_pictures_that_come_late_or_not_at_all_do_not_disturb_the_cycle(
    fivebar: Callable[..., FivebarCommand], folder: Path
) -> None:
    path = folder / "seen.yaml"
    path.write_text(rehearsal().to_yaml(), encoding="utf-8")
    out = folder / "out"
    call = fivebar("run", str(path), "--hardware", "emulated", "--json", "--out", str(out))
    call.finish()
    summary = call.json()
    print({key: summary[key] for key in ("overruns", "latency_ms", "vision_error_max_m", "tracking_error_peak_m")})
    # a machine that stands still costs samples; what the camera does must cost no run
    assert summary["faults"] == [], call.stdout + call.stderr
    assert summary["assembly_mode_changes"] == 1
    seen = read_bag(out / "bag").count(VISION_PLATFORM)
    print(f"{seen} pictures of {summary['planned_samples']}")
    assert 0 < seen <= summary["planned_samples"]
    assert summary["vision_true_error_max_m"] < 5e-4
