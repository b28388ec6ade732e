# SPDX-License-Identifier: Apache-2.0
"""A second publisher of a topic of the control chain: refused before the first sample, a latched fault later."""

from __future__ import annotations

import json
import signal
from array import array
from collections.abc import Iterator
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from graph_probe import Bench
from middle_motion import MiddleMotion
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ALL_WELL,
    CAMERA_IMAGE,
    CTC_TORQUE,
    DRIVES_STATE,
    ESTIMATE_DISTURBANCE,
    FAULTS,
    IMU_DATA,
    JOINT_STATES,
    JOINTS,
    MOTOR_STATES,
    READINGS_RELEASED,
    REFERENCE,
    REFERENCE_AHEAD,
    REFERENCE_MOTION,
    RUN_EPOCH,
    RUN_PLAN,
    RUN_STATUS,
    SAFETY_STATE,
    START_STAMP_NS,
    SUPERVISOR_STATE,
    TORQUE_COMMAND,
    VHC_TORQUE,
    Topic,
    sample_stamp_ns,
)
from fivebar_description.ros.messages import joint_state
from fivebar_description.run_plan import epoch_text
from fivebar_sim.ros.node_settings import START_JOINTS

CHAIN = ("trajectory_generator", "supervisor", "ctc_controller", "vhc_controller", "blender")
RATE_HZ = 500
RELIABLE = QoSProfile(depth=10)
ZERO = (0.0, 0.0)
FOREIGN = (3.0, 3.0)
LATER = 40
"""Samples from now to one whose foreign torque comes ahead of its time."""
REST = 0.5
"""Speed (rad/s) below which this robot, which is never quite at rest, may be reset."""


class Chain:
    """The control chain, with a probe in the place of plant and time keeper."""

    def __init__(self, bench: Bench, motion: MiddleMotion, together: bool) -> None:
        self.bench = bench
        self.motion = motion
        if together:
            modules = [f"fivebar_control.nodes.{node}" for node in CHAIN]
            bench.start_group(*modules, "--ros-args", "-p", f"blender:safety.rest_speed:={REST}")
        else:
            self.processes = {
                node: bench.start(node, **({"safety.rest_speed": REST} if node == "blender" else {})) for node in CHAIN
            }
        self.probe = bench.probe()
        self.probe.publish(RUN_EPOCH, String(data=epoch_text(START_STAMP_NS)))
        self.probe.publish(DRIVES_STATE, String(data=ALL_WELL))
        for node in CHAIN:
            self.probe.join(node, [JOINT_STATES], [TORQUE_COMMAND, FAULTS, SAFETY_STATE] if node == CHAIN[0] else [])
        self.sample = 0
        self.probe.ask([(JOINT_STATES, motion.joint_states_message(0))], [TORQUE_COMMAND], 0)
        # until the plan asks for a torque
        while self.step() == ZERO:
            pass

    def step(self) -> tuple[float, ...]:
        """Ask for the torque of the next sample, and return it."""
        self.sample += 1
        self.probe.publish(JOINT_STATES, self.motion.joint_states_message(self.sample))
        return tuple(self.probe.answer(TORQUE_COMMAND, self.sample).effort)

    def faults(self) -> list[str]:
        return [message.data for message in self.probe.got(FAULTS)]

    def reset(self) -> str:
        return str(self.probe.reset("/blender").message)

    def reset_until_it_moves(self) -> None:
        def moves() -> bool:
            self.step()
            # shown where it never moves
            print(self.sample, self.reset())
            return self.step() != ZERO

        self.probe.wait_for(moves, "a torque after the reset")


@pytest.fixture(scope="module", params=[pytest.param(False, marks=pytest.mark.extra), True], ids=["apart", "together"])
def chain(request: Any, tmp_path_factory: pytest.TempPathFactory, motion: MiddleMotion) -> Iterator[Chain]:
    """In one process, as a run has it, and with the long tests in five."""
    with Bench(tmp_path_factory.mktemp("chain")) as bench:
        yield Chain(bench, motion, request.param)


WATCHED = {
    JOINT_STATES: "/probe",
    REFERENCE: "/trajectory_generator",
    CTC_TORQUE: "/ctc_controller",
    VHC_TORQUE: "/vhc_controller",
    SUPERVISOR_STATE: "/supervisor",
    TORQUE_COMMAND: "/blender",
    RUN_PLAN: "/trajectory_generator",
    RUN_EPOCH: "/probe",
    DRIVES_STATE: "/probe",
    SAFETY_STATE: "/blender",
}


