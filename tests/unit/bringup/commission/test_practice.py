# SPDX-License-Identifier: Apache-2.0
"""The simulated robot to practise on, and a whole commissioning of it."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_bringup.recorded.summary import Summary
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_commission.limits import Allowed
from fivebar_commission.person import PutAt, Turn
from fivebar_commission.practice import (
    GRIP,
    PracticeBench,
    PracticeFile,
    PracticeRobot,
    SimulatedPerson,
    assumed_drives,
    drawn_practice,
    read_practice,
)
from fivebar_commission.record import PASSED, STATE_FILE, CommissionState
from fivebar_commission.session import DRIVES_FILE, ROBOT_FILE, Session
from fivebar_commission.steps.begin import PRACTICE_FILE
from fivebar_commission.steps.sequence import STEPS
from fivebar_control.hardware.motors_file import load_motors
from fivebar_control.model.state import Platform
from fivebar_description.errors import InputError
from fivebar_description.robot_file import read_robot
from fivebar_description.strict_yaml import read_yaml, validate, yaml_text

RATE_HZ = 100


def rigid_bench(tmp_path: Path, seed: int) -> tuple[PracticeBench, Path]:
    """A bench with a drawn robot whose transmissions are rigid, which moves without machine code, and its drives."""
    content = drawn_practice("dextar", seed, RATE_HZ)
    del content["effects"]["transmission"]
    practice = validate(content, PracticeFile, "test")
    drives = tmp_path / "drives.yaml"
    drives.write_text(yaml_text(assumed_drives(practice, 2.0)))
    return PracticeBench(practice, machine_code=False), drives


def test_robots_are_drawn_within_their_bounds_and_again_by_the_same_number() -> None:
    drawn = [validate(drawn_practice("dextar", seed), PracticeFile, "test") for seed in range(40)]
    assert drawn[7] == validate(drawn_practice("dextar", 7), PracticeFile, "test")
    lengths = np.array([one.effects.links[:6] for one in drawn])
    assert 2.5e-4 < np.abs(lengths).max() <= 3e-4
    play = np.degrees([one.effects.transmission.backlash for one in drawn])
    assert 0.02 < play.max() <= 0.03
    frequencies = [one.effects.transmission.frequency for one in drawn]
    assert min(frequencies) >= 60.0 and max(frequencies) <= 250.0 and max(frequencies) - min(frequencies) > 150.0
    assert {tuple(motor.sign for motor in one.pair) for one in drawn} == {(1, -1), (-1, 1)}
    clocks = np.array([one.imu.clock_offset for one in drawn if one.imu is not None])
    assert len(clocks) == 40 and 0.008 < np.abs(clocks).max() <= 0.01
    upright = [one.imu.rotation()[2][2] for one in drawn if one.imu is not None]
    assert min(upright) < -0.99 < 0.99 < max(upright)
    assert 0.15 < np.abs([one.mass_scale - 1.0 for one in drawn]).max() <= 0.2
    assert 0.4 < np.abs([one.friction_scale - 1.0 for one in drawn]).max() <= 0.5
    assert np.degrees(np.abs([one.placing for one in drawn]).max()) <= 0.3


@pytest.mark.extra
def test_a_hand_turns_the_links_of_a_light_robot() -> None:
    """At 500 Hz a hand as firm as for DexTAR's links would make it swing ever more."""
    drawn = drawn_practice("dextar", 3)
    assert PracticeRobot(validate(drawn, PracticeFile, "test"), machine_code=False).firmest_grip == GRIP
    robot = PracticeRobot(validate(drawn | {"inertia_scale": 0.03}, PracticeFile, "test"), machine_code=False)
    before = robot.state
    robot.does(Turn(1, 0.3))
    after = robot.state
    assert after.leg2.q1 - before.leg2.q1 == pytest.approx(0.3, abs=0.02)
    assert after.leg1.q1 - before.leg1.q1 == pytest.approx(0.0, abs=0.02)


def test_a_robot_that_is_moved_too_fast_by_hand_is_named() -> None:
    robot = PracticeRobot(validate(drawn_practice("dextar", 3), PracticeFile, "test"), machine_code=False)
    with pytest.raises(InputError, match="dextar_3: moved by hand, the robot moves too fast"):
        robot.by_hand(lambda time: Platform(0.0, 0.1, 0.0, 0.0, 0.0, 0.0), 1.0, 30.0 * GRIP)


