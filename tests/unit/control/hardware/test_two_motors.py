# SPDX-License-Identifier: Apache-2.0
"""Two motors on a driver, against emulated ones that the driver calls directly: gears, signs, limits and stops."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from closed_posture import closed_posture

from fivebar_control.fault import Fault
from fivebar_control.hardware.connection import interface_of
from fivebar_control.hardware.fault import DriveError
from fivebar_control.hardware.motors_file import MotorsFile, load_motors
from fivebar_control.hardware.two_motors import PairAnswer, PairCommand, ShaftReading, TwoMotors, shaft_torque
from fivebar_description.strict_yaml import InputError, validate
from fivebar_sim.motors.commands import read_order
from fivebar_sim.motors.configuration import MotorsEmulationFile
from fivebar_sim.motors.motors import EmulatedMotors

MOTORS: dict[str, dict[str, Any]] = {
    "q11": {"id": 1, "counts_per_revolution": 10000, "gear_ratio": 2.0, "sign": -1, "zero_rad": 1.5},
    "q21": {"id": 2, "counts_per_revolution": 20000},
}


def motors_file(**changed: Any) -> MotorsFile:
    limited = {joint: {**motor, "torque_limit_nm": 2.0} for joint, motor in MOTORS.items()}
    content = {"name": "test", "interface": "test", "set_up_timeout_ms": 50, "motors": limited, **changed}
    return validate(content, MotorsFile, "test")


class DirectDriver:
    """Calls the emulated motors as an answering bus would."""

    def __init__(self) -> None:
        content = {"name": "test", "robot": "dextar", "initial_joints": closed_posture(), "motors": MOTORS}
        self.motors = EmulatedMotors(validate(content, MotorsEmulationFile, "test"), 0.0)
        self.last = PairCommand(False, (0.0, 0.0))

    def exchange(self, command: PairCommand, timeout: float) -> PairAnswer:
        self.last = command
        readings: list[ShaftReading | None] = []
        states = []
        for number, torque in enumerate(command.torques):
            if self.motors.number_of(number + 1) is None:
                readings.append(None)
                continue
            state = self.motors.command(number, command.power, torque, 0.0)
            states.append(state)
            readings.append(ShaftReading(state.position, state.velocity, state.torque))
        fault = Fault("drive_error", "in error") if any(state.faulty for state in states) else None
        return PairAnswer((readings[0], readings[1]), all(state.powered for state in states), fault)

    def clear(self) -> None:
        for motor in self.motors.motors:
            motor.faulty = False

    def close(self) -> None: ...


def opened(**changed: Any) -> tuple[TwoMotors, DirectDriver]:
    driver = DirectDriver()
    motors = TwoMotors(motors_file(**changed), driver)
    motors.set_up()
    return motors, driver


def test_an_error_of_an_earlier_run_is_cleared_and_noted_and_gives_no_power() -> None:
    driver = DirectDriver()
    driver.motors.motors[1].faulty = True
    motors = TwoMotors(motors_file(), driver)
    motors.set_up()
    assert motors.notes == ("cleared drive_error: in error",)
    assert motors.exchange().fault is None
    assert not any(motor.powered for motor in driver.motors.motors)
    driver.motors.motors[1].faulty = True
    driver.clear = lambda: None  # type: ignore[method-assign]
    with pytest.raises(DriveError, match="drive_error: in error"):
        TwoMotors(motors_file(), driver).set_up()


def test_joint_angles_are_read_through_gear_sign_and_zero() -> None:
    motors, _ = opened()
    readings = motors.exchange().readings
    q11, _, q21, _ = closed_posture()
    for reading, angle in zip(readings, (q11, q21), strict=True):
        assert reading is not None
        assert reading.position <= angle < reading.position + math.tau / 20000 + 1e-12


def test_a_torque_acts_in_the_joint_s_sense_and_is_limited() -> None:
    motors, driver = opened()
    motors.enable(1.0)
    motors.write((1.6, -1.6))
    for _ in range(20):
        exchange = motors.exchange()
    assert driver.last.torques == pytest.approx((-0.8, -1.6))
    first, second = exchange.readings
    assert first is not None
    assert second is not None
    assert first.velocity > 0.0 > second.velocity
    assert (first.torque, second.torque) == pytest.approx((1.6, -1.6))
    motors.write((5.0, -5.0))
    motors.exchange()
    assert driver.last.torques == pytest.approx((-1.0, -2.0))


def test_a_limit_of_current_is_one_of_torque() -> None:
    limited = {**MOTORS["q11"], "torque_limit_nm": 1.0, "torque_constant": 0.1, "current_limit": 2.0}
    motors = motors_file(motors={"q11": limited, "q21": {**MOTORS["q21"], "torque_limit_nm": 1.0}})
    assert shaft_torque(motors.motors.q11, 0.9) == pytest.approx(-0.2)


def test_no_torque_before_the_drives_are_enabled_nor_without_a_number() -> None:
    motors, driver = opened()
    motors.write((0.3, 0.3))
    motors.exchange()
    assert driver.last == PairCommand(False, (0.0, 0.0))
    motors.enable(1.0)
    with pytest.raises(ValueError, match="finite"):
        motors.write((math.nan, 0.1))
    motors.exchange()
    assert driver.last == PairCommand(True, (0.0, 0.0))


@pytest.mark.parametrize(
    ("order", "fault"),
    [
        ("faulty", "drive_error"),
        ("silent", "feedback_missing"),
    ],
)
def test_a_fault_takes_the_power_of_both(order: str, fault: str) -> None:
    motors, driver = opened(missing_limit=2)
    motors.enable(1.0)
    motors.write((0.2, 0.2))
    motors.exchange()
    setattr(driver.motors.motors[0], order, True)
    faults = [motors.exchange().fault for _ in range(4)]
    found = next(one for one in faults if one is not None)
    assert found.name == fault
    assert driver.last == PairCommand(False, (0.0, 0.0))
    assert not motors.enabled
    setattr(driver.motors.motors[0], order, False)
    motors.reset(1.0)
    motors.enable(1.0)
    assert motors.enabled


@pytest.mark.parametrize("invalid", [ShaftReading(math.nan, 0.0, 0.0), ShaftReading(1.0, -math.inf, 0.0)])
def test_a_reading_that_is_not_finite_takes_the_power_and_is_no_measurement(invalid: ShaftReading) -> None:
    motors, driver = opened()
    motors.enable(1.0)
    answer = driver.exchange(PairCommand(True, (0.0, 0.0)), 0.0)
    driver.exchange = lambda *_: PairAnswer((answer.readings[0], invalid), True)  # type: ignore[method-assign]
    exchange = motors.exchange()
    assert exchange.fault is not None
    assert exchange.fault.name == "feedback_invalid"
    assert "q21 (id 2)" in exchange.fault.detail
    assert exchange.readings[1] is None
    assert not motors.enabled


def test_a_drive_that_does_not_answer_is_named() -> None:
    driver = DirectDriver()
    driver.motors.motors[1].silent = True
    with pytest.raises(DriveError, match=r"q21 \(id 2\)"):
        TwoMotors(motors_file(), driver).set_up()


def test_another_posture_than_the_declared_one_is_refused() -> None:
    motors, _ = opened(posture={"q11": 0.0, "q21": 0.0})
    with pytest.raises(DriveError, match="posture_unconfirmed: q11 reads"):
        motors.confirm_start(1.0)


def test_the_watchdog_takes_the_torque() -> None:
    motors, driver = opened()
    motors.enable(1.0)
    motors.write((0.2, 0.2))
    motors.exchange()
    assert driver.motors.motors[0].torque != 0.0
    driver.motors.tend(0.03)
    assert [motor.torque for motor in driver.motors.motors] == [0.0, 0.0]
    assert not any(motor.powered for motor in driver.motors.motors)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"period_us": 3000}, "period_us 3000: expected a divisor of 1000000"),
        ({"watchdog_ms": 2}, "watchdog_ms 2: expected at least two periods of 2000 us"),
        (
            {"motors": {joint: {**MOTORS["q11"], "torque_limit_nm": 1.0} for joint in MOTORS}},
            "id 1 of both q11 and q21",
        ),
    ],
)
def test_a_wrong_file_is_refused(changed: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        motors_file(**changed)


def test_a_file_names_its_interface(tmp_path: Path) -> None:
    path = tmp_path / "drives.yaml"
    path.write_text(yaml.safe_dump(motors_file().model_dump(mode="json")), encoding="utf-8")
    assert load_motors(str(path)) == motors_file()
    assert interface_of(str(path)) == "test"
    assert interface_of("dextar_emulated") is None
    path.write_text("interface: 3\n", encoding="utf-8")
    with pytest.raises(InputError, match="interface: 3: expected the name"):
        interface_of(str(path))


@pytest.mark.parametrize("line", ["fault 3", "unplug 1", "home now", "", "silent"])
def test_other_orders_are_not_understood(line: str) -> None:
    assert read_order(line) is None


def test_a_robot_stands_still_until_a_motor_first_has_torque() -> None:
    motors, driver = opened()
    q11, _, q21, _ = closed_posture()
    for number in range(1, 1000):
        driver.motors.tend(0.002 * number)
    motors.enable(1.0)
    for torques, end, moved in (((0.0, 0.0), 2.2, False), ((0.01, 0.0), 2.4, True)):
        motors.write(torques)
        motors.exchange()
        driver.motors.tend(end)
        (first, _, second, _), _, _ = driver.motors.history[-1].truth
        assert ((first, second) != (q11, q21)) is moved


def test_by_the_clock_torques_act_when_they_come_and_angles_are_read_when_they_are_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    motors = {joint: {**facts, "counts_per_revolution": 1_000_000} for joint, facts in MOTORS.items()}
    content = {"name": "test", "robot": "dextar", "initial_joints": closed_posture(), "motors": motors, "pace": "clock"}
    robot = EmulatedMotors(validate(content, MotorsEmulationFile, "test"), 0.0)
    applied: list[tuple[float, float]] = []
    advance = robot.plant.advance
    monkeypatch.setattr(robot.plant, "advance", lambda torques: (applied.append(torques), advance(torques)))
    # of q21, whose shaft is its joint, a quarter of a period late
    robot.command(0, True, 0.0, 0.0005)
    robot.command(1, True, 1.0, 0.0005)
    robot.tend(0.002)
    robot.tend(0.004)
    robot.command(1, True, -1.0, 0.005)
    robot.tend(0.006)
    assert [torque for _, torque in applied] == pytest.approx([0.75, 1.0, 0.0])
    angles, speeds = robot.plant.seen()
    found = robot.command(1, True, 0.0, 0.0071)
    assert found.position == pytest.approx(angles[2] + 0.0011 * speeds[2], abs=1e-5)
    assert abs(0.0011 * speeds[2]) > 2e-5


def test_by_the_clock_springs_swing_within_a_sample() -> None:
    """Angles between two samples are those of a robot whose samples are eight times as close."""
    motors = {joint: {**facts, "counts_per_revolution": 10_000_000} for joint, facts in MOTORS.items()}
    content = {
        "name": "test",
        "robot": "dextar",
        "initial_joints": closed_posture(),
        "motors": motors,
        "effects": {"transmission": {"frequency": 150.0, "rotor_share": 0.5}},
    }
    file = validate(content, MotorsEmulationFile, "test")
    clocked = EmulatedMotors(file.model_copy(update={"pace": "clock"}), 0.0)
    finer = EmulatedMotors(file.model_copy(update={"period_us": 250}), 0.0)
    assert clocked.parts == 8
    torque, found, expected = 1.0, list[list[float]](), list[list[float]]()
    for number in range(240):
        now = 0.00025 * number
        if number % 8 == 5:
            torque = -torque
            # a little later, so that rounding leaves it in this part
            found.append([clocked.command(motor, True, torque, now + 1e-7).position for motor in range(2)])
        answers = [finer.command(motor, number >= 5, torque, now) for motor in range(2)]
        if number % 8 == 5:
            expected.append([answer.position for answer in answers])
    swing = np.diff(expected, 2, axis=0)
    assert np.abs(swing).max() > 1e-3
    assert np.abs(np.array(found) - expected).max() < 1e-5
