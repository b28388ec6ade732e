# SPDX-License-Identifier: Apache-2.0
"""The estimator as a node: the filter's figures to the last bit, bad input left out, and faults that stop the robot."""

from __future__ import annotations

import copy
import math
import queue
import threading
from array import array
from itertools import pairwise
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from estimate_replay import encoder_scenario, replay
from forked_node import ForkedNode
from graph_probe import DEADLINE, RATE_HZ, Bench, Probe
from sensor_msgs.msg import Imu

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.offline import OfflineRun, Sample, simulate
from fivebar_control.estimation.estimator import StateEstimator
from fivebar_control.estimation.late_reading import GYROSCOPE, LateReading
from fivebar_control.estimation.settings import Sensing
from fivebar_control.ros.machine_code import said_if_long
from fivebar_control.scenario.sensors import homing_of
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ESTIMATE_COVARIANCE,
    ESTIMATE_NAMES,
    FAULTS,
    IMU_DATA,
    JOINT_STATES,
    JOINTS,
    MOTOR_STATES,
    READINGS_RELEASED,
    TORQUE_COMMAND,
    Topic,
    sample_stamp_ns,
)
from fivebar_description.ros.messages import joint_state, to_stamp
from fivebar_description.sensors import LARGEST_OFFSET

DRIVES: dict[str, Any] = {"estimator": "ekf", "plant.encoder_counts": 20000, "plant.delay_samples": 1}
OUTPUTS = [JOINT_STATES, ESTIMATE_COVARIANCE]


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return encoder_scenario("middle", 0.5)


@pytest.fixture(scope="module")
def run(scenario: Scenario) -> OfflineRun:
    """What plant and estimator say of a run, offline."""
    return simulate(scenario)


@pytest.fixture(scope="module")
def samples(run: OfflineRun) -> list[Sample]:
    return run.samples


def start(bench: Bench, **parameters: Any) -> tuple[ForkedNode, Probe]:
    process = bench.start("state_estimator", **{**DRIVES, **parameters})
    probe = bench.probe()
    probe.join("state_estimator", [MOTOR_STATES, TORQUE_COMMAND], [*OUTPUTS, FAULTS])
    return process, probe


def motors(sample: Sample) -> Any:
    assert sample.estimated is not None
    angles, torques = sample.estimated.motors
    return joint_state(sample_stamp_ns(sample.number, RATE_HZ), ACTIVE_JOINTS, angles, effort=torques)


def command(sample: Sample) -> Any:
    return joint_state(sample_stamp_ns(sample.number, RATE_HZ), ACTIVE_JOINTS, effort=sample.command)


def expect(probe: Probe, sample: Sample) -> None:
    """Wait for the answer to a sample and compare it with the offline runner's."""
    assert sample.estimated is not None
    joints = probe.answer(JOINT_STATES, sample.number)
    assert tuple(joints.name) == JOINTS
    assert tuple(joints.position) == sample.measured.position
    assert tuple(joints.velocity) == sample.measured.velocity
    assert tuple(joints.effort) == sample.measured.effort
    deviations = probe.answer(ESTIMATE_COVARIANCE, sample.number)
    assert tuple(deviations.name) == ESTIMATE_NAMES
    assert tuple(deviations.position) == sample.estimated.deviations
    assert (len(deviations.velocity), len(deviations.effort)) == (0, 0)


def begin(probe: Probe, samples: list[Sample]) -> None:
    probe.ask([(MOTOR_STATES, motors(samples[0]))], OUTPUTS, 0)
    expect(probe, samples[0])


def test_every_sample_is_answered_with_the_filters_figures(bench: Bench, samples: list[Sample]) -> None:
    _, probe = start(bench)
    begin(probe, samples)
    # through the first crossing
    for before, sample in pairwise(samples[:170]):
        # the command may come before the sample or after it
        first, second = ((TORQUE_COMMAND, command(before)), (MOTOR_STATES, motors(sample)))
        for topic, message in (first, second) if sample.number % 3 else (second, first):
            probe.publish(topic, message)
        expect(probe, sample)
    assert probe.got(FAULTS) == []
    assert sorted(set(probe.samples(JOINT_STATES))) == list(range(170))


