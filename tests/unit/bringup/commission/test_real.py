# SPDX-License-Identifier: Apache-2.0
"""A commissioning on drives that are there, by their own frames in real time, as far as no controller moves them."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from served_motors import UNHURRIED, bridge_file, served

from fivebar_commission.record import STATE_FILE
from fivebar_commission.session import DRIVES_FILE
from fivebar_commission.steps import begin, breakaway
from fivebar_commission.steps.begin import begun
from fivebar_commission.steps.sequence import commission
from fivebar_control.hardware.motors_file import load_motors
from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.robot_file import read_robot
from fivebar_description.strict_yaml import InputError, yaml_text
from fivebar_odrive_emulation.odrive_bus import ERRORS, ODriveBus
from fivebar_sim.motors.emulation import MotorsEmulation

BUS = "odrive"
TURN = math.radians(20.0)


def options(out: Path) -> dict[str, object]:
    """Options of a commissioning in a directory."""
    return {
        "robot": "dextar",
        "torque": 2.0,
        "speed": 6.0,
        "drives": "odrive",
        "practice": None,
        "answers": None,
        "again": None,
        "last": None,
        "out": out,
        "imu_rate_hz": 0,
        "tell": print,
        "read": lambda: "",
    }


class HandAtTheEmulation:
    """Does what the command asks for on the terminal, and answers."""

    def __init__(self, emulation: MotorsEmulation) -> None:
        self._emulation, self.told = emulation, list[str]()

    def read(self) -> str:
        request, motors = self.told[-1], self._emulation.motors
        robot = read_robot("dextar")
        if "Turn the left" in request or "Turn the right" in request:
            motor = motors.motors[0 if "left" in request else 1]
            motor.place(motor.joint_angle + TURN)
            return "yes\n"
        # the simulated links have not followed the encoders
        motors.go_home()
        if "Put the platform" in request:
            x, y = (1e-3 * float(request.partition(f"{axis} = ")[2].split()[0]) for axis in "xy")
            joints = inverse_geometry(robot.five_bar(), (1, -1), x, y)
            for motor, angle in zip(motors.motors, (joints.q11, joints.q21), strict=True):
                motor.place(angle)
        return "yes\n"


@pytest.mark.extra
def test_drives_on_a_bus_are_put_right_and_left_without_power(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(breakaway, "RISE_TIME", 1.5)
    content = bridge_file(BUS).model_dump(mode="json")
    given = tmp_path / "given.yaml"
    given.write_text(yaml_text(content))
    ids = (content["motors"]["q11"]["id"], content["motors"]["q21"]["id"])
    facts = ({"sign": -1, "zero_rad": 0.3, "gear_ratio": 4.0}, {"zero_rad": -0.2})
    with served(BUS, ODriveBus, ERRORS, ids, motors=facts, period_us=UNHURRIED["period_us"]) as emulation:
        person = HandAtTheEmulation(emulation)
        chosen = {"drives": str(given), "last": "zero", "tell": person.told.append, "read": person.read}
        session = begun(**(options(tmp_path / "out") | chosen))  # type: ignore[arg-type]
        ended = commission(session, "zero")
        assert ended.passed, ended.words
        assert not any(motor.powered for motor in emulation.motors.motors)
        assert [motor.torque for motor in emulation.motors.motors] == [0.0, 0.0]
    file = load_motors(str(tmp_path / "out" / DRIVES_FILE))
    assert (file.motors.q11.sign, file.motors.q21.sign) == (-1, 1)
    assert (file.motors.q11.gear_ratio, file.motors.q21.gear_ratio) == (4.0, 1.0)
    assert [motor.torque_limit_nm for motor in file.pair] == [2.0, 2.0]
    count = math.tau / 20000
    assert file.motors.q11.zero_rad == pytest.approx(0.3, abs=2.0 * count)
    assert file.motors.q21.zero_rad == pytest.approx(-0.2, abs=2.0 * count)
    assert file.period_us == UNHURRIED["period_us"]
    # what was given stays as it was
    assert load_motors(str(given)).motors.q11.sign == 1
    assert [one.outcome for one in session.state.steps] == ["passed"] * 4
    assert (tmp_path / "out" / STATE_FILE).is_file()


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"torque": math.nan}, "--torque: nan: expected a positive number"),
        ({"speed": 0.0}, r"--speed: 0\.0: expected a positive number"),
        ({"last": "zeros"}, "--until: 'zeros': .*zero"),
        ({"drives": None, "robot": "motkin_unknown"}, "motkin_unknown"),
        ({"drives": None, "robot": "motkin"}, "motkin: a board behind a serial port: expected --drives of another"),
        ({"practice": "1", "drives": None, "imu_rate_hz": 100}, "--imu-rate: expected without --practice"),
        ({"practice": "1"}, "--drives: expected without --practice"),
        ({"drives": "nowhere.yaml"}, r"nowhere\.yaml"),
        ({"answers": "nowhere.yaml"}, r"nowhere\.yaml"),
        ({"practice": "nowhere.yaml", "drives": None}, r"nowhere\.yaml"),
    ],
)
def test_options_that_cannot_be_are_refused_in_a_line(tmp_path: Path, changed: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        begun(**(options(tmp_path / "out") | changed))  # type: ignore[arg-type]
    # so that the same directory can be used with better ones
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("existed", [False, True])
def test_an_interrupt_while_it_begins_leaves_nothing_in_the_way_of_the_same_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, existed: bool
) -> None:
    def interrupted(*_: object) -> None:
        # as while machine code is compiled
        raise KeyboardInterrupt

    out = tmp_path / "out"
    if existed:
        out.mkdir()
    monkeypatch.setattr(begin, "PracticeBench", interrupted)
    with pytest.raises(KeyboardInterrupt):
        begun(**(options(out) | {"practice": "1", "drives": None}))  # type: ignore[arg-type]
    assert out.exists() is existed
    assert not existed or not any(out.iterdir())