@pytest.mark.extra
def test_a_hand_turns_a_link_and_puts_the_platform_on_its_mark(tmp_path: Path) -> None:
    bench, drives = rigid_bench(tmp_path, 3)
    person, file = SimulatedPerson(bench.robot), read_practice_of(bench)
    before = bench.robot.state
    person.does("turn", "", Turn(1, 0.3))
    after = bench.robot.state
    # as well as a hand can against friction
    assert after.leg2.q1 - before.leg2.q1 == pytest.approx(0.3, abs=0.02)
    assert after.leg1.q1 - before.leg1.q1 == pytest.approx(0.0, abs=0.02)
    person.does("place", "", PutAt(0.0, 0.14))
    with bench.opened(drives, Allowed(2.0, 5.0)) as found:
        readings = [found.exchange().readings for _ in range(3)][-1]
    for reading, motor, leg in zip(readings, file.pair, bench.robot.state[:2], strict=True):
        assert reading is not None
        # the drives' file knows neither the sign nor the zero
        assert motor.sign * reading.position + motor.zero_rad == pytest.approx(leg.q1, abs=2.0 * math.tau / 20000)
    assert person.asked == 2


def test_an_imu_that_the_robot_file_declares_is_the_one_that_is_drawn_and_is_not_used_before_it_is_commissioned(
    tmp_path: Path,
) -> None:
    robot = str(Path(__file__).parents[3] / "data/belt.yaml")
    practice = validate(drawn_practice(robot, 1), PracticeFile, "test")
    declared = read_robot(robot).imu
    assert practice.imu is not None and declared is not None
    assert practice.imu.gyro_bandwidth_hz == declared.gyro_bandwidth_hz == 40.0
    assert practice.imu.rate_hz == declared.rate_hz
    bench = PracticeBench(practice, machine_code=False)
    (tmp_path / ROBOT_FILE).write_text(yaml_text(read_robot(robot).model_dump(mode="json", exclude_none=True)))
    (tmp_path / DRIVES_FILE).write_text(yaml_text(assumed_drives(practice, 2.0)))
    state = CommissionState(robot=robot, practice="1", torque_nm=2.0, speed_rad_s=5.0)
    session = Session(tmp_path, state, bench, SimulatedPerson(bench.robot), print)
    home = session.robot.home_m
    moved = {"waypoints": [home, (home[0] + 0.01, home[1])], "segment_duration": 1.0}
    assert not session.scenario("before", **moved).gyro
    assert session.scenario("after", ekf={"gyro": True}, **moved).gyro


def read_practice_of(bench: PracticeBench) -> PracticeFile:
    return bench.robot.file


def crossing_on(content: dict[str, Any], tmp_path: Path, signs: tuple[int, int], gear: float) -> Summary:
    """Cross with drives whose file has other signs, and another gear of q11, and whose zeros agree where it stands."""
    practice = validate(content, PracticeFile, "test")
    drives, file = tmp_path / "drives.yaml", assumed_drives(practice, 5.0)
    angles = practice.initial_joints[0], practice.initial_joints[2]
    for joint, motor, sign, angle in zip(("q11", "q21"), practice.pair, signs, angles, strict=True):
        ratio = gear if joint == "q11" else 1.0
        read = sign * (angle - motor.zero_rad) / ratio
        file["motors"][joint] |= {"sign": sign * motor.sign, "gear_ratio": ratio, "zero_rad": angle - read}
    drives.write_text(yaml_text(file))
    scenario = load_scenario("middle_robot").model_copy(update={"rate_hz": RATE_HZ})
    bench = PracticeBench(practice, machine_code=False)
    _, summary = bench.run(scenario, drives, tmp_path / "run", False)
    assert [(motor.torque, motor.powered) for motor in bench.robot.motors.motors] == [(0.0, False)] * 2
    return summary