def test_an_answer_waits_for_the_command_before_it_and_a_repeat_gets_the_same_again(
    bench: Bench, samples: list[Sample]
) -> None:
    _, probe = start(bench)
    begin(probe, samples)
    probe.publish(MOTOR_STATES, motors(samples[1]))
    probe.spin_for(0.3)
    assert set(probe.samples(JOINT_STATES)) == {0}
    # a repeat while it waits is not answered with the sample before
    probe.publish(MOTOR_STATES, motors(samples[1]))
    probe.publish(TORQUE_COMMAND, command(samples[0]))
    expect(probe, samples[1])
    before = len(probe.got(JOINT_STATES))
    changed = motors(samples[1])
    changed.position = array("d", [1.0, 1.0])
    probe.publish(MOTOR_STATES, changed)
    probe.wait_for(lambda: len(probe.got(JOINT_STATES)) > before, "the answer again")
    expect(probe, samples[1])
    # in real time a command may be lost: the next sample ends the wait
    probe.publish(MOTOR_STATES, motors(samples[2]))
    probe.publish(MOTOR_STATES, motors(samples[3]))
    probe.answer(JOINT_STATES, 2)
    assert 3 not in probe.samples(JOINT_STATES)
    probe.publish(TORQUE_COMMAND, command(samples[2]))
    probe.answer(JOINT_STATES, 3)


def test_an_offset_by_whole_turns_is_named_and_taken_off(bench: Bench, samples: list[Sample]) -> None:
    process, probe = start(bench)
    shifted = motors(samples[0])
    shifted.position[1] -= 4.0 * math.pi
    probe.publish(MOTOR_STATES, shifted)
    probe.answer(JOINT_STATES, 0)
    assert probe.got(JOINT_STATES)[0].position.tolist() == pytest.approx(samples[0].measured.position, abs=1e-9)
    expected = "[state_estimator]: motor_states: offset from where the robot stands is q21 by -2 whole turns: taken off"
    assert process.stderr.count(expected) == 1
    _, values = probe.health("/state_estimator")
    assert (values["whole_turns_q11"], values["whole_turns_q21"]) == ("0", "-2")


def test_sample_0_begins_a_new_run(bench: Bench, samples: list[Sample]) -> None:
    _, probe = start(bench)
    for _ in range(2):
        begin(probe, samples)
        for before, sample in pairwise(samples[:5]):
            probe.publish(TORQUE_COMMAND, command(before))
            probe.publish(MOTOR_STATES, motors(sample))
            expect(probe, sample)


def wrong(message: Any, fields: tuple[str, ...]) -> list[Any]:
    """Return the message in many forms that must not be used."""
    spoiled = []
    for stamp in (sample_stamp_ns(0, RATE_HZ) - 1, 0):
        other = copy.deepcopy(message)
        other.header.stamp = to_stamp(stamp)
        spoiled.append(other)
    for names in ([], ["q11"], ["q11", "q12"], ["q11", "q11"], ["q11", "q21", "q22"]):
        other = copy.deepcopy(message)
        other.name = names
        spoiled.append(other)
    for field in fields:
        for values in ([], [0.1], [0.1, 0.2, 0.3], [math.nan, 0.1], [0.1, math.inf], [1e200, 0.1]):
            other = copy.deepcopy(message)
            setattr(other, field, array("d", values))
            spoiled.append(other)
    return spoiled


def test_malformed_input_is_dropped_and_counted(bench: Bench, samples: list[Sample]) -> None:
    _, probe = start(bench)
    begin(probe, samples)
    bad = [(MOTOR_STATES, message) for message in wrong(motors(samples[1]), ("position", "effort"))]
    bad += [(TORQUE_COMMAND, message) for message in wrong(command(samples[0]), ("effort",))]
    # a command for a sample that has not been
    bad.append((TORQUE_COMMAND, command(samples[7])))
    for number, (topic, message) in enumerate(bad):
        probe.publish(topic, message)
        if number % 4 == 3:
            # queues hold eight: a repeated sample, once it is answered again, tells that they have been emptied
            answers = len(probe.got(JOINT_STATES))
            probe.publish(MOTOR_STATES, motors(samples[0]))
            probe.wait_for(lambda seen=answers: len(probe.got(JOINT_STATES)) > seen, "sample 0 is answered again")
    probe.publish(TORQUE_COMMAND, command(samples[0]))
    probe.publish(MOTOR_STATES, motors(samples[1]))
    expect(probe, samples[1])
    assert set(probe.samples(JOINT_STATES)) == {0, 1}
    probe.wait_for_dropped("/state_estimator", len(bad))


