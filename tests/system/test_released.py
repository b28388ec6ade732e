"""The whole graph of a robot that a fault has stopped near the Type 2 locus, and that is to be released from there."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fivebar_command import FivebarCommand
from graph_probe import Bench
from std_srvs.srv import Trigger

from fivebar_bringup.bag.reader import read_bag
from fivebar_description.interface import RELEASE_STATUS, RUN_STATUS, SAFETY_STATE, TORQUE_COMMAND

NEAR_THE_LOCUS = """
name: released
controller: unified
waypoints: [[0.0, 0.12], [0.0, 0.0846]]
segment_duration: 0.4
force: true
plant: {{encoder_counts: 20000, delay_samples: 1, friction: {{passive: {friction}}}}}
imu: {{gyro_noise: 0.01, gyro_bias: 0.01, rate_hz: 250, latency: 0.004}}
estimator: ekf
ekf: {{gyro: true}}
"""
"""It comes to rest near the locus, which is at y = 0.0845 m there, where the estimator gives up."""

TORQUE_LIMIT = 2.0
"""Of the simulated drives (Nm), as they come."""

LOOSE, STIFF = 0.0003, 0.003
"""Friction of the passive joints (Nm): the robot coasts away from the locus, or it rests there and sticks."""


@pytest.mark.extra
@pytest.mark.parametrize(
    ("friction", "stop", "end"),
    [
        (STIFF, False, "ended: stuck"),
        (STIFF, True, "ended: requested by blender/emergency_stop"),
        (LOOSE, False, "refused: not near the Type 2 locus"),
    ],
)
def test_a_release_leaves_no_torque_behind_however_it_ends(
    friction: float, stop: bool, end: str, fivebar: Callable[..., FivebarCommand], tmp_path: Path
) -> None:
    with Bench(tmp_path) as bench:
        probe, domain = bench.probe(), str(bench.domain)
        probe.listen(RUN_STATUS, SAFETY_STATE, RELEASE_STATUS)
        path, out = tmp_path / "released.yaml", tmp_path / "stand"
        path.write_text(NEAR_THE_LOCUS.format(friction=friction), encoding="utf-8")
        standing = fivebar("stand", str(path), "--seconds", "600", "--domain", domain, "--out", str(out))

        def sample() -> int:
            return max((json.loads(one.data)["sample"] for one in probe.got(RUN_STATUS)), default=0)

        def status() -> str:
            return probe.got(RELEASE_STATUS)[-1].data if probe.got(RELEASE_STATUS) else ""

        probe.wait_for(lambda: any(one.data != "ok" for one in probe.got(SAFETY_STATE)), "the fault", 60.0)
        probe.wait_for(lambda: sample() > 600, "that it rests", 60.0)
        answer = probe.call(Trigger, "/blender/release", Trigger.Request())
        assert answer.success, answer.message
        if stop:
            probe.wait_for(lambda: status().startswith("pressing"), "torque", 60.0)
            probe.call(Trigger, "/blender/emergency_stop", Trigger.Request())
        probe.wait_for(lambda: status().startswith(("released", "ended", "refused")), "the end of the release", 60.0)
        over = sample()
        probe.wait_for(lambda: sample() > over + 1000, "that it rests again", 60.0)
        standing.send(signal.SIGINT)
        standing.finish()
    recording = read_bag(out / "bag")
    torque = recording.field(TORQUE_COMMAND, "effort")
    assert status().startswith(end)
    # the fault came within the first second, the release not before sample 600
    assert not torque[500:600].any()
    assert not torque[-100:].any()
    pressed = float(np.abs(torque[600:]).max())
    assert pressed <= (0.0 if end.startswith("refused") else TORQUE_LIMIT)
    # the torque grows slowly, and the emergency stop comes soon after it has begun
    assert pressed > 0.2 or not end.startswith("ended: stuck")
