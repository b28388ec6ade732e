# SPDX-License-Identifier: Apache-2.0
"""The plant as a node: lockstep advances with the commands and with nothing else, real time with the clock."""

from __future__ import annotations

import json
import statistics
import time
from itertools import groupby, pairwise
from typing import Any

import pytest
from forked_node import ForkedNode
from graph_probe import Bench, Probe
from std_msgs.msg import String

from fivebar_description.interface import (
    ACTIVE_JOINTS,
    FAULTS,
    IMU_DATA,
    IMU_FRAME,
    JOINT_STATES,
    JOINTS,
    RUN_READY,
    RUN_STATUS,
    START_STAMP_NS,
    TORQUE_COMMAND,
    Topic,
    sample_stamp_ns,
)
from fivebar_description.robot_file import load_robot
from fivebar_description.ros.messages import joint_state, stamp_of
from fivebar_sim.effects.settings import PlantSettings
from fivebar_sim.plant import Plant
from fivebar_sim.ros.node_settings import START_JOINTS

RATE_HZ = 500
OUTPUTS = [JOINT_STATES, IMU_DATA, FAULTS, RUN_STATUS]


def start(bench: Bench, **parameters: Any) -> tuple[ForkedNode, Probe]:
    """Start a plant that waits for the probe, so that the probe misses nothing, and for its commands."""
    process = bench.start("plant", **{"wait_for_nodes": ["probe"], "command_timeout_s": 60.0, **parameters})
    probe = bench.probe()
    probe.join("plant", [TORQUE_COMMAND, RUN_READY], OUTPUTS)
    probe.publish(RUN_READY, String(data="probe"))
    return process, probe


def command(sample: int, torque: tuple[float, float], rate_hz: int = RATE_HZ, epoch_ns: int = START_STAMP_NS) -> Any:
    return joint_state(sample_stamp_ns(sample, rate_hz, epoch_ns), ACTIVE_JOINTS, effort=torque)


def torque_of(sample: int) -> tuple[float, float]:
    return 0.1 * sample + 1.0 / 3.0, -0.05 * sample


def status(probe: Probe) -> dict[str, Any]:
    messages = probe.got(RUN_STATUS)
    return json.loads(messages[-1].data) if messages else {}


def faults(probe: Probe) -> list[str]:
    return [message.data for message in probe.got(FAULTS)]


def once_each(probe: Probe, topic: Topic) -> list[Any]:
    """Return the messages of a topic without those that repeat the one before."""
    return [message for message, _ in groupby(probe.got(topic))]