def test_an_ambiguous_estimate_is_a_fault_and_still_an_answer(
    bench: Bench, scenario: Scenario, run: OfflineRun, samples: list[Sample]
) -> None:
    """The estimate goes on, so that the blender can answer every sample: with zero torque, since it hears the fault."""
    _, probe = start(bench, **{"ekf.dwell_limit": 0.006})
    begin(probe, samples)
    for before, sample in pairwise(samples):
        probe.publish(TORQUE_COMMAND, command(before))
        probe.publish(MOTOR_STATES, motors(sample))
        expect(probe, sample)
        if probe.got(FAULTS):
            break
    # the fault may come some answers after that of its sample
    settings = scenario.ekf._replace(dwell_limit=0.006)
    number = next(one.number for one in replay(run, scenario, settings) if one.fault is not None)
    assert number <= probe.samples(JOINT_STATES)[-1]
    faults = [message.data for message in probe.got(FAULTS)]
    assert faults == [f"estimate_ambiguous: at sample {number}: 1/cond(A) below 0.05 for 0.008 s, limit 0.006 s"]
    status, _ = probe.health("/state_estimator")
    assert status.message == faults[0]


def test_encoders_that_contradict_the_homing_posture_end_the_node(bench: Bench, samples: list[Sample]) -> None:
    process, probe = start(bench)
    message = motors(samples[0])
    message.position = array("d", [message.position[0], message.position[1] + 0.1])
    probe.publish(MOTOR_STATES, message)
    fault = probe.wait_for(lambda: probe.got(FAULTS), "the fault")[0].data
    assert fault.startswith("homing_contradicted: q21 reads ")
    assert process.wait() == 1
    assert probe.got(JOINT_STATES) == []


def test_a_node_that_comes_on_the_way_answers_nothing_until_a_new_run(bench: Bench, samples: list[Sample]) -> None:
    """Where the robot is it cannot know, although the encoders read the angles of the declared posture."""
    _, probe = start(bench)
    for number in (40, 41):
        message = motors(samples[0])
        message.header.stamp = to_stamp(sample_stamp_ns(number, RATE_HZ))
        probe.publish(MOTOR_STATES, message)
    probe.wait_for(lambda: probe.got(FAULTS), "the fault")
    begin(probe, samples)
    assert [message.data for message in probe.got(FAULTS)] == [
        "estimate_lost: the first sample heard was 40, not the beginning of a run"
    ]
    assert set(probe.samples(JOINT_STATES)) == {0}
    status, _ = probe.health("/state_estimator")
    assert status.level == DiagnosticStatus.OK


@pytest.mark.parametrize(
    ("parameters", "wanted"),
    [
        ({"waypoints": [0.0]}, "parameter waypoints: [0.0]: 1 numbers: expected pairs"),
        ({"waypoints": [0.0, 0.4, 0.0, 0.15]}, "is out of reach"),
        ({"working_mode": [1, 0]}, "working_mode: [1, 0]: expected two signs, each +1 or -1"),
        ({"ekf.acceleration_noise": 0.0}, "parameter ekf.acceleration_noise: expected 1e-06 to 1000.0"),
    ],
)
def test_bad_parameters_end_the_node_in_one_line(bench: Bench, parameters: dict[str, Any], wanted: str) -> None:
    process = bench.start("state_estimator", **parameters)
    assert process.wait() == 2
    assert wanted in process.stderr
    assert len(process.stderr.splitlines()) == 1


