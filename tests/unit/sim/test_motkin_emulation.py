# SPDX-License-Identifier: Apache-2.0
"""The emulated board on a pseudo-terminal, with the bench's own driver from PyPI as its client."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from motkin_pcb import MotorUsbController
from motkin_pcb.protocol import FAULT_CAUSES, STATE_FRAME, decode_state, encode_command
from served_board import DEADLINE, Served, made, wait_for

from fivebar_motkin_emulation.board import EmulatedBoard
from fivebar_motkin_emulation.protocol import CAUSES, STATE_LENGTH, CommandReader

pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
"""The driver's reading thread dies with its port, and says so."""

COUNT = 2.0 * math.pi / 16384
ZERO = (0.0,) * 5


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    board = Served(made(tmp_path, button_s=0.0))
    yield board
    board.close()


@pytest.fixture
def client(served: Served, tmp_path: Path) -> Iterator[MotorUsbController]:
    with MotorUsbController(tmp_path / "board", timeout_ms=10_000, max_command_rate_hz=0.0) as controller:
        yield controller


def push(client: MotorUsbController, first: float, second: float) -> dict[str, Any]:
    """Command two currents (A) and return the state in which the command found the board."""
    client.m0.set(iff=first)
    client.m1.set(iff=second)
    return dict(client.update(block=True, timeout_s=DEADLINE))


def test_the_driver_reads_what_the_board_measures(served: Served, client: MotorUsbController) -> None:
    state = client.initialize(timeout_s=DEADLINE)
    assert state["flags"] == 3
    (q11, _, q21, _), _ = served.board.plant.seen()
    # clockwise from north, rounded down to a count there
    for angle, joint in ((client.m0.q, q11), (client.m1.q, q21)):
        assert 0.0 <= math.pi / 2 - joint - angle < COUNT + 1e-6
    before = push(client, 0.3, -0.3)
    assert before["m0_i"] == before["m0_i_target"] == 0.0
    after = push(client, 0.3, -0.3)
    assert after["t_us"] - before["t_us"] == 2000
    assert after["sequence"] - before["sequence"] == 1
    # after 2 ms a loop of 300 Hz has all but exp(-3.8) of its target
    assert after["m0_i"] == pytest.approx(0.3 * (1.0 - math.exp(-2.0 * math.pi * 300.0 * 2e-3)), rel=1e-5)
    assert after["m1_i_target"] == pytest.approx(-0.3)
    for _ in range(5):
        moved = push(client, 0.3, -0.3)
    # the board's angle follows the sign of its current
    assert moved["m0_q"] > after["m0_q"]
    assert moved["m1_q"] < after["m1_q"]
    assert 0.0 < moved["m0_v"] < moved["m0_v_highfrequency"]


def test_the_board_limits_the_current_and_runs_its_own_gains(served: Served, client: MotorUsbController) -> None:
    client.initialize(timeout_s=DEADLINE)
    push(client, 50.0, -50.0)
    state = push(client, 0.0, 0.0)
    assert (state["m0_i_target"], state["m1_i_target"]) == (3.0, -3.0)
    # stiff enough to pull motor 1 towards its target, while the other has no current
    start = client.m0.q
    client.m0.set(q=start + 0.05, v=0.0, kp=4.0, kd=0.01)
    for _ in range(60):
        state = push(client, 0.0, 0.0)
    assert state["m0_q"] - start == pytest.approx(0.05, abs=0.02)
    client.m0.set(kp=0.0, kd=0.0, enabled=False)
    client.m1.set(enabled=False)
    client.update(block=True, timeout_s=DEADLINE)
    state = client.update(block=True, timeout_s=DEADLINE)
    assert state["m0_i_target"] == state["m1_i_target"] == 0.0


def test_without_commands_the_watchdog_takes_the_current(served: Served, client: MotorUsbController) -> None:
    client.initialize(timeout_s=DEADLINE)
    push(client, 0.3, 0.3)
    assert push(client, 0.3, 0.3)["m0_i_target"] == pytest.approx(0.3)
    client.timeout_ms = 30
    push(client, 0.3, 0.3)
    wait_for(lambda: client.poll()["m0_i_target"] == client.poll()["m1_i_target"] == 0.0)
    assert abs(client.m0.i) < 0.3


