# SPDX-License-Identifier: Apache-2.0
"""The whole graph of a robot that a fault has stopped near the Type 2 locus, and that is to be released from there."""

from __future__ import annotations

import json
import re
import signal
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fivebar_command import FivebarCommand
from graph_probe import Bench
from std_srvs.srv import Trigger

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.recording import Recording
from fivebar_control.model.kinematics import assembly_mode, state_from_joints
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.planning.release import LINK_RATE, MOTOR_SPEED
from fivebar_description.interface import (
    GROUND_TRUTH,
    JOINTS,
    RELEASE_STATUS,
    RUN_STATUS,
    SAFETY_STATE,
    TORQUE_COMMAND,
)
from fivebar_description.robot_file import read_robot

NEAR_THE_LOCUS = """
name: released
controller: unified
waypoints: [[0.0, 0.12], [0.0, {end}]]
segment_duration: 0.4
force: true
plant: {{encoder_counts: 20000, delay_samples: 1, friction: {{passive: {friction}}}}}
imu: {{gyro_noise: 0.01, gyro_bias: 0.01, rate_hz: 250, latency: 0.004}}
estimator: ekf
ekf: {{gyro: {gyro}}}
loads: {{tilt: {tilt}}}
"""
"""It comes to rest near the locus, where the estimator gives up."""

ON_THE_LOCUS, BEFORE_IT, BEYOND_IT = 0.0846, 0.0875, 0.0815
"""Where it is to rest (m): the locus is at y = 0.0845 m there."""

TORQUE_LIMIT = 2.0
"""Of the simulated drives (Nm), as they come."""

LOOSE, STIFF, STUCK = 0.0003, 0.003, 0.15
"""Friction of the passive joints (Nm): the robot coasts away from the locus, rests where it is, or sticks there."""

RESTS_FROM = 600
"""Sample at which it rests, at the earliest."""


def release_of(
    content: str, fivebar: Callable[..., FivebarCommand], folder: Path, stop: bool = False
) -> tuple[str, Recording]:
    """Let a robot come to rest near the locus and release it; return how that ends, and the bag."""
    with Bench(folder) as bench:
        probe, domain = bench.probe(), str(bench.domain)
        probe.listen(RUN_STATUS, SAFETY_STATE, RELEASE_STATUS)
        path, out = folder / "released.yaml", folder / "stand"
        path.write_text(content, encoding="utf-8")
        standing = fivebar("stand", str(path), "--seconds", "600", "--domain", domain, "--out", str(out))

        def sample() -> int:
            return max((json.loads(one.data)["sample"] for one in probe.got(RUN_STATUS)), default=0)

        def status() -> str:
            return probe.got(RELEASE_STATUS)[-1].data if probe.got(RELEASE_STATUS) else ""

        probe.wait_for(lambda: any(one.data != "ok" for one in probe.got(SAFETY_STATE)), "the fault", 60.0)
        probe.wait_for(lambda: sample() > RESTS_FROM, "that it rests", 60.0)
        answer = probe.call(Trigger, "/blender/release", Trigger.Request())
        if answer.success and stop:
            probe.wait_for(lambda: status().startswith("pressing"), "torque", 60.0)
            probe.call(Trigger, "/blender/emergency_stop", Trigger.Request())
        if answer.success:
            probe.wait_for(lambda: status().startswith(("released", "ended", "refused")), "the release's end", 60.0)
        over = sample()
        probe.wait_for(lambda: sample() > over + 1000, "that it rests again", 60.0)
        standing.send(signal.SIGINT)
        standing.finish()
        told = status() if answer.success else answer.message
    return told, read_bag(out / "bag")


@pytest.mark.extra
@pytest.mark.parametrize(
    ("friction", "stop", "end"),
    [
        (STUCK, False, "ended: stuck"),
        (STIFF, True, "ended: requested by blender/emergency_stop"),
        (LOOSE, False, "refused: not near the Type 2 locus"),
        (STIFF, False, "refused: there is no gyroscope, and without one it is not known"),
    ],
)
def test_a_release_leaves_no_torque_behind_however_it_ends(
    friction: float, stop: bool, end: str, fivebar: Callable[..., FivebarCommand], tmp_path: Path
) -> None:
    seen = "no gyroscope" not in end
    content = NEAR_THE_LOCUS.format(friction=friction, end=ON_THE_LOCUS, gyro=seen, tilt=0.0 if seen else 0.05)
    status, recording = release_of(content, fivebar, tmp_path, stop)
    torque = recording.field(TORQUE_COMMAND, "effort")
    assert status.startswith(end)
    # the fault came within the first second, the release not before it rests
    assert not torque[500:RESTS_FROM].any()
    assert not torque[-100:].any()
    pressed = float(np.abs(torque[RESTS_FROM:]).max())
    assert pressed <= (TORQUE_LIMIT if end.startswith("ended") else 0.0)
    # the torque grows slowly, and the emergency stop comes soon after it has begun
    assert pressed > 0.2 or not end.startswith("ended: stuck")


@pytest.mark.extra
@pytest.mark.parametrize(("end", "gyro"), [(BEFORE_IT, True), (BEYOND_IT, True), (ON_THE_LOCUS, False)])
def test_a_release_from_a_rest_on_the_locus_ends_off_it_where_it_says(
    end: float, gyro: bool, fivebar: Callable[..., FivebarCommand], tmp_path: Path
) -> None:
    content = NEAR_THE_LOCUS.format(friction=STIFF, end=end, gyro=gyro, tilt=0.0)
    status, recording = release_of(content, fivebar, tmp_path)
    found = re.fullmatch(r"released: in assembly mode ([+-]), the platform at \((-?[\d.]+), (-?[\d.]+)\) m.*", status)
    assert found is not None, status
    names = recording.joint_names(GROUND_TRUTH)
    order = [names.index(joint) for joint in JOINTS]
    position, velocity = (recording.field(GROUND_TRUTH, field)[:, order] for field in ("position", "velocity"))
    robot = read_robot("dextar").five_bar()
    before = state_from_joints(robot, *position[RESTS_FROM], *velocity[RESTS_FROM])
    after = state_from_joints(robot, *position[-1], *velocity[-1])
    assert inverse_condition(before) < 0.04
    assert inverse_condition(after) > 0.1
    assert {1: "+", -1: "-"}[assembly_mode(after)] == found[1]
    assert np.hypot(after.x - float(found[2]), after.y - float(found[3])) < 0.01
    # at rest again, and never faster than the release allows
    assert np.abs(velocity[-1]).max() < 0.05
    assert np.abs(velocity[RESTS_FROM:, [0, 2]]).max() < MOTOR_SPEED
    assert np.abs(velocity[RESTS_FROM:, 2] + velocity[RESTS_FROM:, 3]).max() < LINK_RATE
    assert not recording.field(TORQUE_COMMAND, "effort")[-100:].any()