@pytest.mark.parametrize("topic", WATCHED, ids=lambda topic: topic.name)
def test_a_second_publisher_stops_the_robot(chain: Chain, topic: Topic) -> None:
    assert chain.step() != ZERO
    before = len(chain.faults())
    rogue = chain.bench.probe(name="rogue")
    rogue.advertise(topic)
    if topic.of_joints:
        # others may publish other joints there
        chain.probe.wait_for(lambda: chain.step() != ZERO and rogue.listeners(topic), "the rogue is heard")
        rogue.publish(topic, chain.motion.joint_states_message(chain.sample))
    chain.probe.wait_for(lambda: len(chain.faults()) > before, "the fault")
    fault = chain.faults()[before]
    assert fault.startswith(f"second_publisher: {topic.name} is published by ")
    for name in (WATCHED[topic], "/rogue"):
        assert f"{name} (process " in fault
    # a reader of the topic that is no blender reports to it, and the probe may hear of it first
    chain.probe.wait_for(lambda: chain.step() == ZERO, "the torque's end")
    later = chain.sample + LATER
    for _ in range(3):
        if topic.name.endswith("/torque"):
            rogue.publish(topic, chain.motion.torque_message(chain.sample + 1, FOREIGN))
            rogue.publish(topic, chain.motion.torque_message(later, FOREIGN))
        assert chain.step() == ZERO
    status, _ = chain.probe.health("/blender")
    assert (status.level, status.message.partition(":")[0]) == (DiagnosticStatus.ERROR, "second_publisher")
    if topic not in (SAFETY_STATE,):
        assert f"not cleared, second_publisher: {topic.name} is published by " in chain.reset()
    rogue.close()
    chain.reset_until_it_moves()
    # nothing that the rogue has left behind is used
    while topic.name.endswith("/torque") and chain.sample < later:
        assert chain.step() != ZERO
    assert all(one.startswith(f"second_publisher: {topic.name} is published by ") for one in chain.faults()[before:])


def test_a_node_that_is_started_again_is_no_second_one(bench: Bench, motion: MiddleMotion) -> None:
    """Its predecessor was killed, so that DDS knows its publisher for some time more."""
    chain = Chain(bench, motion, together=False)
    chain.processes["ctc_controller"].send(signal.SIGKILL)
    chain.processes["ctc_controller"].wait()
    assert chain.step() == ZERO
    chain.probe.wait_for(lambda: chain.faults(), "the fault")
    bench.start("ctc_controller")
    chain.probe.wait_for(lambda: chain.probe.node.count_publishers(CTC_TORQUE.name) == 2, "both publishers are known")
    chain.reset_until_it_moves()
    assert [fault.partition(":")[0] for fault in chain.faults()] == ["candidate_missing"]


OFF_THE_GRID = START_STAMP_NS + 1
"""A stamp (ns) of no sample."""

SILENT = ("ctc_controller", "supervisor", "vhc_controller")
"""Nodes that leave it to the blender to publish the fault of what it reads too."""


def command(sample: int, torque: tuple[float, float]) -> Any:
    return joint_state(sample_stamp_ns(sample, RATE_HZ), ACTIVE_JOINTS, effort=torque)