def test_lockstep_goes_from_sample_to_sample_with_the_commands(bench: Bench) -> None:
    last, repeats = 6, 20
    began = time.monotonic()
    process, probe = start(bench, samples=last)
    # sample 0 every 100 ms until it is answered; on a busy machine single gaps say little, but there are no more
    # repeats than the time since the start allows
    probe.wait_for(lambda: len(probe.got(JOINT_STATES)) > repeats, "repeats of sample 0")
    assert time.monotonic() - began > 0.1 * repeats
    assert min(later - sooner for sooner, later in pairwise(probe.sent(JOINT_STATES))) < 0.15
    assert set(probe.samples(JOINT_STATES)) == {0}
    assert all(message == probe.got(JOINT_STATES)[0] for message in probe.got(JOINT_STATES))
    assert all(message == probe.got(IMU_DATA)[0] for message in probe.got(IMU_DATA))

    for sample in range(last):
        # of a later sample, off the grid, before the start, of an older sample: none of them advances anything
        foreign = [command(sample + 1, (9.0, 9.0)), command(sample, (9.0, 9.0)), command(sample, (9.0, 9.0))]
        foreign[1].header.stamp.nanosec += 1
        foreign[2].header.stamp.sec = 0
        for message in (*foreign, *([command(sample - 1, (9.0, 9.0))] if sample else [])):
            probe.publish(TORQUE_COMMAND, message)
        for bad in (
            joint_state(sample_stamp_ns(sample, RATE_HZ), ("q11", "q12"), effort=(9.0, 9.0)),
            joint_state(sample_stamp_ns(sample, RATE_HZ), ACTIVE_JOINTS, effort=(9.0, float("nan"))),
            joint_state(sample_stamp_ns(sample, RATE_HZ), ACTIVE_JOINTS, effort=(9.0,)),
        ):
            probe.publish(TORQUE_COMMAND, bad)
        probe.publish(TORQUE_COMMAND, command(sample, torque_of(sample)))
        probe.answer(JOINT_STATES, sample + 1)
        # the answer once more, as after a repeat
        probe.publish(TORQUE_COMMAND, command(sample, (9.0, 9.0)))
        if sample == 2:
            # three foreign stamps for each sample, and three bad contents; of sample 0 there is no older command, and
            # a repeated one is no mistake
            probe.wait_for_dropped("/plant", 3 * 6)
    assert process.status is None
    probe.publish(TORQUE_COMMAND, command(last, (0.0, 0.0)))
    assert process.wait() == 0
    assert process.stderr.count("Traceback") == 0
    probe.wait_for(lambda: status(probe).get("state") == "completed", "the run is completed")
    latency = status(probe).pop("latency_ms")
    assert 0.0 < latency["p50"] <= latency["p99"] <= latency["max"]
    assert status(probe)["pid"] == process.pid
    assert {**status(probe), "latency_ms": None, "pid": None} == {
        "state": "completed",
        "pid": None,
        "sample": last,
        "samples": last,
        "overruns": 0,
        "latency_ms": None,
    }
    assert faults(probe) == []

    # what was published is what the same commands make of the plain plant
    plant = Plant(load_robot("dextar"), START_JOINTS, RATE_HZ)
    joint_states, imu = once_each(probe, JOINT_STATES), once_each(probe, IMU_DATA)
    assert len(joint_states) == len(imu) == last + 1
    for sample in range(last + 1):
        measured, reading = plant.measure(), plant.measure_imu()
        assert stamp_of(joint_states[sample]) == stamp_of(imu[sample]) == sample_stamp_ns(sample, RATE_HZ)
        assert tuple(joint_states[sample].name) == JOINTS
        assert tuple(joint_states[sample].position) == measured.position
        assert tuple(joint_states[sample].velocity) == measured.velocity
        assert tuple(joint_states[sample].effort) == measured.effort
        if sample:
            tau1, tau2 = torque_of(sample - 1)
            assert tuple(joint_states[sample].effort) == (tau1, 0.0, tau2, 0.0)
        linear, angular = imu[sample].linear_acceleration, imu[sample].angular_velocity
        assert (linear.x, linear.y, linear.z) == reading.acceleration
        assert (angular.x, angular.y, angular.z) == reading.angular_velocity
        assert imu[sample].header.frame_id == IMU_FRAME
        assert imu[sample].orientation_covariance[0] == -1.0
        plant.advance(torque_of(sample))


def test_the_robot_of_mujoco_goes_from_sample_to_sample_too(bench: Bench) -> None:
    _, probe = start(bench, samples=3, **{"plant.engine": "mujoco"})
    plant = Plant(load_robot("dextar"), START_JOINTS, RATE_HZ, PlantSettings(engine="mujoco"))
    probe.answer(JOINT_STATES, 0)
    for sample in range(3):
        probe.publish(TORQUE_COMMAND, command(sample, torque_of(sample)))
        probe.answer(JOINT_STATES, sample + 1)
        plant.advance(torque_of(sample))
    assert tuple(probe.got(JOINT_STATES)[-1].position) == plant.measure().position


def test_lockstep_without_answers_is_a_fault(bench: Bench) -> None:
    # as long as a busy machine may take to answer sample 0
    process, probe = start(bench, command_timeout_s=2.0)
    probe.answer(JOINT_STATES, 0)
    began = time.monotonic()
    probe.publish(TORQUE_COMMAND, command(0, (0.1, 0.1)))
    probe.answer(JOINT_STATES, 1)
    assert process.wait() == 1
    assert time.monotonic() - began > 2.0
    probe.wait_for(lambda: faults(probe), "a fault")
    assert faults(probe) == ["command_timeout: no torque for sample 1 within 2 s"]
    probe.wait_for(lambda: status(probe).get("state") == "failed", "the run has failed")
    assert set(probe.samples(JOINT_STATES)) == {0, 1}


