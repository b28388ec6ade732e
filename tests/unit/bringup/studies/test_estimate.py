# SPDX-License-Identifier: Apache-2.0
"""`fivebar estimate`: the recorded settings give the recorded estimate bit for bit, others what they are."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from bag_contents import copied_into
from rosbags.rosbag2 import Reader
from typer.testing import CliRunner

from fivebar_bringup.bag import serialize
from fivebar_bringup.bag.definitions import TYPESTORE
from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.recording import FloatArray, Recording
from fivebar_bringup.bag.writer import BagWriter
from fivebar_bringup.cli.main import app
from fivebar_bringup.identify.reading import find_bag
from fivebar_bringup.recorded.run_directory import RunDirectory, new_run_directory
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.estimator import estimator_of
from fivebar_bringup.simulation.offline import Sample, simulate, write_bag
from fivebar_control.estimation.late_reading import GYROSCOPE, LateReading
from fivebar_description.interface import (
    IMU_DATA,
    MOTOR_STATES,
    NANOSECONDS,
    PAYLOAD,
    VISION_PLATFORM,
    Topic,
    sample_stamp_ns,
    topic_named,
)
from fivebar_description.parameters import laden
from fivebar_description.strict_yaml import InputError
from fivebar_studies.estimate.changes import changed_scenario
from fivebar_studies.estimate.estimate import estimate_bag
from fivebar_studies.estimate.page import SETTINGS_FILE
from fivebar_studies.estimate.record import read_estimator_record
from fivebar_studies.estimate.replay import with_payloads_as_taken
from fivebar_studies.estimate.study import ESTIMATION


def recorded(path: Path, faults: dict[str, float] | None = None) -> RunDirectory:
    """A crossing with a late gyroscope and a sample of delay."""
    content = load_scenario("gyro_middle").model_dump(mode="json")
    content["plant"]["gyroscope"] |= faults or {}
    content |= {"waypoints": [[0.0, 0.15], [0.0, 0.02]], "segment_duration": 0.5, "rate_hz": 250}
    scenario = Scenario.model_validate(content)
    run = new_run_directory(path, scenario)
    write_bag(simulate(scenario), scenario, run.bag)
    return run


def recorded_with_odd_clock(path: Path) -> RunDirectory:
    """The same with a clock that drifts, and jitters by more than a sample."""
    return recorded(path, {"clock_drift": 2e-3, "clock_jitter": 5e-3})


def recorded_with_camera(path: Path) -> RunDirectory:
    """A crossing seen by a camera whose clock is late, and of whose positions some never arrive."""
    content = load_scenario("camera_slow").model_dump(mode="json")
    content["camera"] |= {"pictures": False, "clock_offset": 0.0052, "dropped": 0.2}
    content |= {"segment_duration": 1.0, "rate_hz": 250}
    scenario = Scenario.model_validate(content)
    run = new_run_directory(path, scenario)
    write_bag(simulate(scenario), scenario, run.bag)
    return run


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> RunDirectory:
    return recorded(tmp_path_factory.mktemp("estimate") / "run")


def test_recorded_settings_give_the_recorded_estimate(run: RunDirectory) -> None:
    replay = estimate_bag(run.path, None, ()).after
    assert replay.same
    figures = replay.as_json()
    assert figures["difference_max_m"] == 0.0
    assert figures["samples"] == 126
    assert figures["fault"] == ""
    assert figures["nees_position"] is not None
    assert figures["innovations_gyro"] is not None


def test_joints_are_taken_by_their_names(run: RunDirectory, tmp_path: Path) -> None:
    """A driver may name them in any order, and another one in each message."""
    other = RunDirectory(tmp_path)
    with Reader(run.bag) as reader:
        topics = {one.topic: Topic(one.topic.removeprefix("/"), one.msgtype) for one in reader.connections}
        with BagWriter(other.bag, list(topics.values())) as writer:
            for number, (connection, log_time, data) in enumerate(reader.messages()):
                if connection.msgtype == MOTOR_STATES.type:
                    data = rotated(data, number)
                writer.write(topics[connection.topic], log_time, data)
    shutil.copy(run.scenario, other.scenario)
    replay = estimate_bag(other.path, None, ()).after
    assert replay.same
    assert replay.as_json() == estimate_bag(run.path, None, ()).after.as_json()


def rotated(data: bytes, by: int) -> bytes:
    """A JointState with its names, and the values beside them, moved on by some places."""
    message = TYPESTORE.deserialize_cdr(data, MOTOR_STATES.type)
    stamp = message.header.stamp.sec * NANOSECONDS + message.header.stamp.nanosec
    fields = [np.roll(getattr(message, name), by).tolist() for name in ("position", "velocity", "effort")]
    return serialize.joint_state(stamp, np.roll(message.name, by).tolist(), *fields)


@pytest.mark.extra
def test_positions_by_the_camera_are_replayed(tmp_path: Path) -> None:
    run = recorded_with_camera(tmp_path / "run")
    estimation = estimate_bag(run.path, None, ("ekf.camera=false",))
    assert estimation.before.same
    assert not estimation.after.same


@pytest.mark.extra
def test_other_settings_are_compared(run: RunDirectory, tmp_path: Path) -> None:
    out = tmp_path / "out"
    arguments = ["estimate", str(run.path), "--set", "ekf.gyro=false", "--set", "tolerances.length=0", "--json"]
    result = CliRunner().invoke(app, [*arguments, "--out", str(out)])
    assert result.exit_code == 0
    content = json.loads(result.stdout)
    assert set(content["changes"]) == {"ekf.gyro", "tolerances.length"}
    assert content["recorded"]["identical"]
    assert not content["changed"]["identical"]
    assert content["changed"]["difference_max_m"] > 1e-4
    assert content["changed"]["innovations_gyro"] is None
    assert "estimated again" in (out / "estimation.html").read_text(encoding="utf-8")
    rows = ESTIMATION.table.read(
        (out / "estimation.csv").read_text(encoding="utf-8").removeprefix(ESTIMATION.table.head)
    )
    assert [(row.case, row.identical, row.samples) for row in rows] == [(0, True, 126), (1, False, 126)]
    # the directory holds the study of these settings, and of no others
    assert CliRunner().invoke(app, [*arguments, "--out", str(out)]).stdout == result.stdout
    assert (
        "not ekf.gyro=true"
        in CliRunner().invoke(app, [*arguments[:2], "--set=ekf.gyro=true", "--out", str(out)]).stderr
    )
    again = changed_scenario(run.read_scenario(), out / SETTINGS_FILE, ())
    assert not again.ekf.gyro
    assert again.tolerances.length == 0.0


def estimated_with(samples: list[Sample], scenario: Scenario, payloads: dict[int, float]) -> list[Sample]:
    """The samples of a run as recorded by an estimator that took payloads (kg) at samples."""
    estimator, robot = estimator_of(scenario), scenario.five_bar()
    answered = []
    for sample in samples:
        if sample.number in payloads:
            estimator.carry(laden(robot, payloads[sample.number]))
        assert sample.estimated is not None
        (q11, q21), (tau1, tau2) = sample.estimated.motors
        turn_rate = scenario.imu.turn_rate
        rates = [LateReading(GYROSCOPE, one.made, turn_rate(one.reading.angular_velocity)) for one in sample.imu]
        estimate = estimator.take(sample.number, q11, q21, tau1, tau2, rates)
        estimator.commanded(sample.number, *sample.command)
        measured = sample.measured._replace(position=estimate.position, velocity=estimate.velocity)
        answered.append(sample._replace(measured=measured))
    return answered


def record_again(
    run: RunDirectory,
    payloads: Sequence[tuple[int, float]] = (),
    late: Topic = IMU_DATA,
    logged_at: Callable[[int], Sequence[int]] = lambda log_time: (log_time,),
) -> None:
    """Record the bag of a run again with payloads (kg), each just after the estimate of a sample, and with messages of
    a late sensor at other log times (ns)."""
    rate_hz = run.read_scenario().rate_hz
    plain = run.bag.with_name("plain")
    run.bag.rename(plain)
    with Reader(plain) as reader:
        named = {one.topic: topic_named(one.topic.removeprefix("/")) for one in reader.connections}
        topics = [topic for topic in named.values() if topic is not None]
        assert len(topics) == len(named)
        with BagWriter(run.bag, [*topics, PAYLOAD]) as bag:
            for connection, log_time, data in reader.messages():
                topic = named[connection.topic]
                assert topic is not None
                for logged in logged_at(log_time) if topic == late else [log_time]:
                    bag.write(topic, logged, data)
            for sample, payload in payloads:
                bag.write(PAYLOAD, sample_stamp_ns(sample, rate_hz) + 1, serialize.float64(payload))
            bag.close({})
    shutil.rmtree(plain)


@pytest.mark.extra
@pytest.mark.parametrize(
    ("record", "sensor"),
    [(recorded, IMU_DATA), (recorded_with_odd_clock, IMU_DATA), (recorded_with_camera, VISION_PLATFORM)],
    ids=["gyroscope", "odd clock", "camera"],
)
def test_in_lockstep_a_sample_has_its_readings_whenever_they_were_recorded(
    record: Callable[[Path], RunDirectory], sensor: Topic, tmp_path: Path
) -> None:
    """The recorder may have them after the estimate, and twice, where a waiting robot repeats its sample."""
    run = record(tmp_path / "run")
    period = NANOSECONDS // run.read_scenario().rate_hz
    record_again(run, late=sensor, logged_at=lambda log_time: (log_time + 2 * period, log_time + 5 * period))
    assert not estimate_bag(run.path, None, ()).after.same
    run.timing.write_text(json.dumps({"runner": "ros", "mode": "lockstep"}), encoding="utf-8")
    assert estimate_bag(run.path, None, ()).after.same


@pytest.mark.parametrize(
    ("late", "early"), [*(pytest.param(*one, marks=pytest.mark.extra) for one in ((0, 0), (7, 0), (0, 7))), (7, 7)]
)
def test_a_payload_is_replayed_where_the_estimator_took_it(late: int, early: int, tmp_path: Path) -> None:
    """The recorder may have had the message some samples later, or earlier; the other settings keep the samples."""
    run = recorded(tmp_path / "run")
    scenario = run.read_scenario()
    taken = {30: 0.3, 90: 0.1}
    simulated = simulate(scenario)
    samples = estimated_with(simulated.samples, scenario, taken)
    shutil.rmtree(run.bag)
    write_bag(simulated._replace(samples=samples), scenario, run.bag)
    messages = [(30 - 1 + late, 0.3), (60, -1.0), (90 - 1 - early, 0.1)]
    record_again(run, messages)
    assert read_bag(run.bag).count(PAYLOAD) == 3
    estimation = estimate_bag(run.path, None, ("ekf.gyro=false",))
    assert estimation.before.same
    assert not estimation.after.same
    source = find_bag(run.path)
    record = with_payloads_as_taken(read_estimator_record(source, scenario), scenario, source.bag)
    assert record.payloads == taken


def test_a_payload_whose_sample_cannot_be_told_stays_where_it_was_recorded(tmp_path: Path) -> None:
    run = recorded(tmp_path / "run")
    # the estimator of this run never took it
    record_again(run, [(30, 0.3)])
    estimation = estimate_bag(run.path, None, ())
    assert not estimation.after.same
    assert estimation.after.difference[:31].max() == 0.0
    assert estimation.after.difference[31] > 0.0


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        (["--set", "ekf.gyro_noise"], "expected KEY=VALUE"),
        (["--set", "gains.kp=1"], "--set gains.kp: expected a key of the sections ekf and tolerances"),
        (["--set", "ekf.gyro_noise=loud"], "expected a number"),
        (["--set", "ekf.loudness=1"], "ekf.loudness: unknown key"),
        (["--set", "ekf.gyro_noise=-1"], "ekf.gyro_noise"),
        (["--scenario", "other.yaml"], "--scenario: other.yaml: expected none"),
    ],
)
def test_a_wrong_setting_is_named(run: RunDirectory, tmp_path: Path, arguments: list[str], what: str) -> None:
    result = CliRunner().invoke(app, ["estimate", str(run.path), "--out", str(tmp_path / "out"), *arguments])
    assert result.exit_code == 2
    assert what in result.stderr
    assert not (tmp_path / "out").exists()


SENSORS_OTHERWISE: dict[str, Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]] = {
    "the gyroscope's readings have the opposite sign: is it mounted upside down": lambda motors, rates: (
        motors,
        -rates,
    ),
    "the gyroscope's readings are in degrees per second": lambda motors, rates: (motors, np.degrees(rates)),
    "the gyroscope is mounted otherwise: by its readings the link turns about (1.00, 0.00, 0.00) in the IMU's frame,"
    " expected about (0.00, 0.00, 1.00) by imu.roll": lambda motors, rates: (motors, rates[:, [2, 1, 0]]),
    "the gyroscope is mounted otherwise: by its readings the link turns about (0.00, 0.71": lambda motors, rates: (
        motors,
        rates[:, [0, 2, 2]] * [1.0, 0.5**0.5, 0.5**0.5],
    ),
    "the readings of q11 have the opposite sign": lambda motors, rates: (motors * [-1.0, 1.0], rates),
    "the readings of q11 and q21 have the opposite sign": lambda motors, rates: (-motors, rates),
    "q11 and q21 are exchanged": lambda motors, rates: (motors[:, ::-1], rates),
    "the readings of the motors are in degrees": lambda motors, rates: (np.degrees(motors), rates),
}


@pytest.mark.extra
@pytest.mark.parametrize(("words", "change"), SENSORS_OTHERWISE.items())
def test_sensors_that_are_mounted_or_signed_otherwise_are_named(
    words: str,
    change: Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]],
    run: RunDirectory,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Whether the estimator rejects them or, as with a gyroscope that is turned by 45 degrees, only yields to them."""
    read = Recording.field

    def changed(recording: Recording, topic: Topic, name: str) -> FloatArray:
        values = read(recording, topic, name)
        if (topic, name) == (MOTOR_STATES, "position"):
            return change(values, np.zeros((1, 3)))[0]
        return change(np.zeros((1, 2)), values)[1] if (topic, name) == (IMU_DATA, "angular_velocity") else values

    monkeypatch.setattr(Recording, "field", changed)
    with pytest.raises(InputError) as caught:
        estimate_bag(run.path, None, ())
    assert str(caught.value).startswith(f"{run.bag}: the recording contradicts the robot: {words}")


@pytest.mark.extra
def test_a_run_recorded_in_a_namespace_is_estimated_and_a_wrong_one_is_refused(
    run: RunDirectory, tmp_path: Path
) -> None:
    lab = RunDirectory(tmp_path / "lab")
    lab.path.mkdir()
    for file in (run.scenario, run.timing):
        if file.exists():
            shutil.copy(file, lab.path)
    copied_into("lab", run.bag, lab.bag)
    for namespace in ((), ("--namespace", "lab")):
        arguments = ["estimate", str(lab.path), "--json", "--out", str(tmp_path / f"out{len(namespace)}"), *namespace]
        result = CliRunner().invoke(app, arguments)
        assert result.exit_code == 0
        assert json.loads(result.stdout)["recorded"]["identical"]
    result = CliRunner().invoke(app, ["estimate", str(lab.path), "--namespace", "left"])
    assert (result.exit_code, result.stderr) == (
        2,
        f"fivebar: {lab.bag}: has no robot in the namespace /left: expected /lab by --namespace, or none given\n",
    )