@pytest.mark.parametrize(
    ("node", "topic", "more"),
    [
        ("blender", CTC_TORQUE, {"controller": "ctc"}),
        ("ctc_controller", REFERENCE, {}),
        ("supervisor", JOINT_STATES, {}),
        ("state_estimator", MOTOR_STATES, {}),
        ("plant", TORQUE_COMMAND, {}),
        ("dextar_bridge", TORQUE_COMMAND, {}),
        ("law_controller", REFERENCE_AHEAD, {"controller": "mpc"}),
        ("law_controller", REFERENCE_MOTION, {"controller": "path"}),
        ("ctc_controller", ESTIMATE_DISTURBANCE, {"estimator": "ekf", "ekf.feed_forward": True}),
        ("state_estimator", READINGS_RELEASED, {"estimator": "ekf", "ekf.gyro": True}),
        ("state_estimator", IMU_DATA, {"estimator": "ekf", "ekf.gyro": True}),
        ("vision_listener", CAMERA_IMAGE, {}),
        ("supervisor", RUN_PLAN, {}),
        ("vhc_controller", RUN_EPOCH, {}),
        ("plant", SAFETY_STATE, {}),
        ("blender", DRIVES_STATE, {}),
    ],
)
def test_before_the_first_sample_it_is_a_refusal(bench: Bench, node: str, topic: Topic, more: dict[str, Any]) -> None:
    process = bench.start(node, "/robot", **more)
    first = bench.probe("/robot", "first")
    first.listen(FAULTS)
    first.advertise(topic)
    first.wait_for(lambda: first.listeners(topic), "the node has found its input")
    assert process.status is None
    second = bench.probe("/robot", "second")
    second.advertise(topic)
    if topic.of_joints:
        first.wait_for(lambda: second.listeners(topic), "the node has found the other, too")
        for probe in (first, second):
            probe.publish(topic, joint_state(OFF_THE_GRID, topic.of_joints, [0.0] * len(topic.of_joints)))
    first.wait_for(lambda: process.status is not None, "the end of the node")
    assert process.status == 2
    (line,) = [one for one in process.stderr.splitlines() if "[ERROR]" in one and "published by" in one]
    assert f"second_publisher: {topic.name} is published by /robot/first (process " in line
    assert " and /robot/second (process " in line
    # it is repeated for a second
    assert list(dict.fromkeys(message.data for message in first.got(FAULTS))) == (
        [] if node in SILENT and not topic.reader_reports else [line[line.index("second_publisher") :]]
    )


class Plant:
    """A plant that is answered by a probe."""

    def __init__(self, bench: Bench, **parameters: Any) -> None:
        self.process = bench.start(
            "plant", samples=100_000, initial_joints=START_JOINTS, ready_timeout_s=600.0, **parameters
        )
        self.probe = bench.probe()
        self.probe.join("plant", [TORQUE_COMMAND, SAFETY_STATE], [JOINT_STATES, FAULTS, DRIVES_STATE, RUN_STATUS])
        self.sample = 0
        self.probe.answer(JOINT_STATES, 0)

    def step(self, torque: tuple[float, float]) -> tuple[float, float]:
        """Answer the present sample, and return the torque that the motors have applied."""
        self.probe.publish(TORQUE_COMMAND, command(self.sample, torque))
        self.sample += 1
        effort = self.probe.answer(JOINT_STATES, self.sample).effort
        return effort[0], effort[2]


def test_no_torque_of_a_second_publisher_reaches_the_plant(bench: Bench) -> None:
    plant = Plant(bench)
    assert plant.step((0.5, 0.5)) == (0.5, 0.5)
    rogue = bench.probe(name="rogue")
    rogue.advertise(TORQUE_COMMAND)
    probe = plant.probe
    probe.wait_for(lambda: probe.got(FAULTS), "the fault")
    assert probe.got(FAULTS)[0].data.startswith("second_publisher: torque_command is published by /probe (process ")
    probe.wait_for(lambda: probe.got(DRIVES_STATE)[-1].data == probe.got(FAULTS)[0].data, "the state of the drives")
    rogue.publish(TORQUE_COMMAND, command(plant.sample, FOREIGN))
    for _ in range(3):
        assert plant.step((0.5, 0.5)) == ZERO
    assert not probe.reset("/plant").success
    rogue.close()
    probe.wait_for(lambda: probe.reset("/plant").success, "a reset")
    plant.step((0.5, 0.5))
    assert plant.step((0.5, 0.5)) == (0.5, 0.5)
    assert json.loads(probe.got(RUN_STATUS)[-1].data)["state"] == "running"


def test_nothing_acts_on_the_plant_after_a_fault_of_the_blender(bench: Bench) -> None:
    """Its brake may for some time, which is ten samples here; then whatever is commanded does nothing."""
    plant = Plant(bench, brake_limit_s=0.02)
    probe = plant.probe
    assert plant.step((0.5, 0.5)) == (0.5, 0.5)
    probe.publish(SAFETY_STATE, String(data="tracking_lost: 60 mm"))
    assert probe.delivered(SAFETY_STATE)
    applied = [plant.step((-0.2, -0.2)) for _ in range(20)]
    assert applied[:9] == [(-0.2, -0.2)] * 9
    assert applied[13:] == [ZERO] * 7
    probe.publish(SAFETY_STATE, String(data=ALL_WELL))

    probe.wait_for(lambda: plant.step((0.5, 0.5)) == (0.5, 0.5), "a torque after the reset")