def test_a_second_publisher_stays_the_cause_when_no_answer_comes_for_it(bench: Bench) -> None:
    """As with a rogue on a sensor's topic, whose reader holds back every sample."""
    process, probe = start(bench, command_timeout_s=2.0)
    probe.answer(JOINT_STATES, 0)
    probe.publish(TORQUE_COMMAND, command(0, (0.1, 0.1)))
    probe.answer(JOINT_STATES, 1)
    bench.probe(name="rogue").advertise(IMU_DATA)
    assert process.wait() == 1
    probe.wait_for(lambda: status(probe).get("state") == "failed", "the run has failed")
    found, ended = faults(probe)[0], faults(probe)[-1]
    assert found.startswith("second_publisher: imu/data is published by /")
    assert ended == f"{found}; no torque for sample 1 within 2 s"


def test_a_sample_without_an_answer_is_published_again(bench: Bench) -> None:
    _, probe = start(bench, samples=3)
    probe.answer(JOINT_STATES, 0)
    probe.publish(TORQUE_COMMAND, command(0, torque_of(0)))
    for topic in (JOINT_STATES, IMU_DATA):
        probe.wait_for(lambda topic=topic: probe.samples(topic).count(1) == 3, "two repeats of sample 1")
        assert [probe.samples(topic).index(1), set(probe.samples(topic))] == [probe.samples(topic).count(0), {0, 1}]
        assert len(once_each(probe, topic)) == 2
    probe.publish(TORQUE_COMMAND, command(1, torque_of(1)))
    probe.answer(JOINT_STATES, 2)


def test_nodes_that_do_not_come_are_a_fault(bench: Bench) -> None:
    # there before the plant is: two seconds are for discovery alone
    probe = bench.probe()
    probe.publish(RUN_READY, String(data="probe"))
    process = bench.start("plant", wait_for_nodes=["probe", "camera"], ready_timeout_s=2.0)
    probe.join("plant", [TORQUE_COMMAND], OUTPUTS)
    assert process.wait() == 1
    probe.wait_for(lambda: faults(probe), "a fault")
    assert faults(probe) == ["nodes_missing: not ready within 2 s: camera"]


def test_a_plan_that_does_not_come_is_a_fault(bench: Bench) -> None:
    probe = bench.probe()
    probe.publish(RUN_READY, String(data="trajectory_generator"))
    process = bench.start("plant", wait_for_nodes=["trajectory_generator"], ready_timeout_s=2.0)
    probe.join("plant", [TORQUE_COMMAND], OUTPUTS)
    assert process.wait() == 1
    probe.wait_for(lambda: faults(probe), "a fault")
    assert faults(probe) == ["nodes_missing: not ready within 2 s: the plan of trajectory_generator"]
    assert probe.got(JOINT_STATES) == []


class Controller:
    """Answers every sample with a torque, until it is told to be silent."""

    def __init__(self, probe: Probe, rate_hz: int) -> None:
        self.silent = False
        self.applied: list[tuple[int, tuple[float, float]]] = []
        self._probe = probe
        self._rate_hz = rate_hz

    def on_sample(self, message: Any) -> None:
        sample = self._probe.sample(message, self._rate_hz)
        assert sample is not None
        self.applied.append((sample, (message.effort[0], message.effort[2])))
        if not self.silent:
            self._probe.publish(TORQUE_COMMAND, command(sample, (0.01, -0.02), self._rate_hz, self._probe.epoch_ns))


