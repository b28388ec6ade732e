# SPDX-License-Identifier: Apache-2.0
"""A robot on emulated drives that a fault has stopped near the Type 2 locus is released from there, by the clock."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from graph_probe import Bench
from launched import Launched
from std_srvs.srv import Trigger

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.recording import Recording
from fivebar_bringup.runs.launching import ControlRequest
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.model.kinematics import assembly_mode, state_from_joints
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.scenario.release import scenario_release
from fivebar_description.interface import (
    ALL_WELL,
    DRIVES_STATE,
    FAULTS,
    GROUND_TRUTH,
    JOINTS,
    RELEASE_STATUS,
    RUN_STATUS,
    SAFETY_STATE,
    TORQUE_COMMAND,
)

pytestmark = [pytest.mark.clock, pytest.mark.extra]

RATE_HZ = 100

NEAR_THE_LOCUS = """
name: released
controller: unified
waypoints: [[0.0, 0.12], [0.0, 0.0875]]
segment_duration: 0.4
rate_hz: 100
force: true
unified: {kp: 400.0, kd: 40.0}
plant: {torque_limit: 5.0, encoder_counts: 20000, delay_samples: 1, friction: {passive: 0.003}}
imu: {gyro_noise: 0.01, gyro_bias: 0.01, rate_hz: 100, latency: 0.01}
estimator: ekf
ekf: {gyro: true}
"""
"""It comes to rest near the locus, where the estimator gives up."""

REST = 2.0
"""Time (s) after which it rests."""

BRIDGES = {"": "/dextar_bridge", "odrive": "/drive_bridge", "moteus": "/drive_bridge"}
"""Bridges of the drives: by default those of the robot."""


class Released(NamedTuple):
    """What has come of a release.

    Attributes:
        scenario: path of its file.
        first: sample from which the robot rested.
        status: how the release ended.
        drives: whether the drives follow torques then, or why not.
        recording: the bag.
    """

    scenario: Path
    first: int
    status: str
    drives: str
    recording: Recording


def released(drives: str, folder: Path, pressing: Callable[[Callable[[str], Trigger.Response]], object]) -> Released:
    """Let a robot come to rest near the locus, have the operator release it, and end the graph.

    `pressing` is called while the motors press, with what calls a service.
    """
    path, run = folder / "released.yaml", folder / "run"
    path.write_text(NEAR_THE_LOCUS, encoding="utf-8")
    with Bench(folder) as bench:
        probe = bench.probe()
        probe.listen(RUN_STATUS, SAFETY_STATE, DRIVES_STATE, FAULTS, RELEASE_STATUS)
        request = ControlRequest(str(path), hardware="emulated", drives=drives, activate=True, stay=True)
        graph = Launched(bench, request._replace(record=str(run)))

        def sample() -> int:
            return max((json.loads(one.data)["sample"] for one in probe.got(RUN_STATUS)), default=0)

        def status() -> str:
            return probe.got(RELEASE_STATUS)[-1].data if probe.got(RELEASE_STATUS) else ""

        def asked(service: str) -> Trigger.Response:
            response: Trigger.Response = probe.call(Trigger, service, Trigger.Request())
            return response

        def rests(seconds: float) -> None:
            wanted = sample() + seconds * RATE_HZ
            probe.wait_for(lambda: sample() > wanted, f"{seconds:g} s of rest")

        probe.wait_for(lambda: any(one.data != ALL_WELL for one in probe.got(SAFETY_STATE)), "the fault")
        rests(1.5)
        first = sample()
        # the fault of the estimator has stopped the drives too
        assert asked("/blender/release").message.startswith("not released: the drives are stopped by estimate_")
        for step in ("reset", "enable"):
            answer = asked(f"{BRIDGES[drives]}/{step}")
            assert answer.success, answer.message
        # the drives wait for the operator without a fault
        rests(1.0)
        answer = asked("/blender/release")
        assert answer.success, answer.message
        probe.wait_for(lambda: status().startswith("pressing"), "torque")
        pressing(asked)
        probe.wait_for(lambda: status().startswith(("released", "ended", "refused")), "the end of the release")
        rests(1.0)
        told, drives_then = status(), probe.got(DRIVES_STATE)[-1].data
        graph.stop()
    return Released(path, first, told, drives_then, read_bag(run / "bag"))


@pytest.mark.parametrize("drives", BRIDGES)
def test_a_robot_on_drives_gets_off_the_locus_within_the_limits_and_has_no_torque_then(
    drives: str, tmp_path: Path
) -> None:
    path, first, status, state, recording = released(drives, tmp_path, lambda asked: None)
    names = recording.joint_names(GROUND_TRUTH)
    order = [names.index(joint) for joint in JOINTS]
    position, velocity = (recording.field(GROUND_TRUTH, field)[first:, order] for field in ("position", "velocity"))
    scenario = load_scenario(str(path))
    before, after = (state_from_joints(scenario.five_bar(), *position[end], *velocity[end]) for end in (0, -1))
    assert inverse_condition(before) < 0.04
    assert inverse_condition(after) > 0.1
    assert status.startswith(f"released: in assembly mode {'+' if assembly_mode(after) > 0 else '-'}"), status
    limits = scenario_release(scenario, *position[0, [0, 2]].tolist(), None).release
    assert np.abs(velocity[:, [0, 2]]).max() < limits.motor_speed
    assert np.abs(velocity[:, 2] + velocity[:, 3]).max() < limits.link_rate
    assert np.abs(position[:, [0, 2]] - position[0, [0, 2]]).max() < limits.travel
    assert np.abs(velocity[-1]).max() < 0.05
    torque = recording.field(TORQUE_COMMAND, "effort")[first:]
    assert (np.abs(torque).max(axis=0) <= (limits.cap1, limits.cap2)).all()
    assert np.abs(torque).max() > 0.2
    assert not torque[-RATE_HZ // 2 :].any()
    # the first fault stays latched, the drives are enabled, and nothing else is wrong
    assert recording.texts(SAFETY_STATE)[-1].startswith("estimate_")
    assert state == ALL_WELL
    assert len(set(recording.texts(FAULTS))) == 1


def test_drives_that_stop_end_a_release(tmp_path: Path) -> None:
    _, _, status, _, recording = released("", tmp_path, lambda asked: asked(f"{BRIDGES['']}/emergency_stop"))
    # told by the fault or by the state of the drives, whichever comes first
    assert re.fullmatch("ended: (the drives are stopped by )?emergency_stop: requested by service", status)
    torque = recording.field(TORQUE_COMMAND, "effort")
    assert not torque[-RATE_HZ // 2 :].any()
