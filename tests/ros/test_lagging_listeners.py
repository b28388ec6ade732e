# SPDX-License-Identifier: Apache-2.0
"""Nodes that only listen may lag behind the run: what has arrived when the run ends is not lost."""

from __future__ import annotations

import signal

from graph_probe import RATE_HZ, Bench
from middle_motion import MiddleMotion

from fivebar_bringup.bag.reader import read_bag
from fivebar_control.estimation.imu_check import ImuCheck
from fivebar_description.imu import STANDARD_GRAVITY, ImuSettings
from fivebar_description.interface import (
    CTC_TORQUE,
    IMU_DATA,
    IMU_ERROR,
    REFERENCE,
    SUPERVISOR_STATE,
    VHC_TORQUE,
    sample_stamp_ns,
)

COUNT = 400
MANY = 3000


def test_the_imu_listener_compares_all_that_has_arrived(bench: Bench, motion: MiddleMotion) -> None:
    """The references of the whole stretch come before its first IMU reading."""
    listener = bench.start("imu_listener")
    probe = bench.probe()
    probe.advertise(REFERENCE, IMU_DATA, depth=COUNT)
    probe.join("imu_listener", [REFERENCE, IMU_DATA], [IMU_ERROR])
    listener.send(signal.SIGSTOP)
    for sample in range(COUNT):
        probe.publish(REFERENCE, motion.reference_message(sample))
    for sample in range(COUNT):
        probe.publish(IMU_DATA, motion.imu_message(sample, (0.01 * sample, 1.0)))
    listener.send(signal.SIGCONT)
    assert probe.delivered(REFERENCE, IMU_DATA)
    listener.send(signal.SIGINT)
    assert listener.wait() == 0
    probe.wait_for(lambda: len(probe.got(IMU_ERROR)) == COUNT, "an answer to every sample")
    check = ImuCheck(motion.robot, motion.plan.mode, RATE_HZ, ImuSettings())
    wanted = [
        check.error((0.01 * sample, 1.0, STANDARD_GRAVITY), motion.plan.path.at(sample / RATE_HZ))
        for sample in range(COUNT)
    ]
    assert [message.data for message in probe.got(IMU_ERROR)] == wanted


def test_the_recorder_writes_all_that_has_arrived(bench: Bench, motion: MiddleMotion) -> None:
    topics = [SUPERVISOR_STATE, CTC_TORQUE, VHC_TORQUE]
    directory = bench.folder / "bag"
    recorder = bench.start("bag_recorder", directory=str(directory), topics=[topic.name for topic in topics])
    probe = bench.probe()
    probe.advertise(*topics, depth=MANY)
    probe.join("bag_recorder", topics, [])
    recorder.send(signal.SIGSTOP)
    for sample in range(MANY):
        probe.publish(SUPERVISOR_STATE, motion.supervisor_message(sample, 0.5))
        probe.publish(CTC_TORQUE, motion.torque_message(sample, (1.0, 2.0)))
        probe.publish(VHC_TORQUE, motion.torque_message(sample, (3.0, 4.0)))
    recorder.send(signal.SIGCONT)
    assert probe.delivered(*topics)
    recorder.send(signal.SIGINT)
    assert recorder.wait() == 0
    bag = read_bag(directory)
    for topic in topics:
        assert bag.stamps(topic).tolist() == [sample_stamp_ns(sample, RATE_HZ) for sample in range(MANY)]
    assert bag.custom_data["dropped"] == "0"