GYRO: dict[str, Any] = {
    "ekf": {"gyro": True},
    "imu": {
        "gyro_noise": 0.01,
        "gyro_bias": 0.02,
        "rate_hz": 250,
        "latency": 0.004,
        "lost": 0.1,
        "roll": 0.3,
        "yaw": 1.0,
    },
    "tolerances": {"length": 5e-5, "zero": 1e-4, "base": 2e-5, "gyro_scale": 0.02},
}
GYRO_PARAMETERS: dict[str, Any] = {
    "ekf.gyro": True,
    "imu.roll": 0.3,
    "imu.yaw": 1.0,
    **{f"tolerances.{name}": value for name, value in GYRO["tolerances"].items()},
}
READ = [MOTOR_STATES, TORQUE_COMMAND, IMU_DATA, READINGS_RELEASED]


@pytest.fixture(scope="module")
def turning() -> Scenario:
    """With a gyroscope: a reading every other sample, two samples late, some lost, and mounted askew."""
    return encoder_scenario("middle", 0.5, **GYRO)


@pytest.fixture(scope="module")
def turning_samples(turning: Scenario) -> list[Sample]:
    return simulate(turning).samples


def start_with_gyro(bench: Bench, awaits: bool) -> Probe:
    mode = "lockstep" if awaits else "realtime"
    bench.start("state_estimator", **DRIVES, **GYRO_PARAMETERS, mode=mode, compiled="no")
    probe = bench.probe()
    probe.join("state_estimator", READ if awaits else READ[:3], [*OUTPUTS, FAULTS])
    return probe


def reading(made: int, rate: tuple[float, float, float]) -> Imu:
    message = Imu()
    message.header.stamp = to_stamp(sample_stamp_ns(made, RATE_HZ))
    message.angular_velocity.x, message.angular_velocity.y, message.angular_velocity.z = rate
    return message


def readings(sample: Sample) -> list[tuple[Topic, Any]]:
    return [(IMU_DATA, reading(int(one.made), one.reading.angular_velocity)) for one in sample.imu]


def released(sample: Sample) -> Any:
    made = [one.made for one in sample.imu]
    return joint_state(sample_stamp_ns(sample.number, RATE_HZ), ["imu"] * len(made), made)


def begin_with_gyro(probe: Probe, samples: list[Sample]) -> None:
    start = [(MOTOR_STATES, motors(samples[0])), (READINGS_RELEASED, released(samples[0])), *readings(samples[0])]
    probe.ask(start, OUTPUTS, 0)
    expect(probe, samples[0])


def test_announced_readings_are_taken_in_any_order_of_arrival(bench: Bench, turning_samples: list[Sample]) -> None:
    samples = turning_samples[:120]
    assert sum(len(sample.imu) for sample in samples) > 40
    probe = start_with_gyro(bench, awaits=True)
    begin_with_gyro(probe, samples)
    for before, sample in pairwise(samples):
        inputs = [
            (MOTOR_STATES, motors(sample)),
            (TORQUE_COMMAND, command(before)),
            (READINGS_RELEASED, released(sample)),
            *readings(sample),
        ]
        turn = sample.number % len(inputs)
        for topic, message in (*inputs[turn:], *inputs[:turn]):
            probe.publish(topic, message)
        expect(probe, sample)
    assert probe.got(FAULTS) == []
    assert sorted(set(probe.samples(JOINT_STATES))) == list(range(120))


def test_an_answer_waits_for_the_announced_readings_and_takes_no_others(
    bench: Bench, turning_samples: list[Sample]
) -> None:
    samples = turning_samples[:60]
    probe = start_with_gyro(bench, awaits=True)
    begin_with_gyro(probe, samples)
    waited = next(sample for sample in samples[20:] if sample.imu)
    for before, sample in pairwise(samples):
        # readings come four samples before they are announced, but for those of one sample
        for early in samples[sample.number + 4 : sample.number + 5]:
            for topic, message in readings(early) if early is not waited else ():
                probe.publish(topic, message)
        inputs = [
            (READINGS_RELEASED, released(sample)),
            (TORQUE_COMMAND, command(before)),
            (MOTOR_STATES, motors(sample)),
        ]
        inputs += readings(sample) if sample.number < 5 else []
        for topic, message in inputs:
            probe.publish(topic, message)
        if sample is waited:
            probe.spin_for(0.3)
            assert sample.number not in probe.samples(JOINT_STATES)
            for topic, message in readings(sample):
                probe.publish(topic, message)
        expect(probe, sample)
    # so old that it is of another run
    oldest = samples[-1].number - math.ceil(LARGEST_OFFSET * RATE_HZ)
    probe.publish(IMU_DATA, reading(oldest - 1, (0.1, 0.2, 0.3)))
    probe.wait_for_dropped("/state_estimator", 1)


