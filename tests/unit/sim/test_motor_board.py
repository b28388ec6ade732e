# SPDX-License-Identifier: Apache-2.0
"""The bridge's side of the motor board, with the driver from PyPI and the emulated board at the other end."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from bench_robot import board_content, robot_file
from served_board import DEADLINE, Served, made, wait_for

from fivebar_control.hardware.drive_interface import ZERO, Exchange, JointTarget
from fivebar_control.hardware.fault import DriveError
from fivebar_motkin.board_faults import CAUSES
from fivebar_motkin.board_file import BoardFile
from fivebar_motkin.motor_board import MotorBoard, open_board
from fivebar_motkin_emulation.port import PseudoPort
from fivebar_motkin_emulation.protocol import CommandFrame, CommandReader, MotorCommand

pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
"""The driver's reading thread dies with its port, and says so."""

MANY = 300

UNHURRIED = {"period_us": 50_000, "gather_deadline_us": 45_000, "watchdog_ms": 3_000}
"""The driver gives a board up after some fifty answers that do not come in time: here after more than two seconds, in
which a loaded machine lets the thread of the board go on."""

PUSH = (0.0003, -0.0003)
"""Less than the friction: the robot creeps, however long the machine stands still."""


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    board = Served(made(tmp_path, button_s=0.0, period_us=UNHURRIED["period_us"]))
    yield board
    board.close()


@pytest.fixture
def board(served: Served, tmp_path: Path) -> Iterator[MotorBoard]:
    opened = open_board(file(tmp_path))
    yield opened
    opened.release()
    opened.close()


def file(folder: Path, **changes: object) -> BoardFile:
    return BoardFile.model_validate(board_content(folder, **{**UNHURRIED, **changes}), strict=False)


def exchanges(board: MotorBoard, torques: tuple[float, float] = ZERO) -> list[Exchange]:
    """Exchange until an echo comes in time, and none is on its way: a machine that stands still is not tested here."""
    done: list[Exchange] = []
    for _ in range(MANY):
        before = board.counters.unanswered
        board.write(torques)
        done.append(board.exchange())
        if done[-1].complete and board.counters.unanswered == before:
            return done
    raise AssertionError("no answer")


def answered(board: MotorBoard, torques: tuple[float, float] = ZERO) -> Exchange:
    return exchanges(board, torques)[-1]


def fault_of(board: MotorBoard) -> str:
    """Exchange until there is a fault, and return its name."""
    for _ in range(MANY):
        fault = board.exchange().fault
        if fault is not None:
            return fault.name
    raise AssertionError("no fault")


def test_torque_goes_through_the_board_and_its_clock_dates_what_comes_back(served: Served, board: MotorBoard) -> None:
    board.write(PUSH)
    assert answered(board).readings[0] is not None
    # without enable no torque gets through
    assert served.board.motors[0].state.target == 0.0
    board.enable(DEADLINE)
    answered(board, PUSH)
    exchange = answered(board, PUSH)
    (q11, _, q21, _), _ = served.emulation.history[-1].truth[:2]
    for reading, truth, torque in zip(exchange.readings, (q11, q21), PUSH, strict=True):
        assert reading is not None
        # the lower edge of the count's interval, in the joint's direction
        assert 0.0 <= truth - reading.position < served.emulation.resolution + 1e-9
        assert reading.torque == pytest.approx(torque, rel=1e-5)
    # two frames are lost: the board's time has gone on meanwhile
    before = served.board.measured
    served.order("drop 2")
    missing = [board.exchange() for _ in range(2)]
    assert [(one.complete, one.periods, one.fault) for one in missing] == [(False, 0, None)] * 2
    assert sum(one.periods for one in exchanges(board, PUSH)) == served.board.measured - before >= 3
    assert board.counters.lost >= 2
    assert board.counters.unanswered >= 2
    with pytest.raises(ValueError, match="finite"):
        board.write((float("nan"), 0.0))
    answered(board)
    board.write((9.0, -9.0))
    board.exchange()
    # the board answers before it obeys
    wait_for(lambda: served.board.motors[0].state.target == pytest.approx(-0.12 / 0.062))
    board.disable(DEADLINE)
    assert not board.enabled
    wait_for(lambda: served.board.motors[0].state.target == 0.0)