@pytest.mark.extra
@pytest.mark.parametrize(
    ("signs", "gear"),
    [((1, 1), 1.0), ((-1, 1), 1.0), ((1, -1), 1.0), ((-1, -1), 1.0), ((1, 1), 2.0), ((1, 1), 0.5)],
)
def test_wrong_signs_and_gears_stop_the_robot_even_where_it_is_said_to_stand_right(
    tmp_path: Path, signs: tuple[int, int], gear: float
) -> None:
    content = drawn_practice("dextar", 3, RATE_HZ)
    content |= {"effects": {}, "mass_scale": 1.0, "inertia_scale": 1.0, "friction_scale": 1.0}
    summary = crossing_on(content, tmp_path, signs, gear)
    if (signs, gear) == ((1, 1), 1.0):
        assert summary.outcome == "succeeded", summary.fault_details
    else:
        assert summary.outcome == "stopped"
        assert summary.faults[0] in ("estimate_inconsistent", "tracking_lost", "over_speed")


@pytest.mark.extra
@pytest.mark.timeout(1800)
def test_a_drawn_robot_is_led_from_its_parts_to_its_first_crossing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # an assessment is tested elsewhere
    monkeypatch.setattr("fivebar_studies.assess.assess.QUICK", {"cases": 2, "robots": 2})
    out = tmp_path / "out"
    words = ["commission", "dextar", "--torque", "3", "--speed", "12", "--practice", "1", "--out", str(out)]
    # one part of it, and then the rest in another call
    begun = CliRunner().invoke(app, [*words, "--until", "zero"])
    assert begun.exit_code == 0, begun.output
    done = CliRunner().invoke(app, [*words, "--until", "crossing"])
    assert done.exit_code == 0, done.output
    assert "Step 4 of" not in done.output
    state, true = read_yaml(out / STATE_FILE, CommissionState), read_practice(out / PRACTICE_FILE)
    names = [step.name for step in STEPS]
    assert [one.step for one in state.steps] == names[: names.index("crossing") + 1]
    assert all(one.outcome == PASSED for one in state.steps)
    drives = load_motors(str(out / DRIVES_FILE))
    assert [motor.sign for motor in drives.pair] == [motor.sign for motor in true.pair]
    for found, motor in zip(drives.pair, true.pair, strict=True):
        assert abs(found.zero_rad - motor.zero_rad) < math.radians(0.15)
        assert found.torque_limit_nm <= 3.0
    robot, drawn = read_robot(str(out / ROBOT_FILE)), read_robot("dextar")
    assert robot.mass_kg is not None and drawn.mass_kg is not None
    assert robot.mass_kg.m == pytest.approx(true.mass_scale * drawn.mass_kg.m, rel=0.15)
    assert robot.friction.f_s21 == pytest.approx(true.friction_scale * drawn.friction.f_s21, rel=0.1)
    assert true.imu is not None and state.imu is not None
    assert robot.sensors.imu_clock == pytest.approx(true.imu.clock_offset, abs=1e-3)
    assert state.imu.get("yaw", 0.0) == pytest.approx(true.imu.yaw, abs=0.05)
    crossed = state.outcome_of("crossing")
    assert crossed is not None
    errors = [value for name, value in crossed.figures.items() if name.endswith("largest error, mm")]
    assert errors and max(errors) < 2.0
    # what has been found stands for the robot in every command, and one of them has assessed it
    assert robot.transmission.frequency == pytest.approx(state.transmissions["frequency"])
    assert robot.imu is not None and robot.imu.yaw == state.imu.get("yaw", 0.0)
    assessed = state.outcome_of("assessment")
    assert assessed is not None and "of random crossings " in assessed.words
    assert (out / assessed.pages[0]).is_file()
    page = (out / "commission.html").read_text()
    assert re.search(r"\d+ questions,\s+\d+ s on the\s+robot", page)
    # a calibration that is repeated finds the same, and does not correct the zeros twice
    repeated = CliRunner().invoke(app, [*words, "--again", "calibration", "--until", "calibration"])
    assert repeated.exit_code == 0, repeated.output
    assert load_motors(str(out / DRIVES_FILE)) == drives
    undeclared = {"transmission": drawn.transmission, "imu": drawn.imu}
    assert read_robot(str(out / ROBOT_FILE)) == robot.model_copy(update=undeclared)
