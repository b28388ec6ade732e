# SPDX-License-Identifier: Apache-2.0
"""A whole run beside another program that publishes its topics, or beside a second run: stopped, and said by whom."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from copy import deepcopy

import numpy as np
import pytest
from fivebar_command import RATE_HZ, FivebarCommand, GraphRun
from graph_probe import Probe
from sensor_msgs.msg import JointState

from fivebar_description.interface import (
    ACTIVE_JOINTS,
    CAMERA_IMAGE,
    CAMERA_INFO,
    CONTROL_CHAIN,
    CTC_TORQUE,
    EXTRA_READINGS,
    FAULTS,
    JOINT_STATES,
    JOINTS,
    MOTOR_STATES,
    PASSIVE_STATES,
    REFERENCE_MOTION,
    SAFETY_STATE,
    START_STAMP_NS,
    SUPERVISOR_STATE,
    TORQUE_COMMAND,
    UNIFIED_TORQUE,
    VHC_TORQUE,
    Topic,
    sample_stamp_ns,
    torque_topic,
)
from fivebar_description.publishers import UNNAMED
from fivebar_description.ros.messages import joint_state, stamp_of

FOREIGN = (3.0, -3.0)


def torque_for_next(run: GraphRun) -> object:
    """Return a foreign torque for the sample after the newest."""
    newest = run.probe.got(JOINT_STATES)[-1]
    return joint_state(stamp_of(newest) + sample_stamp_ns(1, RATE_HZ, 0), ACTIVE_JOINTS, effort=FOREIGN)


SENSORS = {
    "controller": "mpc",
    "plant": {"encoder_counts": 20000, "delay_samples": 1},
    "estimator": "ekf",
    "ekf": {"gyro": True, "camera": True},
    "sensors": {"passive_encoder": {"leg": 1}},
    "camera": {"on": True, "pictures": False},
}
"""Sections of a run that has every topic of the control chain but those of other laws and of pictures."""

ELSEWHERE = {
    CTC_TORQUE,
    VHC_TORQUE,
    UNIFIED_TORQUE,
    REFERENCE_MOTION,
    SUPERVISOR_STATE,
    CAMERA_IMAGE,
    CAMERA_INFO,
    EXTRA_READINGS,
}


def first_fault(run: GraphRun) -> str:
    faults = run.probe.got(FAULTS)
    run.probe.wait_for(lambda: faults, "the fault")
    return str(faults[0].data)


@pytest.mark.parametrize(
    ("mode", "topic"),
    [
        pytest.param("lockstep", CTC_TORQUE, marks=pytest.mark.extra),
        pytest.param("lockstep", TORQUE_COMMAND, marks=pytest.mark.extra),
        pytest.param("realtime", CTC_TORQUE, marks=[pytest.mark.clock, pytest.mark.extra]),
        pytest.param("realtime", TORQUE_COMMAND, marks=[pytest.mark.clock, pytest.mark.extra]),
    ],
    ids=lambda value: getattr(value, "name", value),
)
def test_a_rogue_in_the_middle_of_a_run(graph_run: Callable[..., GraphRun], mode: str, topic: Topic) -> None:
    run = graph_run(*(["--realtime"] if mode == "realtime" else []))
    run.probe.listen(FAULTS)
    run.wait_for_sample(150)
    rogue = Probe(run.probe.domain, name="rogue")
    try:
        rogue.advertise(topic)
        for _ in range(50):
            rogue.publish(topic, torque_for_next(run))
            run.probe.spin_for(0.002)
        fault = first_fault(run)
        run.expect_no_torque(besides=FOREIGN)
    finally:
        rogue.close()
    assert fault.startswith(f"second_publisher: {topic.name} is published by ")
    # by the clock a few samples are waited for its name, which DDS may announce later: its process is known at once
    rogue_process = f"(process {os.getpid()})"
    assert f"/rogue {rogue_process}" in fault or (mode == "realtime" and f"{UNNAMED} {rogue_process}" in fault)
    run.command.send(signal.SIGINT)
    summary = run.finish()
    assert summary["faults"][0] == "second_publisher"
    applied = run.bag().field(JOINT_STATES, "effort")[:, [0, 2]]
    assert not np.any(np.all(applied == FOREIGN, axis=1)), "no torque of the rogue has acted"


FOREIGN_FRAME = "rogue"
"""Frame of the joints that a rogue publishes."""

TOPICS_OF_JOINTS = JOINT_STATES, MOTOR_STATES, PASSIVE_STATES

ACTS_FOR = 2
"""Samples after its own until which a torque is measured, with the drives' delay."""


