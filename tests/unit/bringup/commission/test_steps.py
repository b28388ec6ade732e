# SPDX-License-Identifier: Apache-2.0
"""The steps of a commissioning with drives alone: what they find and correct, and how they end."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from toy_bench import FRICTION, ToyBench

from fivebar_commission.record import STATE_FILE, CommissionState, resumed
from fivebar_commission.session import DRIVES_FILE, ROBOT_FILE, Session
from fivebar_commission.steps.assessment import study_folder
from fivebar_commission.steps.sequence import Ended, commission
from fivebar_control.fault import Fault
from fivebar_description.robot_file import read_robot
from fivebar_description.strict_yaml import InputError, load_yaml, yaml_text
from fivebar_description.transmission import Transmission
from fivebar_studies.assess.assess import ASSESSMENT, QUICK
from fivebar_studies.engine.directory import opened

LAST = "zero"
"""The last step that needs no more than drives."""

STATE = CommissionState(robot="dextar", drives="toy", torque_nm=2.0, speed_rad_s=5.0)

Spoil = Callable[[ToyBench], Any]


def session_of(folder: Path, spoil: Spoil = lambda bench: None) -> tuple[Session, ToyBench]:
    """A session in a folder, which resumes what is there, on a bench that has been changed."""
    bench = ToyBench("dextar")
    spoil(bench)
    state = resumed(folder, STATE)
    folder.mkdir(exist_ok=True)
    if not (folder / ROBOT_FILE).exists():
        file = read_robot("dextar").model_dump(mode="json", exclude_none=True)
        (folder / ROBOT_FILE).write_text(yaml_text(file))
        motors = {
            joint: {"id": number, "counts_per_revolution": 20000, "torque_limit_nm": 3.0}
            for number, joint in enumerate(("q11", "q21"))
        }
        (folder / DRIVES_FILE).write_text(yaml_text({"name": "toy", "interface": "toy", "motors": motors}))
    state.write(folder)
    return Session(folder, state, bench, bench, lambda words: None), bench


def commissioned(folder: Path, spoil: Spoil = lambda bench: None) -> tuple[Ended, Session, ToyBench]:
    session, bench = session_of(folder, spoil)
    return commission(session, LAST), session, bench


def reversed_motor(bench: ToyBench) -> None:
    bench.motors.signs = [1, -1]


def test_declared_soft_transmissions_let_the_encoders_differ_from_the_links(tmp_path: Path) -> None:
    session, _ = session_of(tmp_path / "new")
    waypoints = [session.robot.home_m, session.robot.home_m]
    assert session.scenario("rest", waypoints=waypoints).ekf.play == 0.0
    soft = Transmission(frequency=60.0, backlash=1e-3)
    session.learn_robot(session.robot.model_copy(update={"transmission": soft}))
    assert session.scenario("rest", waypoints=waypoints).ekf.play == pytest.approx(5e-3)


def test_an_interrupted_assessment_resumes_unless_it_is_finished_or_the_robot_has_changed(tmp_path: Path) -> None:
    session, _ = session_of(tmp_path / "new")

    def folder() -> Path:
        return study_folder(session, ASSESSMENT, {"robot": str(session.robot_path), **QUICK})

    def begin(path: Path) -> Path:
        return opened(ASSESSMENT, path, {"robot": str(session.robot_path), **QUICK})[0].directory.page

    first = folder()
    assert first.name == "assess_1" and not first.exists()
    page = begin(first)
    assert folder() == first
    page.write_text("finished")
    second = folder()
    assert second.name == "assess_2"
    begin(second)
    assert folder() == second
    robot = session.robot
    session.learn_robot(robot.model_copy(update={"friction": robot.friction.model_copy(update={"f_s11": 0.6})}))
    assert folder().name == "assess_3"


def test_drives_are_corrected_and_zeros_set_and_no_torque_is_left(tmp_path: Path) -> None:
    ended, session, bench = commissioned(tmp_path / "new", reversed_motor)
    assert ended.passed
    motors = load_yaml(session.drives_path)["motors"]  # type: ignore[index]
    assert (motors["q11"]["sign"], motors["q21"]["sign"]) == (1, -1)
    # a motor that counts the other way round reads the upper edge of a count
    assert motors["q11"]["zero_rad"] == pytest.approx(bench.motors.zeros[0], abs=1e-9)
    assert motors["q21"]["zero_rad"] == pytest.approx(bench.motors.zeros[1] + math.tau / 20000, abs=1e-9)
    friction = session.robot.friction
    assert friction.f_s11 == pytest.approx(FRICTION, rel=0.05)
    assert friction.f_s21 == pytest.approx(FRICTION, rel=0.05)
    assert abs(friction.f_off11) < 0.01
    # the torque that moves a motor is all that it ever gets
    assert FRICTION < bench.motors.largest < 1.15 * FRICTION
    assert bench.motors.torques == [0.0, 0.0]
    assert not bench.motors.powered
    assert bench.drives is not None
    assert bench.drives.closed
    page = (session.folder / "commission.html").read_text()
    assert "sign reversed" in page
    assert f"{bench.asked} questions" in page
    assert bench.asked == 5


@pytest.mark.parametrize(
    ("spoil", "step", "reason"),
    [
        (lambda bench: setattr(bench.motors, "torque_signs", [1, -1]), "breakaway", "runs_away: q21"),
        (lambda bench: setattr(bench.motors, "factors", [1.6, 1.0]), "signs", "wrong_scale: q11 reads 32.0"),
        (lambda bench: setattr(bench.motors, "factors", [0.0, 1.0]), "signs", "encoder_silent: q11"),
        (lambda bench: setattr(bench.motors, "fault", Fault("drive_lost", "no heartbeat")), "parts", "drive_lost"),
        (lambda bench: setattr(bench, "agrees", lambda key, question: False), "parts", "no_emergency_stop"),
    ],
    ids=["wired_in_reverse", "no_known_gear", "dead_encoder", "lost_drive", "no_emergency_stop"],
)
def test_a_gate_stays_closed_for_its_reason(tmp_path: Path, spoil: Spoil, step: str, reason: str) -> None:
    ended, session, bench = commissioned(tmp_path / "new", spoil)
    assert not ended.passed
    assert session.state.steps[-1].step == step
    assert session.state.steps[-1].outcome == "closed"
    assert session.state.steps[-1].words.startswith(reason)
    assert reason.partition(":")[0] in (session.folder / "commission.html").read_text()
    assert bench.motors.torques == [0.0, 0.0]
    assert not bench.motors.powered
    # once the cause is gone the same directory goes on
    assert commissioned(session.folder)[0].passed


@pytest.mark.parametrize(("late", "tried"), [(1, 2), (2, 3), (3, 3)])
def test_a_step_that_late_samples_have_ended_is_begun_again_where_the_person_agrees(
    tmp_path: Path, late: int, tried: int
) -> None:
    asked = list[str]()

    def spoil(bench: ToyBench) -> None:
        bench.motors.fault = Fault("odrive_error", "q11 (node 0): WATCHDOG_TIMER_EXPIRED, MISSING_INPUT")

        def agrees(key: str, question: str) -> bool:
            asked.append(key)
            if asked.count("parts.again") == late:
                bench.motors.fault = None
            return True

        bench.agrees = agrees  # type: ignore[method-assign]

    ended, session, bench = commissioned(tmp_path / "new", spoil)
    assert asked.count("parts.again") == tried - 1
    assert asked.count("parts.emergency_stop") == tried
    assert ended.passed is (late < tried)
    first = session.state.steps[0]
    if ended.passed:
        again = first.figures["begun again after"]
        assert again == ["odrive_error: q11 (node 0): WATCHDOG_TIMER_EXPIRED, MISSING_INPUT"] * late
    else:
        assert first.words.startswith("odrive_error: q11")
    assert bench.motors.torques == [0.0, 0.0]


def test_a_step_is_not_begun_again_without_an_agreement_nor_for_another_fault(tmp_path: Path) -> None:
    def refusing(bench: ToyBench) -> None:
        bench.motors.fault = Fault("feedback_missing", "q11 (id 0): no answer in 9 cycles in a row")
        bench.agrees = lambda key, question: not key.endswith(".again")  # type: ignore[method-assign]

    ended, session, _ = commissioned(tmp_path / "refused", refusing)
    assert not ended.passed
    assert session.state.steps[0].words.startswith("feedback_missing: q11 (id 0)")
    lost = Fault("drive_lost", "q11 (node 1): no heartbeat")
    ended, _, bench = commissioned(tmp_path / "lost", lambda bench: setattr(bench.motors, "fault", lost))
    assert not ended.passed
    # for the emergency stop alone
    assert bench.asked == 1


def test_a_gear_that_is_four_times_too_low_and_exchanged_motors_are_put_right(tmp_path: Path) -> None:
    def spoil(bench: ToyBench) -> None:
        bench.motors.factors = [4.0, 1.0]
        bench.motors.exchanged = True

    ended, session, _ = commissioned(tmp_path / "new", spoil)
    assert ended.passed
    motors = load_yaml(session.drives_path)["motors"]  # type: ignore[index]
    assert [(motors[joint]["id"], motors[joint]["gear_ratio"]) for joint in ("q11", "q21")] == [(1, 4.0), (0, 1.0)]


def test_a_motor_that_is_held_gets_half_of_the_allowed_torque_and_no_more(tmp_path: Path) -> None:
    def spoil(bench: ToyBench) -> None:
        bench.motors.advance = lambda: setattr(  # type: ignore[method-assign]
            bench.motors, "largest", max(bench.motors.largest, *map(abs, bench.motors.torques))
        )

    ended, _, bench = commissioned(tmp_path / "new", spoil)
    assert ended.words.endswith("or friction beyond that")
    assert bench.motors.largest == pytest.approx(0.5 * STATE.torque_nm, rel=0.01)


@pytest.mark.extra
def test_an_interrupt_leaves_no_torque_and_no_record_and_the_rest_is_resumed(tmp_path: Path) -> None:
    folder = tmp_path / "new"
    whole = commissioned(tmp_path / "whole", reversed_motor)[2].cycles
    for at in range(7, whole, whole // 5):
        session, bench = session_of(folder, reversed_motor)
        bench.interrupt_at = at
        with pytest.raises(KeyboardInterrupt):
            commission(session, LAST)
        assert bench.motors.torques == [0.0, 0.0]
        assert not bench.motors.powered
        kept = resumed(folder, STATE)
        assert all(one.outcome == "passed" for one in kept.steps)
        (folder / STATE_FILE).unlink(missing_ok=True)
        for path in sorted(folder.rglob("*"), reverse=True):
            path.rmdir() if path.is_dir() else path.unlink()
    session, bench = session_of(folder, reversed_motor)
    assert commission(session, "signs").passed
    before = bench.asked
    ended, session, bench = commissioned(folder, reversed_motor)
    assert ended.passed
    assert (before, bench.asked) == (3, 2)
    assert [one.step for one in session.state.steps] == ["parts", "signs", "breakaway", "zero"]


def test_a_directory_belongs_to_one_robot_and_its_limits(tmp_path: Path) -> None:
    folder = tmp_path / "new"
    assert commissioned(folder)[0].passed
    with pytest.raises(InputError, match=r"torque_nm: was begun with 2\.0, now 3\.0: expected the same"):
        resumed(folder, STATE.model_copy(update={"torque_nm": 3.0}))
    with pytest.raises(InputError, match=r"holds no commission\.yaml: expected a new or empty directory"):
        resumed(folder.parent, STATE)
    assert [one.step for one in resumed(folder, STATE).before("breakaway").steps] == ["parts", "signs"]