def test_readings_that_must_not_be_used_are_dropped_and_counted(bench: Bench, turning_samples: list[Sample]) -> None:
    probe = start_with_gyro(bench, awaits=True)
    begin_with_gyro(probe, turning_samples)
    bad: list[tuple[Topic, Any]] = [
        (IMU_DATA, reading(1, (math.nan, 0.0, 0.0))),
        (IMU_DATA, reading(1, (0.0, math.inf, 0.0))),
        # of an earlier run
        (IMU_DATA, reading(RATE_HZ, (0.1, 0.2, 0.3))),
    ]
    for number in (math.nan, math.inf):
        bad.append((READINGS_RELEASED, joint_state(sample_stamp_ns(1, RATE_HZ), ["imu"], [number])))
    for topic, message in bad:
        probe.publish(topic, message)
    probe.wait_for_dropped("/state_estimator", len(bad))
    # what comes next is answered as if nothing was
    for before, sample in pairwise(turning_samples[:6]):
        inputs = [
            (TORQUE_COMMAND, command(before)),
            (MOTOR_STATES, motors(sample)),
            (READINGS_RELEASED, released(sample)),
        ]
        for topic, message in (*inputs, *readings(sample)):
            probe.publish(topic, message)
        expect(probe, sample)


def test_in_real_time_an_answer_has_the_readings_that_have_come(
    bench: Bench, turning: Scenario, turning_samples: list[Sample]
) -> None:
    probe = start_with_gyro(bench, awaits=False)
    expected = StateEstimator(
        turning.five_bar(),
        homing_of(turning),
        Sensing(turning.rate_hz, turning.drives(), turning.ekf, turning.tolerances),
    )
    came: list[LateReading] = []
    dropped = 0
    first = turning_samples[0]
    assert first.estimated is not None
    expected.take(0, *first.estimated.motors[0], *first.estimated.motors[1])
    probe.ask([(MOTOR_STATES, motors(first))], OUTPUTS, 0)
    for before, sample in pairwise(turning_samples[:50]):
        if sample.number in (10, 30):
            # readings of four samples at once, the last ones first; what is dropped tells that they have come
            for made in range(sample.number - 1, sample.number - 5, -1):
                rate = (0.01 * made, -0.02 * made, 1.0)
                came.append(LateReading(GYROSCOPE, made, turning.imu.turn_rate(rate)))
                probe.publish(IMU_DATA, reading(made, rate))
            probe.publish(IMU_DATA, reading(0, (math.nan, 0.0, 0.0)))
            dropped += 1
            probe.wait_for_dropped("/state_estimator", dropped)
        probe.publish(TORQUE_COMMAND, command(before))
        probe.publish(MOTOR_STATES, motors(sample))
        answer = probe.answer(JOINT_STATES, sample.number)
        assert sample.estimated is not None
        expected.commanded(before.number, *before.command)
        told = expected.take(sample.number, *sample.estimated.motors[0], *sample.estimated.motors[1], came)
        assert (tuple(answer.position), tuple(answer.velocity)) == (told.position, told.velocity)
        came = []


def test_a_start_that_takes_long_says_why_while_it_does() -> None:
    said = queue.SimpleQueue[str]()
    with said_if_long(said.put, "compiles", after=0.001):
        assert said.get(timeout=DEADLINE) == "compiles"
    before = threading.active_count()
    with said_if_long(said.put, "compiles", after=1000.0):
        assert threading.active_count() == before + 1
    for thread in threading.enumerate():
        if isinstance(thread, threading.Timer):
            thread.join(DEADLINE)
    assert threading.active_count() == before
    assert said.empty()