@pytest.mark.clock
def test_real_time_follows_the_clock_and_stops_the_robot_without_commands(bench: Bench) -> None:
    rate_hz, last = 100, 400
    process = bench.start(
        "plant", wait_for_nodes=["probe"], mode="realtime", rate_hz=rate_hz, samples=last, freshness_samples=30
    )
    probe = bench.probe()
    controller = Controller(probe, rate_hz)
    probe.listen(JOINT_STATES, callback=controller.on_sample)
    probe.join("plant", [TORQUE_COMMAND, RUN_READY], [JOINT_STATES, FAULTS, RUN_STATUS])
    controller.silent = True
    probe.publish(RUN_READY, String(data="probe"))

    # no command ever comes: samples come all the same, and before long a fault
    probe.wait_for(lambda: len(controller.applied) > 20, "samples without commands")
    probe.wait_for(lambda: faults(probe), "a fault")
    # sample 30 still waited for the torque of sample 0, so its age was beyond the limit
    assert faults(probe) == ["command_stale: sample 30 still waits for the torque of sample 0, limit 30 samples"]

    # commands do not help while the fault is latched
    controller.silent = False
    seen = len(controller.applied)
    probe.wait_for(lambda: len(controller.applied) > seen + 10, "samples with commands")
    assert {torque for _, torque in controller.applied} == {(0.0, 0.0)}

    response = probe.reset("/plant")
    assert response.success
    assert response.message.startswith("cleared command_stale: ")
    probe.wait_for(lambda: controller.applied[-1][1] == (0.01, -0.02), "torque after the reset")

    # silence again: the last command is held until it is stale, then there is no torque any more
    controller.silent = True
    last_command = controller.applied[-1][0]
    probe.wait_for(lambda: len(faults(probe)) == 2, "a second fault")
    # the fault may be here before the samples that came before it
    probe.wait_for(lambda: controller.applied[-1][1] == (0.0, 0.0), "no torque after the fault")
    seen = len(controller.applied)
    probe.wait_for(lambda: len(controller.applied) > seen + 10, "samples after the fault")
    assert {torque for _, torque in controller.applied[seen:]} == {(0.0, 0.0)}
    words = faults(probe)[1].split()
    still_waits, for_torque_of = int(words[2]), int(words[10].rstrip(","))
    assert for_torque_of == last_command + 1
    assert still_waits - last_command == 31
    held = [sample for sample, torque in controller.applied if torque != (0.0, 0.0)]
    assert held[-1] == still_waits

    assert process.wait() == 0
    probe.wait_for(lambda: status(probe).get("state") == "failed", "the run has failed")
    assert status(probe)["sample"] == last
    assert status(probe)["overruns"] > 30
    probe.answer(JOINT_STATES, last, rate_hz)
    sent = probe.sent(JOINT_STATES)
    # a second for the first answer, then 400 periods of 10 ms; what a busy machine adds delays single samples
    assert sent[-1] - sent[0] > 4.9
    assert statistics.median(later - earlier for earlier, later in pairwise(sent)) == pytest.approx(
        1 / rate_hz, rel=0.05
    )
    samples = [sample for sample, _ in controller.applied]
    # sample 0 is published until the clock starts
    samples = samples[samples.count(0) - 1 :]
    assert samples == sorted(set(samples))


@pytest.mark.extra
@pytest.mark.clock
def test_in_real_time_a_delayed_torque_acts_one_sample_later(bench: Bench) -> None:
    """The torque of sample k acts from sample k + 1 to k + 2, so the joints of sample k + 2 tell of it."""
    # every sample is to be answered within its period
    rate_hz, last = 10, 20
    process, probe = start(bench, mode="realtime", rate_hz=rate_hz, samples=last, **{"plant.delay_samples": 1})
    answered: list[int] = []

    def answer() -> bool:
        for sample in probe.samples(JOINT_STATES, rate_hz)[len(answered) :]:
            assert sample is not None
            answered.append(sample)
            probe.publish(TORQUE_COMMAND, command(sample, (0.001 * sample, -0.002 * sample), rate_hz, probe.epoch_ns))
        return process.status is not None

    probe.wait_for(answer, "the end of the run")
    assert process.wait() == 0
    assert status(probe)["overruns"] == 0
    efforts = {
        sample: (message.effort[0], message.effort[2])
        for sample, message in zip(probe.samples(JOINT_STATES, rate_hz), probe.got(JOINT_STATES), strict=True)
    }
    assert efforts == {sample: (0.001 * max(0, sample - 2), -0.002 * max(0, sample - 2)) for sample in range(last + 1)}
    # the same commands to the plain plant
    plant = Plant(load_robot("dextar"), START_JOINTS, rate_hz, PlantSettings(delay_samples=1))
    messages = dict(zip(probe.samples(JOINT_STATES, rate_hz), probe.got(JOINT_STATES), strict=True))
    for sample in range(last + 1):
        assert tuple(messages[sample].position) == plant.measure().position
        plant.advance((0.001 * sample, -0.002 * sample))