def test_a_second_message_of_a_sample_never_takes_the_place_of_the_first(bench: Bench, motion: MiddleMotion) -> None:
    bench.start("blender", controller="ctc", candidate_deadline_ms=30_000.0)
    probe = bench.probe()
    probe.join("blender", [JOINT_STATES, REFERENCE, CTC_TORQUE], [TORQUE_COMMAND, FAULTS])
    for sample in (0, 1, 2):
        probe.publish(CTC_TORQUE, motion.torque_message(sample, (1.0, 1.0)))
        probe.publish(REFERENCE, motion.reference_message(sample))
        if sample == 2:
            # the same again is no mistake, another one is
            probe.publish(CTC_TORQUE, motion.torque_message(sample, (1.0, 1.0)))
            assert not probe.got(FAULTS)
            probe.publish(CTC_TORQUE, motion.torque_message(sample, FOREIGN))
            probe.wait_for(lambda: probe.got(FAULTS), "the fault")
        if sample == 0:
            probe.ask([(JOINT_STATES, motion.joint_states_message(0))], [TORQUE_COMMAND], 0)
        else:
            probe.publish(JOINT_STATES, motion.joint_states_message(sample))
        assert tuple(probe.answer(TORQUE_COMMAND, sample).effort) == (ZERO if sample == 2 else (1.0, 1.0))
    (fault,) = [message.data for message in probe.got(FAULTS)]
    assert fault.startswith(
        "second_publisher: two different messages on ctc/torque for sample 2, which is published by"
    )


def test_other_joints_of_the_same_driver_are_left_out(bench: Bench, motion: MiddleMotion) -> None:
    """A robot and its gripper in one message, on a topic of which nothing is declared; joints that lack are named."""
    process = bench.start("supervisor")
    probe = bench.probe()
    probe.join("supervisor", [JOINT_STATES], [SUPERVISOR_STATE])

    def state(sample: int, names: tuple[str, ...]) -> Any:
        message = motion.joint_states_message(sample)
        fields = (dict(zip(JOINTS, values, strict=True)) for values in (message.position, message.velocity))
        position, velocity = ([field.get(name, 9.0) for name in names] for field in fields)
        return joint_state(sample_stamp_ns(sample, RATE_HZ), names, position, velocity)

    probe.ask([(JOINT_STATES, state(0, (*JOINTS, "finger")))], [SUPERVISOR_STATE], 0)
    probe.publish(JOINT_STATES, state(1, ("finger", *reversed(JOINTS), "thumb")))
    own = probe.answer(SUPERVISOR_STATE, 1)
    probe.publish(JOINT_STATES, state(2, (*JOINTS[:3], "finger")))
    probe.publish(JOINT_STATES, state(2, ("finger", "thumb")))
    probe.wait_for_dropped("/supervisor", 2)
    assert process.stderr.count("joint_states has other joints, too: finger\n") == 1
    assert "dropped a message on joint_states: " in process.stderr
    probe.publish(JOINT_STATES, state(2, JOINTS))
    assert list(own.position) != list(probe.answer(SUPERVISOR_STATE, 2).position)


def test_others_may_publish_other_joints_where_states_come_from_outside(bench: Bench, motion: MiddleMotion) -> None:
    cell = Topic("cell/joint_states", JOINT_STATES.type)
    process = bench.start(
        "supervisor", arguments=["-r", "joint_states:=cell/joint_states"], external_inputs=[JOINT_STATES.name]
    )
    probe, gripper = bench.probe(), bench.probe(name="gripper")
    gripper.advertise(cell)
    probe.join("supervisor", [cell], [SUPERVISOR_STATE, FAULTS])

    def state(sample: int, names: tuple[str, ...] = JOINTS) -> Any:
        message = motion.joint_states_message(sample)
        position, velocity = (dict(zip(JOINTS, values, strict=True)) for values in (message.position, message.velocity))
        return joint_state(
            sample_stamp_ns(sample, RATE_HZ),
            names,
            [position.get(name, 9.0) for name in names],
            [velocity.get(name, 9.0) for name in names],
        )

    probe.ask([(cell, state(0))], [SUPERVISOR_STATE], 0)
    probe.publish(cell, state(1))
    answer = probe.answer(SUPERVISOR_STATE, 1)
    for sample in (1, 2, 3):
        gripper.publish(cell, state(sample, ("finger", "thumb")))
    probe.publish(cell, state(2, ("finger", *reversed(JOINTS), "thumb")))
    probe.answer(SUPERVISOR_STATE, 2)
    assert process.status is None
    assert not probe.got(FAULTS)
    _, values = probe.health("/supervisor")
    assert (values["dropped"], int(values["answered"])) == ("0", 3)
    assert list(answer.position) != list(probe.answer(SUPERVISOR_STATE, 2).position)
    # two sources of the same joints are told by what they say
    foreign = state(2)
    foreign.velocity = array("d", [5.0] * 4)
    gripper.publish(cell, foreign)
    probe.wait_for(lambda: probe.got(FAULTS), "the fault")
    assert probe.got(FAULTS)[0].data.startswith("second_publisher: two different messages on ")