@pytest.mark.parametrize("cause", range(10))
def test_the_driver_names_each_fault(served: Served, client: MotorUsbController, cause: int) -> None:
    client.initialize(timeout_s=DEADLINE)
    push(client, 0.3, 0.3)
    served.order(f"fault {cause}")
    with pytest.raises(RuntimeError) as caught:
        for _ in range(3):
            push(client, 0.3, 0.3)
    assert FAULT_CAUSES[cause] in str(caught.value)
    assert cause in CAUSES
    wait_for(lambda: served.board.motors[0].state.target == 0.0)


def test_a_button_held_again_ends_its_fault_and_a_reset_ends_any(served: Served, tmp_path: Path) -> None:
    def flags() -> int:
        with MotorUsbController(tmp_path / "board", timeout_ms=10_000) as client:
            try:
                return int(client.initialize(timeout_s=DEADLINE)["flags"])
            except RuntimeError:
                return int(client.ready_flags)

    served.order("button press", "button release")
    assert flags() == 3 | 4 | 9 << 3
    served.order("button hold")
    wait_for(lambda: served.board.flags == 3)
    assert flags() == 3
    served.order("fault 5")
    assert flags() == 3 | 4 | 5 << 3
    served.order("reset")
    assert flags() == 3
    served.order("unready 2")
    assert flags() == 1


def test_what_is_lost_or_damaged_is_counted_and_not_obeyed(served: Served, client: MotorUsbController) -> None:
    client.initialize(timeout_s=DEADLINE)
    # with a watchdog that lasts, so that no state comes unasked
    push(client, 0.0, 0.0)
    drops = client.state_drops
    served.order("drop 2")
    for _ in range(2):
        with pytest.raises(TimeoutError):
            client.update(block=True, timeout_s=0.05)
    served.order("corrupt 1")
    with pytest.raises(TimeoutError):
        client.update(block=True, timeout_s=0.05)
    client.update(block=True, timeout_s=DEADLINE)
    assert client.state_drops - drops >= 3
    # what no command is, what is cut short and what is damaged: the next command is read all the same
    command = encode_command(7, 3, 100, ZERO, ZERO)
    reader = CommandReader()
    damaged = bytearray(command)
    damaged[20] ^= 1
    infinite = encode_command(8, 3, 100, (math.inf, *ZERO[1:]), ZERO)
    noise = b"\xa5\xa5\x5aC\x02" + bytes(damaged) + infinite + command[:30]
    read = reader.read(noise)
    for one in command:
        read += reader.read(bytes((one,)))
    assert [(one.number, one.enabled, one.timeout_ms) for one in read] == [(7, 3, 100)]
    assert reader.refused == 2


def test_a_torn_cable_ends_the_client_and_a_new_one_finds_the_board(served: Served, tmp_path: Path) -> None:
    client = MotorUsbController(tmp_path / "board", timeout_ms=10_000)
    client.open()
    client.initialize(timeout_s=DEADLINE)
    served.order("unplug")
    with pytest.raises((OSError, TimeoutError)):
        for _ in range(3):
            client.update(block=True, timeout_s=0.1)
    with pytest.raises(OSError):
        client.close()
    served.order("plug")
    with MotorUsbController(tmp_path / "board", timeout_ms=10_000) as again:
        assert again.initialize(timeout_s=DEADLINE)["flags"] == 3


def test_with_the_clock_states_come_unasked(tmp_path: Path) -> None:
    """The board's own time, without a port and without waiting."""
    board = EmulatedBoard(made(tmp_path, pace="clock"), 100.0)
    stream = board.tend(100.0205)
    states = [decode_state(stream[at : at + STATE_LENGTH]) for at in range(0, len(stream), STATE_LENGTH)]
    assert STATE_FRAME.size == STATE_LENGTH
    assert [state["t_us"] for state in states] == [1000 * tick for tick in range(1, 21)]
    answer = b"".join(board.take(encode_command(5, 3, 20, (0.0, 0.0, 0.5, 0.0, 0.0), ZERO), 100.0205))
    assert answer == b""
    told = decode_state(board.tend(100.0215)[:STATE_LENGTH])
    assert (told["latest_command_index"], told["m0_i_target"]) == (5, 0.5)
    # 20 ms later the watchdog takes the current
    late = board.tend(100.0420)
    assert decode_state(late[-STATE_LENGTH:])["m0_i_target"] == 0.0
    assert struct.unpack_from("<H", late, 5) == (22,)
