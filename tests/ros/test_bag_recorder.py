# SPDX-License-Identifier: Apache-2.0
"""The recorder keeps the bytes that were sent, whatever they are, of the topics it was told and in its namespace."""

from __future__ import annotations

import math
import signal

from graph_probe import Bench
from middle_motion import MiddleMotion
from std_msgs.msg import Float64, String

from fivebar_bringup.bag.reader import read_bag
from fivebar_description.interface import (
    CTC_TORQUE,
    FAULTS,
    IMU_DATA,
    JOINT_STATES,
    SUPERVISOR_SIGMA,
    SUPERVISOR_STATE,
    TORQUE_COMMAND,
    sample_stamp_ns,
)
from fivebar_description.ros.messages import joint_state

COUNT = 2000


def test_what_was_sent_is_in_the_bag(bench: Bench, motion: MiddleMotion) -> None:
    recorded = [JOINT_STATES, CTC_TORQUE, IMU_DATA, SUPERVISOR_SIGMA, FAULTS]
    directory = bench.folder / "bag"
    recorder = bench.start("bag_recorder", "/lab", directory=str(directory), topics=[topic.name for topic in recorded])
    probe = bench.probe("/lab")
    probe.advertise(TORQUE_COMMAND)
    probe.advertise(*recorded, depth=COUNT + 1)
    probe.join("bag_recorder", recorded, [])
    torques = [(1.0 / (sample + 1), math.nan if sample % 7 == 0 else -0.0) for sample in range(COUNT)]
    # a message with the least and one with the most in it
    probe.publish(JOINT_STATES, motion.joint_states_message(0))
    probe.publish(IMU_DATA, motion.imu_message(0, (math.inf, -1e-310)))
    probe.publish(SUPERVISOR_SIGMA, Float64(data=math.nan))
    probe.publish(FAULTS, String(data='name: Größe überschritten, 50 % — "quoted"\n'))
    probe.publish(TORQUE_COMMAND, motion.torque_message(0, (1.0, 2.0)))
    for sample, torque in enumerate(torques):
        probe.publish(CTC_TORQUE, motion.torque_message(sample, torque))
    probe.publish(CTC_TORQUE, joint_state(sample_stamp_ns(COUNT, 500), ["q11", "q21"], effort=(0.0, 0.0)))
    probe.wait_for(
        lambda: int(probe.health("/lab/bag_recorder")[1]["answered"]) == COUNT + 5, "all messages are recorded"
    )
    recorder.send(signal.SIGINT)
    assert recorder.wait() == 0

    bag = read_bag(directory, "/lab")
    assert set(bag.topics) == {f"/lab/{topic.name}" for topic in recorded}
    assert bag.custom_data["dropped"] == "0"
    efforts = bag.field(CTC_TORQUE, "effort")
    assert [tuple(map(repr, row)) for row in efforts[:-1].tolist()] == [tuple(map(repr, one)) for one in torques]
    assert bag.stamps(CTC_TORQUE).tolist() == [sample_stamp_ns(sample, 500) for sample in range(COUNT + 1)]
    assert tuple(bag.field(JOINT_STATES, "position")[0].tolist()) == motion.joints(0)[0]
    assert bag.field(IMU_DATA, "linear_acceleration")[0].tolist()[:2] == [math.inf, -1e-310]
    assert math.isnan(bag.field(SUPERVISOR_SIGMA, "data")[0])
    assert bag.texts(FAULTS) == ['name: Größe überschritten, 50 % — "quoted"\n']
    assert bag.count(TORQUE_COMMAND) == 0
    assert (bag.log_times(CTC_TORQUE)[1:] >= bag.log_times(CTC_TORQUE)[:-1]).all()


def test_a_recorder_that_stands_still_for_a_while_loses_nothing(bench: Bench, motion: MiddleMotion) -> None:
    """As on a busy machine: 900 samples go by in which the recorder gets no processor time."""
    directory = bench.folder / "bag"
    recorder = bench.start("bag_recorder", directory=str(directory), topics=[SUPERVISOR_STATE.name])
    bench.start("supervisor")
    probe = bench.probe()
    probe.join("supervisor", [JOINT_STATES], [SUPERVISOR_STATE])
    probe.join("bag_recorder", [], [])
    probe.ask([(JOINT_STATES, motion.joint_states_message(0))], [SUPERVISOR_STATE], 0)
    probe.wait_for(lambda: int(probe.health("/bag_recorder")[1]["answered"]) > 0, "sample 0 is recorded")
    recorder.send(signal.SIGSTOP)
    last = 900
    for sample in range(1, last + 1):
        probe.publish(JOINT_STATES, motion.joint_states_message(sample))
        probe.answer(SUPERVISOR_STATE, sample)
    recorder.send(signal.SIGCONT)
    probe.wait_for(lambda: int(probe.health("/bag_recorder")[1]["answered"]) > last, "all samples are recorded")
    recorder.send(signal.SIGINT)
    assert recorder.wait() == 0
    bag = read_bag(directory)
    stamps = dict.fromkeys(bag.stamps(SUPERVISOR_STATE).tolist())
    assert list(stamps) == [sample_stamp_ns(sample, 500) for sample in range(last + 1)]
    assert bag.custom_data["dropped"] == "0"


def test_messages_that_are_lost_are_counted_once_all_publishers_are_at_rest(bench: Bench, motion: MiddleMotion) -> None:
    """A publisher that keeps ten messages goes on while the recorder stands still."""
    directory, sent = bench.folder / "bag", 300
    recorder = bench.start("bag_recorder", directory=str(directory), topics=[CTC_TORQUE.name])
    probe = bench.probe()
    probe.advertise(CTC_TORQUE, depth=10)
    probe.join("bag_recorder", [CTC_TORQUE], [])
    recorder.send(signal.SIGSTOP)
    # more than the socket's buffer holds
    for sample in range(sent):
        probe.publish(CTC_TORQUE, motion.torque_message(sample, (0.0, 0.0)))
    recorder.send(signal.SIGCONT)
    probe.publish(CTC_TORQUE, motion.torque_message(sent, (0.0, 0.0)))
    probe.wait_for(lambda: probe.health("/bag_recorder")[1]["answered"] != "0", "messages are recorded")
    recorder.send(signal.SIGINT)
    assert recorder.wait() == 0, recorder.stderr
    bag = read_bag(directory)
    assert int(bag.custom_data["dropped"]) == sent + 1 - bag.count(CTC_TORQUE) > 0