def test_the_frame_carries_the_inner_loop_and_none_once_the_motors_are_stopped(
    served: Served, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    frames: list[CommandFrame] = []
    reader, take = CommandReader(), served.board.take

    def recorded(data: bytes, now: float) -> Iterator[bytes]:
        frames.extend(reader.read(data))
        return take(data, now)

    monkeypatch.setattr(served.board, "take", recorded)
    opened = open_board(
        file(tmp_path, inner_loop={"stiffness": 2.0, "damping": 0.02, "robot": str(robot_file(tmp_path))})
    )
    (q11, _, q21, _), _ = served.board.plant.seen()
    target = JointTarget(0.5, (q11 + 0.01, q21 - 0.01 + math.tau), (0.1, -0.1))

    def sent(target: JointTarget | None) -> tuple[MotorCommand, MotorCommand]:
        opened.write(PUSH, target)
        before = len(frames)
        opened.exchange()
        wait_for(lambda: len(frames) > before)
        return frames[-1].motors

    off = [(0.0,) * 5] * 2
    assert [tuple(one._replace(current=0.0)) for one in sent(target)] == off
    opened.enable(DEADLINE)
    for motor, joint, step, torque in zip(sent(target), (q11, q21), (0.01, -0.01), PUSH, strict=True):
        # the board counts clockwise from the north; what it is fed forward is the torque as without an inner loop
        assert (motor.kp, motor.kd) == pytest.approx((1.0, 0.01))
        assert motor.angle == pytest.approx(math.pi / 2 - joint - step, abs=2e-3)
        assert motor.speed == pytest.approx(-10.0 * step)
        assert motor.current == pytest.approx(-torque / 0.062)
    assert [tuple(one._replace(current=0.0)) for one in sent(None)] == off
    sent(target)
    opened.quick_stop()
    wait_for(lambda: frames[-1].enabled == 0)
    assert [tuple(one) for one in frames[-1].motors] == off
    assert [tuple(one) for one in sent(target)] == off
    opened.close()


@pytest.mark.extra
@pytest.mark.parametrize("cause", sorted(CAUSES))
def test_each_fault_is_named_and_cleared_as_it_says(served: Served, board: MotorBoard, cause: int) -> None:
    board.enable(DEADLINE)
    answered(board, PUSH)
    served.order(f"fault {cause}")
    assert fault_of(board) == CAUSES[cause][0]
    assert not board.enabled
    wait_for(lambda: served.board.motors[0].state.target == 0.0)
    with pytest.raises(DriveError, match="release the button" if cause == 9 else "reset the board"):
        board.reset(DEADLINE)
    served.order("button hold" if cause == 9 else "reset", "home")
    wait_for(lambda: served.board.flags == 3)
    board.reset(DEADLINE)
    assert not board.enabled
    board.enable(DEADLINE)
    answered(board, PUSH)
    wait_for(lambda: served.board.motors[0].state.target != 0.0)


@pytest.mark.parametrize("cycles", [0, 1, 2, 20, 60])
def test_a_fault_takes_the_current_at_any_moment(served: Served, board: MotorBoard, cycles: int) -> None:
    """By the driver of the motors, which also under-voltage trips."""
    board.enable(DEADLINE)
    for _ in range(cycles):
        answered(board, PUSH)
    served.order("fault 1")
    assert fault_of(board) == "board_driver"
    assert not board.enabled
    wait_for(lambda: [motor.state.target for motor in served.board.motors] == [0.0, 0.0])


def test_a_motor_that_is_not_calibrated_gets_no_current(served: Served, tmp_path: Path) -> None:
    served.order("unready 1")
    with pytest.raises(DriveError, match="motors_not_ready: q11: the board's saved calibration"):
        open_board(file(tmp_path))
    assert [motor.state.target for motor in served.board.motors] == [0.0, 0.0]


@pytest.mark.extra
@pytest.mark.parametrize(
    ("order", "name"),
    [("silent", "feedback_missing"), ("ignore 1000000", "feedback_missing"), ("unready 2", "motors_not_ready")],
)
def test_what_is_lost_and_a_motor_that_is_not_ready_are_named(
    served: Served, board: MotorBoard, order: str, name: str
) -> None:
    board.enable(DEADLINE)
    answered(board, PUSH)
    served.order(order)
    assert fault_of(board) == name
    wait_for(lambda: served.board.motors[0].state.target == 0.0)
    served.order("mend", "ignore 0", "ready 2")
    board.reset(DEADLINE)


def test_a_torn_cable_is_named_and_its_end_found_by_a_reset(served: Served, board: MotorBoard) -> None:
    board.enable(DEADLINE)
    answered(board, PUSH)
    served.order("unplug")
    assert fault_of(board) == "board_lost"
    wait_for(lambda: served.board.motors[0].state.target == 0.0)
    with pytest.raises(DriveError, match="port_missing"):
        board.reset(DEADLINE)
    assert not board.exchange().complete
    served.order("plug", "home")
    board.reset(DEADLINE)
    board.enable(DEADLINE)
    answered(board, PUSH)


def test_a_run_starts_where_the_robot_is_said_to_stand(served: Served, tmp_path: Path) -> None:
    declared = file(tmp_path).posture
    assert declared is not None
    elsewhere = {"q11": declared.q11 + 0.1, "q21": declared.q21}
    board = open_board(file(tmp_path, posture=elsewhere))
    with pytest.raises(DriveError, match=r"posture_unconfirmed: q11 reads 2\.\d+ rad, declared"):
        board.confirm_start(DEADLINE)
    assert not board.enabled
    board.close()
    # wired the other way round, or with exchanged motors
    reversed_motor = {"q11": {"torque_limit_nm": 0.12, "sign": 1}, "q21": {"torque_limit_nm": 0.12}}
    exchanged = {"q11": declared.q21, "q21": declared.q11}
    for wrong in ({"motors": reversed_motor}, {"posture": exchanged}):
        board = open_board(file(tmp_path, **wrong))
        with pytest.raises(DriveError, match="posture_unconfirmed"):
            board.confirm_start(DEADLINE)
        assert not board.enabled
        board.close()
    # a board whose crank has gone round in between, as far as was seen
    once_round = {"q11": declared.q11 + 6.283185307179586, "q21": declared.q21}
    board = open_board(file(tmp_path, posture=once_round))
    board.confirm_start(DEADLINE)
    board.close()


def test_without_a_port_or_a_board_the_reason_is_told(served: Served, tmp_path: Path) -> None:
    with pytest.raises(DriveError, match="port_missing"):
        open_board(file(tmp_path, port=str(tmp_path / "elsewhere")))
    served.order("silent")
    with pytest.raises(DriveError, match="board_missing"):
        open_board(file(tmp_path, set_up_timeout_ms=50))


def test_firmware_with_another_protocol_is_no_board(tmp_path: Path) -> None:
    """A device on the port that talks, but not in the frames of the bench's firmware."""
    port = PseudoPort(tmp_path / "board")
    for _ in range(40):
        port.write(b"\x55firmware of another version\r\n")
    with pytest.raises(DriveError, match=f"board_missing: {tmp_path / 'board'}: no answer in 50 ms"):
        open_board(file(tmp_path, set_up_timeout_ms=50))
    port.unplug()


def test_a_board_that_tells_states_but_hears_nothing_is_named(tmp_path: Path) -> None:
    served = Served(made(tmp_path, pace="clock"))
    board = open_board(file(tmp_path))
    served.order("ignore 1000000")
    assert fault_of(board) == "command_lost"
    board.close()
    served.close()
