# SPDX-License-Identifier: Apache-2.0
"""A robot that has been lost is found again by the camera, without homing, and takes the next request."""

from __future__ import annotations

import json
import re
import signal
from collections.abc import Callable
from pathlib import Path

import pytest
from fivebar_command import FivebarCommand
from graph_probe import Bench

from fivebar_bringup.bag.reader import read_bag
from fivebar_description.interface import FAULTS, GOAL_STATUS, RUN_STATUS

SEEN = """
name: seen
controller: unified
waypoints: [[0.0, 0.15], [0.0, 0.14]]
segment_duration: 0.2
plant: {encoder_counts: 20000, delay_samples: 1, push: {force: 80.0, start: 7.0, length: 0.02}}
estimator: ekf
ekf: {camera: true}
camera: {on: true, pictures: false}
"""

PUSHED = 3500
"""Sample at which something hits the robot, so that the encoders differ from what the estimator expects."""


@pytest.mark.extra
def test_the_next_goal_after_a_lost_estimate(fivebar: Callable[..., FivebarCommand], tmp_path: Path) -> None:
    with Bench(tmp_path) as bench:
        probe, domain = bench.probe(), str(bench.domain)
        probe.listen(RUN_STATUS, GOAL_STATUS, FAULTS)
        path, out = tmp_path / "seen.yaml", tmp_path / "stand"
        path.write_text(SEEN, encoding="utf-8")
        standing = fivebar("stand", str(path), "--seconds", "600", "--domain", domain, "--out", str(out))

        def sample() -> int:
            return max((json.loads(one.data)["sample"] for one in probe.got(RUN_STATUS)), default=0)

        def goto(*goal: str) -> FivebarCommand:
            return fivebar("goto", *goal, "--live", "--domain", domain)

        probe.wait_for(lambda: sample() > 110, "the robot stands", 60.0)
        moving = goto("0.0", "0.11", "--duration", "10.0")
        probe.wait_for(lambda: any('"moving"' in one.data for one in probe.got(GOAL_STATUS)), "the motion", 60.0)
        assert sample() < PUSHED
        probe.wait_for(lambda: probe.got(FAULTS), "the fault", 60.0)
        assert moving.finish() == 1, moving.stdout
        stopped = sample()
        probe.wait_for(lambda: sample() > stopped + 400, "that it rests", 60.0)
        refused = goto("0.0", "0.14")
        assert refused.finish() == 2
        assert "reset it first" in refused.stdout
        assert "only a new run clears" in probe.reset("/blender").message
        found = probe.reset("/state_estimator")
        assert found.success, found.message
        probe.wait_for(lambda: probe.reset("/blender").success, "the reset", 20.0)
        arrived = goto("0.0", "0.03", "--mode", "-", "--duration", "2.0")
        assert arrived.finish() == 0, arrived.stdout
        standing.send(signal.SIGINT)
        standing.finish()
    (fault,) = read_bag(out / "bag").texts(FAULTS)
    name, found = re.match(r"(\w+): at sample (\d+) the motor encoders differ", fault).groups()
    assert (name, int(found) - PUSHED < 50) == ("estimate_inconsistent", True)