ARM = ("shoulder", "elbow")


def arm_state(number: int, *more: str) -> Any:
    """Return a message of another robot, with joints that it should not have."""
    names = (*ARM, *more)
    return joint_state(OFF_THE_GRID + number, names, [0.1] * len(names), [0.2] * len(names))


def test_an_arm_on_the_same_topic_is_no_second_publisher(bench: Bench, motion: MiddleMotion) -> None:
    """Neither while it sends nothing, nor with other joints, nor with best effort; with one of ours it is."""
    process = bench.start("supervisor")
    probe, arm, hasty = bench.probe(), bench.probe(name="arm"), bench.probe(name="hasty")
    arm.advertise(JOINT_STATES)
    best = hasty.node.create_publisher(JointState, JOINT_STATES.name, qos_profile_sensor_data)
    probe.join("supervisor", [JOINT_STATES], [SUPERVISOR_STATE, FAULTS])
    probe.wait_for(lambda: arm.listeners(JOINT_STATES), "the arm is heard")
    probe.ask([(JOINT_STATES, motion.joint_states_message(0))], [SUPERVISOR_STATE], 0)
    for sample in range(1, 20):
        arm.publish(JOINT_STATES, arm_state(sample))
        best.publish(arm_state(sample, "q11"))
        probe.publish(JOINT_STATES, motion.joint_states_message(sample))
        probe.answer(SUPERVISOR_STATE, sample)
    status, values = probe.health("/supervisor")
    assert (status.message, values["dropped"]) == ("ok", "0")
    assert not probe.got(FAULTS)
    arm.publish(JOINT_STATES, arm_state(20, "q11"))
    probe.wait_for(lambda: probe.got(FAULTS), "the fault")
    fault = probe.got(FAULTS)[0].data
    assert fault.startswith("second_publisher: joint_states is published by ")
    assert fault.endswith(", expected one publisher of q11, q12, q21, q22")
    for name in ("/probe", "/arm"):
        assert f"{name} (process " in fault
    assert process.status is None


@pytest.mark.parametrize("profile", [RELIABLE, qos_profile_sensor_data], ids=["reliable", "best_effort"])
def test_the_plant_shares_its_topic_with_an_arm(bench: Bench, profile: QoSProfile) -> None:
    """Until the arm sends a joint of the plant's; a reset is possible once it no longer does, while it still sends."""
    plant = Plant(bench)
    probe = plant.probe
    arm = bench.probe(name="arm").node.create_publisher(JointState, JOINT_STATES.name, profile)
    # the probe and, once it has found the arm, the plant itself
    probe.wait_for(lambda: plant.step((0.5, 0.5)) and arm.get_subscription_count() >= 1, "the plant has found it")
    for number in range(20):
        arm.publish(arm_state(number))
        assert plant.step((0.5, 0.5)) == (0.5, 0.5)
    assert not probe.got(FAULTS)

    def is_found() -> bool:
        arm.publish(arm_state(0, "q22"))
        plant.step((0.5, 0.5))
        return bool(probe.got(FAULTS))

    probe.wait_for(is_found, "the fault")
    fault = probe.got(FAULTS)[0].data
    assert fault.startswith("second_publisher: joint_states is published by ")
    assert fault.endswith(", expected one publisher of q11, q12, q21, q22")
    for name in ("/plant", "/arm"):
        assert f"{name} (process " in fault
    assert plant.step((0.5, 0.5)) == ZERO
    assert not probe.reset("/plant").success

    def is_reset() -> bool:
        arm.publish(arm_state(0))
        plant.step((0.5, 0.5))
        return bool(probe.reset("/plant").success)

    probe.wait_for(is_reset, "a reset")
    plant.step((0.5, 0.5))
    assert plant.step((0.5, 0.5)) == (0.5, 0.5)