def takes(run: GraphRun, rogue: Probe, topic: Topic) -> None:
    """Expect that a rogue that publishes a topic is named and leaves no torque, and a reset once it has gone."""
    probe = run.probe
    commands, faults = probe.got(TORQUE_COMMAND), probe.got(FAULTS)
    before = len(faults)
    # DDS repeats after 3 s what it has told before a probe was there
    name = probe.node.resolve_topic_name(topic.name)
    probe.wait_for(lambda: probe.node.count_publishers(name) == 1, f"the publisher of {topic.name}")
    (own,) = probe.node.get_publishers_info_by_topic(name)
    rogue.advertise(topic)

    def own_messages(topic: Topic) -> list[JointState]:
        return [message for message in probe.got(topic) if message.header.frame_id != FOREIGN_FRAME]

    def is_named() -> bool:
        # who only offers joints may be another robot, and a reading that is far off would cost the estimate for good
        if topic in TOPICS_OF_JOINTS:
            foreign = deepcopy(own_messages(topic)[-1])
            foreign.header.frame_id = FOREIGN_FRAME
            rogue.publish(topic, foreign)
        return len(faults) > before

    probe.wait_for(is_named, f"the fault of {topic.name}")
    rogue.withdraw(topic)
    assert faults[before].data.startswith(f"second_publisher: {topic.name} is published by /"), topic.name
    for name in (own.node_name, "rogue"):
        assert f"/{name} (process " in faults[before].data
    probe.wait_for(lambda: not any(commands[-1].effort), "no torque")
    # each topic has its own queue: a reading may come long after a command for a later sample
    commanded = (stamp_of(command) for command in commands if any(command.effort))
    acts_until = max(commanded, default=START_STAMP_NS) + sample_stamp_ns(ACTS_FOR, RATE_HZ, 0)

    def without_torque() -> list[JointState]:
        return [reading for reading in own_messages(MOTOR_STATES) if stamp_of(reading) > acts_until]

    told = len(commands)
    probe.wait_for(lambda: len(without_torque()) > 3 and len(commands) > told + 3, "further samples")
    assert not any(any(message.effort) for message in (*without_torque(), *commands[told:]))

    def moves() -> bool:
        probe.reset("/plant")
        answer = probe.reset("/blender")
        print(topic.name, answer.message)
        told = len(commands)
        probe.wait_for(lambda: len(commands) > told + 2, "torques")
        return bool(answer.success) and any(commands[-1].effort)

    probe.wait_for(moves, f"a torque after the rogue on {topic.name}")


@pytest.mark.extra
def test_a_rogue_on_every_topic_of_the_chain(graph_run: Callable[..., GraphRun]) -> None:
    run = graph_run(**SENSORS)
    run.probe.listen(FAULTS, MOTOR_STATES, PASSIVE_STATES)
    run.wait_for_sample(50)
    rogue = Probe(run.probe.domain, name="rogue")
    try:
        for topic in (torque_topic("mpc"), *(one for one in CONTROL_CHAIN if one not in ELSEWHERE)):
            takes(run, rogue, topic)
    finally:
        rogue.close()
    run.command.send(signal.SIGINT)
    assert set(run.finish()["faults"]) == {"second_publisher", "interrupted"}


# both runs go on as fast as they can until the second has ended
@pytest.mark.extra
def test_a_second_run_in_the_domain_of_the_first(graph_run: Callable[..., GraphRun]) -> None:
    first = graph_run()
    first.probe.listen(FAULTS, SAFETY_STATE)
    first.wait_for_sample(150)
    folder = first.out.parent / "second"
    arguments = ("run", str(first.out.parent / "scenario.yaml"), "--json", "--out", str(folder / "out"))
    second = FivebarCommand(folder, *arguments, "--domain", str(first.probe.domain), domain=first.probe.domain)
    try:
        assert first_fault(first).startswith("second_publisher: ")
        states = first.probe.got(SAFETY_STATE)
        first.probe.wait_for(lambda: states[-1].data.startswith("second_publisher: "), "the blender's stop")
        first.expect_no_torque()
        first.probe.wait_for(lambda: second.status is not None, "the end of the second run")
        assert second.finish() != 0
        print(second.stdout, second.stderr)
        assert "second_publisher: " in second.stdout + second.stderr
    finally:
        second.close()
    first.command.send(signal.SIGINT)
    assert "second_publisher" in first.finish()["faults"]


@pytest.mark.extra
def test_another_arm_on_the_topic_of_the_joints(graph_run: Callable[..., GraphRun]) -> None:
    """The run is as it is alone, and its bag is read without the arm's joints."""
    run = graph_run(segment_duration=1.0)
    arm = Probe(run.probe.domain, name="arm")
    try:
        arm.advertise(JOINT_STATES)
        while run.command.status is None:
            arm.publish(JOINT_STATES, joint_state(time.time_ns(), ("shoulder", "elbow"), (0.1, 0.2)))
            run.probe.spin_for(0.01)
    finally:
        arm.close()
    assert run.command.finish() == 0, run.command.stderr
    summary = run.command.json()
    assert (summary["faults"], summary["samples"]) == ([], 1001)
    assert run.bag().joint_names(JOINT_STATES) == JOINTS
