# SPDX-License-Identifier: Apache-2.0
"""`fivebar calibrate` from a bag to a robot file, and what it says of bags that cannot serve."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from bag_contents import copied_into
from led_robot import BIAS, PATH, led, with_errors
from typer.testing import CliRunner

from fivebar_bringup.bag import serialize
from fivebar_bringup.bag.writer import BagWriter
from fivebar_bringup.calibrate.calibrate import calibrate_bag
from fivebar_bringup.cli.main import app
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.calibration.record import CalibrationRecord, TouchedPoint
from fivebar_control.hardware.configuration import load_drives
from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.imu import ImuSettings
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    IMU_DATA,
    IMU_FRAME,
    MOTOR_STATES,
    NANOSECONDS,
    late_stamp_ns,
    sample_stamp_ns,
)
from fivebar_description.robot_file import read_robot

ERRORS = np.array([2.4e-4, -1.9e-4, -2.8e-4, 1.1e-4, 0.8e-4, -1.3e-4])
ZEROS = (2.9e-3, -2.2e-3)
RATE = 500
CLOCK = 0.0047
"""s, by which the stamps of the IMU are late."""


def write(path: Path, record: CalibrationRecord, imu: bool = True) -> None:
    with BagWriter(path, [MOTOR_STATES, IMU_DATA] if imu else [MOTOR_STATES]) as bag:
        for number in range(len(record.times)):
            stamp = sample_stamp_ns(number, RATE)
            q11, q21 = record.motors[number].tolist()
            bag.write(MOTOR_STATES, stamp, serialize.joint_state(stamp, ACTIVE_JOINTS, (q11, q21), effort=(0.0, 0.0)))
            if imu and number % 2 == 0:
                x, y, z = record.angular_velocity[number].tolist()
                late = late_stamp_ns(number, RATE, CLOCK)
                bag.write(IMU_DATA, stamp, serialize.imu(late, IMU_FRAME, (x, y, z), (0.0, 0.0, 9.8)))
        bag.close({})


@pytest.fixture(scope="module")
def record() -> CalibrationRecord:
    robot = with_errors(read_robot("dextar").five_bar(), ERRORS)
    imu = ImuSettings(gyro_bias=BIAS, gyro_noise=0.01)
    return led(robot, ZEROS, PATH[:5], counts=20_000, imu=imu)


@pytest.fixture(scope="module")
def bag(record: CalibrationRecord, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("calibrate") / "bag"
    write(path, record)
    return path


def command(arguments: Sequence[str | Path]) -> tuple[int, str, str]:
    done = CliRunner().invoke(app, ["calibrate", *map(str, arguments)])
    return done.exit_code, done.stdout, done.stderr


def test_an_imu_upside_down_is_no_result_and_is_named(record: CalibrationRecord, tmp_path: Path) -> None:
    """The robot's mirror image explains its readings up to some tenths of a millimetre."""
    write(tmp_path / "bag", record._replace(angular_velocity=-record.angular_velocity))
    code, text, error = command([tmp_path / "bag", "--robot", "dextar", "--out", tmp_path / "out"])
    assert (code, text) == (2, "")
    assert "contradicts the robot: the gyroscope's readings have the opposite sign: is it mounted upside down" in error
    assert not (tmp_path / "out").exists()


def test_a_clock_that_is_set_back_is_named_and_no_sensor(record: CalibrationRecord, tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag", [MOTOR_STATES, IMU_DATA]) as bag:
        for number in range(len(record.times)):
            logged = sample_stamp_ns(number, RATE)
            stamp = logged - (2 * NANOSECONDS if number >= 500 else 0)
            q11, q21 = record.motors[number].tolist()
            bag.write(MOTOR_STATES, logged, serialize.joint_state(stamp, ACTIVE_JOINTS, (q11, q21), effort=(0.0, 0.0)))
            x, y, z = record.angular_velocity[number].tolist()
            bag.write(IMU_DATA, logged, serialize.imu(stamp, IMU_FRAME, (x, y, z), (0.0, 0.0, 9.8)))
    code, _, error = command([tmp_path / "bag", "--robot", "dextar", "--out", tmp_path / "out"])
    assert code == 2
    assert error == (
        f"fivebar: {tmp_path / 'bag'}: /motor_states: its stamps go back by 2.000 s, 0.998 s after the first:"
        " was a clock set while it was recorded?\n"
    )


@pytest.mark.extra
def test_a_bag_becomes_a_robot_file_drives_and_a_page(bag: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    code, text, _ = command([bag, "--robot", "dextar", "--drives", "dextar_emulated", "--out", out])
    assert code == 0
    assert "elbow gap after" in text
    assert "not seen, stays as it was: the scale" in text
    file = read_robot(str(out / "calibrated.yaml"))
    assert file.lengths_m.a == pytest.approx(0.118, abs=4e-4)
    # all over the locus, of which this motion crosses a part: less than the 0.3 mm before
    assert 0.0 < file.tolerances.length < 2e-4
    # what the estimator then takes off the stamps
    assert file.sensors.imu_clock == pytest.approx(CLOCK, abs=2e-4)
    assert read_robot(str(out / "calibrated.yaml")).sensors == file.sensors
    content = json.loads((out / "calibration.json").read_text())
    zeros = [content["parameters"][name] for name in ("zero_1", "zero_2")]
    assert [one["value"] for one in zeros] == [pytest.approx(zero, abs=1e-3) for zero in ZEROS]
    assert max(map(abs, content["elbow_gap_before_m"])) > 4e-4
    assert max(content["elbow_gap_half_widths_m"]) < 3e-5
    before, after = load_drives("dextar_emulated"), load_drives(str(out / "drives.yaml"))
    assert after.drives.q11.home_offset_rad == pytest.approx(
        before.drives.q11.home_offset_rad - zeros[0]["value"], abs=1e-8
    )
    assert "<h2>What the recording does not tell</h2>" in (out / "calibration.html").read_text()


def test_a_touched_point_shows_the_scale(bag: Path, tmp_path: Path) -> None:
    robot = with_errors(read_robot("dextar").five_bar(), ERRORS)
    places = [TouchedPoint(*inverse_geometry(robot, (1, -1), x, 0.13)[::2], x, 0.13, 1e-5) for x in (-0.03, 0.03)]
    lines = [f"  - {{q11: {p.q11 + ZEROS[0]}, q21: {p.q21 + ZEROS[1]}, x: {p.x}, y: {p.y}}}" for p in places]
    # where the motion begins
    touched = tmp_path / "touched.yaml"
    touched.write_text("\n".join(["deviation_m: 1.0e-5", "points:", *lines, "  - {time: 0.0, x: 0.0, y: 0.15}"]))
    result = calibrate_bag(bag, "dextar", touched)
    assert not result.unseen
    assert result.parameters()[0].half_width < 0.1  # mm


def test_bags_that_cannot_serve(bag: Path, record: CalibrationRecord, tmp_path: Path) -> None:
    silent, above = tmp_path / "silent", tmp_path / "above"
    write(silent, record, imu=False)
    for arguments, expected in (
        ([silent, "--robot", "dextar"], "/imu/data: no readings: expected those of a gyroscope"),
        ([bag], "--robot: expected the robot's name"),
        ([tmp_path / "none"], "no such directory"),
        ([bag, "--robot", "dextar", "--touched", tmp_path / "none.yaml"], "cannot be read"),
    ):
        code, _, error = command([*arguments, "--out", tmp_path / "out"])
        assert code == 2
        assert expected in error
        assert error.count("\n") == 1
    part = CalibrationRecord(*(column[:120] for column in record))
    write(above, part)
    code, _, error = command([above, "--robot", "dextar", "--encoders-only", "--out", tmp_path / "out"])
    assert (code, "no crossing" in error) == (2, True)
    # without a gyroscope the turning points serve
    result = calibrate_bag(silent, "dextar", encoders_only=True)
    assert result.calibration.gap_half_widths().max() < 3e-5
    assert "gyro_bias" not in result.as_json()["parameters"]


def test_a_robot_led_by_hand_without_power_shows_its_elbow_gap(tmp_path: Path) -> None:
    """The plant with friction and a hand, no torque, and the encoders alone."""
    scenario = load_scenario("calibration")
    path = {"waypoints": scenario.waypoints[:3], "segment_duration": 0.6, "name": "led"}
    file = tmp_path / "led.yaml"
    file.write_text(scenario.model_copy(update=path).to_yaml(), encoding="utf-8")
    run = tmp_path / "run"
    assert CliRunner().invoke(app, ["guide", str(file), "--out", str(run)]).exit_code == 0
    found = calibrate_bag(run, encoders_only=True).calibration
    plant = scenario.plant
    errors = np.array([*plant.links[:6], plant.encoders.zero_1, plant.encoders.zero_2])
    gaps = np.array([-row @ errors for _, row in found.crossings])
    assert len(gaps) == 2
    assert np.abs(gaps).max() > 4e-4
    assert np.abs(found.gaps_before() - gaps).max() < 1.5e-5


@pytest.mark.extra
def test_a_second_bag_narrows_the_intervals_and_stays_where_the_first_one_was(bag: Path, tmp_path: Path) -> None:
    found = []
    for number, bags in enumerate(([bag], [bag, bag])):
        out = tmp_path / f"found{number}"
        assert command([*bags, "--robot", "dextar", "--out", out])[0] == 0
        found.append(json.loads((out / "calibration.json").read_text()))
    one, both = (content["parameters"]["zero_1"] for content in found)
    assert both["half_width"] < 0.85 * one["half_width"]
    assert both["value"] == pytest.approx(one["value"], abs=one["half_width"])
    assert both["before"] == one["before"] == 0.0
    code, _, error = command([bag, bag, "--robot", "dextar", "--encoders-only", "--out", tmp_path / "out"])
    assert (code, "before its calibration, and a gyroscope" in error) == (2, True)


@pytest.mark.extra
def test_bags_of_both_motions_of_the_bench_leave_less_of_the_gap_anywhere_than_one(tmp_path: Path) -> None:
    """Printed links that bend, led by a hand that is in proportion to the light platform."""
    runs = [tmp_path / name for name in ("motkin_calibration", "motkin_calibration_below")]
    for run in runs:
        scenario = load_scenario(run.name)
        shorter = {"waypoints": scenario.waypoints[:4], "segment_duration": 0.4}
        file = tmp_path / f"{run.name}.yaml"
        file.write_text(scenario.model_copy(update=shorter).to_yaml(), encoding="utf-8")
        assert CliRunner().invoke(app, ["guide", str(file), "--out", str(run)]).exit_code == 0
    found = []
    for number, bags in enumerate((runs[:1], runs)):
        out = tmp_path / f"found{number}"
        assert command([*bags, "--out", out])[0] == 0
        found.append(json.loads((out / "calibration.json").read_text())["elbow_gap_anywhere_half_width_m"])
    assert found[0] > 1e-4
    assert found[1] < 0.5 * found[0]


def test_the_scenario_for_calibrating_is_a_robot_that_needs_it() -> None:
    scenario = load_scenario("calibration")
    assert scenario.gyro
    assert len(scenario.plan().crossings) == 8
    assert any(scenario.plant.links)
    assert any(scenario.plant.encoders)


@pytest.mark.extra
def test_a_bag_in_a_namespace_is_calibrated_and_a_wrong_one_is_refused(bag: Path, tmp_path: Path) -> None:
    copied_into("lab", bag, tmp_path / "bag")
    arguments = [tmp_path / "bag", "--robot", "dextar", "--encoders-only", "--out", tmp_path / "out"]
    plain = calibrate_bag(bag, "dextar", encoders_only=True)
    code, text, _ = command([*arguments, "--namespace", "lab", "--json"])
    assert code == 0
    assert json.loads(text)["parameters"] == plain.as_json()["parameters"]
    code, _, error = command([*arguments, "--namespace", "/left"])
    assert code == 2
    assert "has no robot in the namespace /left: expected /lab by --namespace" in error


def test_angles_that_are_wrapped_to_one_turn_calibrate_alike(
    bag: Path, record: CalibrationRecord, tmp_path: Path
) -> None:
    """As by a tool whose cut lies within the motion, and counted from another turn."""
    middle = 0.5 * (record.motors.min(axis=0) + record.motors.max(axis=0))
    write(tmp_path / "bag", record._replace(motors=(record.motors - middle) % (2.0 * np.pi) + middle))
    for encoders_only in (False, True):
        plain, wrapped = (
            calibrate_bag(path, "dextar", encoders_only=encoders_only).calibration for path in (bag, tmp_path / "bag")
        )
        assert np.all(np.abs(wrapped.values - plain.values) < 1e-3 * plain.half_widths + 1e-12)
