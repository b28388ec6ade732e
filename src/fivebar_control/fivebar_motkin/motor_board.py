# SPDX-License-Identifier: Apache-2.0
"""The motor board of the MOTKIN bench as two drives, through its own driver from PyPI.

Torque is fed forward as a current. Both of the board's own gains are zero unless there is an inner loop.
"""

from __future__ import annotations

import contextlib
import math
import time
from typing import Any, NamedTuple

from motkin_pcb import MotorUsbController

from fivebar_control.fault import Fault
from fivebar_control.hardware.configuration import MICROSECONDS, USUAL_MISSING
from fivebar_control.hardware.cycle_pace import CyclePace
from fivebar_control.hardware.drive_connection import DriveConnection
from fivebar_control.hardware.drive_interface import (
    ZERO,
    DriveReading,
    Exchange,
    JointTarget,
    Torques,
    set_up_or_closed,
)
from fivebar_control.hardware.fault import DriveError
from fivebar_control.hardware.inner_loop import OPEN, LoopTargets, MotorSetPoint, away_from_jump, set_point
from fivebar_motkin.board_faults import fault_of
from fivebar_motkin.board_file import BoardFile, load_board
from fivebar_motkin.board_units import current_limit, joint_angle, joint_torque, motor_current
from fivebar_motkin.sample_clock import SampleClock

LAST_WORDS, MOST_UNANSWERED = 3, 60
"""Frames that are sent to a board that does not answer any more, once that is a fault, and at most in all: the driver's
write has no timeout, and a port that nobody reads takes some 4000 bytes."""

TEND_PERIOD = 0.1
"""Period (s) in which the board is tended, which needs nothing."""

SETTLE_PERIODS = 3
"""Cycles at zero torque in which the board must answer before it counts as enabled."""


class BoardCounters(NamedTuple):
    """State frames that were lost on the way, commands without an echo in time, and cycles without a new state."""

    lost: int
    unanswered: int
    without_state: int


class MotorBoard:
    """The board as a `DriveInterface`. Its power stage follows the enabled bits of the commands.

    A command is sent by every `exchange`, which waits for its echo: the state that comes with it was measured as the
    command found the board, so that a torque acts from its exchange on, as with drives on a bus. The board's own
    watchdog takes the current when no command comes.
    """

    def __init__(self, board: BoardFile) -> None:
        """Open the port.

        Raises:
            DriveError: it cannot be opened.
        """
        self._board = board
        self._clock = SampleClock(board.period_us)
        self._pace = CyclePace(board.period_us / MICROSECONDS)
        self._enabled = False
        self._torques: Torques = ZERO
        self._target: JointTarget | None = None
        self._sequence: int | None = None
        self._silent = 0
        self._lost = self._unanswered = self._without_state = 0
        self._link_fault: Fault | None = None
        self._refusal = ""
        self._near = self._first_guess()
        self.notes: list[str] = []
        """Nothing so far that the operator would have to know."""
        self._client = self._made()
        self._open()

    @property
    def enabled(self) -> bool:
        """Whether both motors have been enabled and nothing has stopped them since."""
        return self._enabled

    @property
    def counters(self) -> BoardCounters:
        """Counts of what did not arrive so far."""
        return BoardCounters(self._lost + self._client.state_drops, self._unanswered, self._without_state)

    @property
    def unused(self) -> tuple[tuple[str, int], ...]:
        """The same by name."""
        return tuple(zip(BoardCounters._fields, self.counters, strict=True))

    def set_up(self) -> None:
        """Wait until the board echoes a command without current, and check that nothing is wrong with it.

        Raises:
            DriveError: it does not answer, or reports a fault.
        """
        patience = self._board.set_up_timeout_ms
        echoed = self._send(wait=patience / 1e3)
        state = self._client.state
        fault = fault_of(state["flags"]) if state else self._link_fault
        if fault is None and not echoed:
            fault = Fault("board_missing", f"{self._board.port}: no answer in {patience} ms")
        if fault is not None:
            raise DriveError(fault)

    def tend(self) -> None:
        """Keep the board waiting: without commands its watchdog holds both currents at zero."""

    def confirm_start(self, timeout: float) -> None:
        """Confirm that both encoders read the declared posture.

        Raises:
            DriveError: a fault, another posture than the declared one, or no answer within `timeout` (s).
        """
        # of all turns, the one of the declared posture: what the encoders have followed until now does not count
        self._near = self._first_guess()
        self._await_answers(timeout)
        if self._board.posture is not None:
            self._board.posture.confirm(self._near, "calibrate the encoders' zero")

    def enable(self, timeout: float) -> None:
        """Enable both motors at zero torque.

        Raises:
            DriveError: a fault, or no answer within `timeout` (s).
        """
        self._await_answers(timeout)
        self._enabled = True

    def _await_answers(self, timeout: float) -> None:
        self._clock.begin()
        end, answered = time.monotonic() + timeout, 0
        while answered < SETTLE_PERIODS:
            exchange = self.exchange_paced()
            if exchange.fault is not None:
                raise DriveError(exchange.fault)
            answered = answered + 1 if exchange.complete else 0
            if time.monotonic() > end:
                raise DriveError(Fault("board_missing", f"{self._board.port}: no steady answers in {timeout:g} s"))

    def disable(self, timeout: float) -> None:
        """Command zero torque, then take both enabled bits back.

        Raises:
            DriveError: the port is gone; the board's watchdog takes the current.
        """
        self.write(ZERO)
        self.exchange()
        self._enabled = False
        fault = self.exchange().fault
        if fault is not None:
            raise DriveError(fault)

    def switch_off(self) -> None:
        """Take both enabled bits back with a frame that is sent now."""
        self._enabled = False
        self._write_zero()
        self._send()

    def quick_stop(self) -> None:
        """Take both enabled bits back with a frame that is sent now: without current the robot coasts."""
        self.switch_off()

    def write(self, torques: Torques, target: JointTarget | None = None) -> None:
        """Keep torques (Nm) and target for the next exchange; zero and none unless both motors are enabled.

        Raises:
            ValueError: a torque is not finite; zero is kept instead.
        """
        self._write_zero()
        if not all(math.isfinite(torque) for torque in torques):
            raise ValueError(f"torques {torques} Nm: expected finite numbers")
        if self._enabled:
            self._torques, self._target = torques, target

    def _write_zero(self) -> None:
        self._torques, self._target = ZERO, None

    def exchange(self) -> Exchange:
        """Send the command and take the state that comes with its echo, or else the newest since the last cycle."""
        self._send(wait=self._board.gather_time)
        state = dict(self._client.state)
        fresh = bool(state) and state["sequence"] != self._sequence
        limit = self._board.most_missing
        if not fresh:
            self._silent += self._board.patience
            self._without_state += 1
            fault = self._link_fault
            if fault is None and self._silent > limit:
                fault = Fault("feedback_missing", f"{self._board.port}: no state in {self._silent} cycles in a row")
            return self._judged(Exchange((None, None), fault, periods=0))
        self._silent, self._sequence = 0, state["sequence"]
        fault = fault_of(state["flags"]) or self._link_fault
        behind = (self._client.command_index - 1 - state["latest_command_index"]) % (1 << 32)
        if fault is None and (self._refusal or behind > limit):
            detail = self._refusal or f"the state echoes the command before the last {behind}"
            fault = Fault("command_lost", f"{self._board.port}: {detail}")
        return self._judged(Exchange(self._readings(state), fault, self._clock.periods(state["t_us"])))

    def exchange_paced(self) -> Exchange:
        """Wait for the next period, then exchange without torque: a cycle without a control law."""
        self._pace.wait()
        self._write_zero()
        return self.exchange()

    def reset(self, timeout: float) -> None:
        """Open the port anew, which clears what was latched on this side; the motors stay off.

        Raises:
            DriveError: the board still reports a fault, or does not answer; the text says what clears it.
        """
        self._enabled = False
        self._write_zero()
        self._lost += self._client.state_drops
        self._shut()
        self._link_fault, self._refusal = None, ""
        self._silent = 0
        self._sequence = None
        self._clock.begin()
        self._client = self._made()
        self._open()
        self.set_up()

    def release(self) -> None:
        """Command zero current without an enabled motor."""
        self.switch_off()

    def close(self) -> None:
        """Close the port."""
        self._shut()

    def _made(self) -> Any:
        return MotorUsbController(self._board.port, timeout_ms=self._board.watchdog_ms, max_command_rate_hz=0.0)

    def _open(self) -> None:
        try:
            self._client.open()
        except OSError as error:
            self._link_fault = Fault("port_missing", f"{self._board.port}: {error}")
            raise DriveError(self._link_fault) from error

    def _shut(self) -> None:
        # the driver sends a last frame, which a torn cable does not take, and closes the port all the same
        with contextlib.suppress(OSError):
            self._client.close()

    def _judged(self, exchange: Exchange) -> Exchange:
        """Stop the motors for a fault."""
        if exchange.fault is not None and self._enabled:
            self.switch_off()
        return exchange

    def _send(self, wait: float = 0.0) -> bool:
        """Send a command, and wait for its echo for a time (s); return whether it has come."""
        if self._link_fault is not None or self._silent > min(self._board.most_missing + LAST_WORDS, MOST_UNANSWERED):
            return False
        for number, (motor, torque) in enumerate(zip((self._client.m0, self._client.m1), self._torques, strict=True)):
            current = motor_current(self._board.pair[number], torque)
            kp, kd, angle, speed = self._set_point(number, current)
            motor.set(q=angle, v=speed, kp=kp, kd=kd, iff=current, enabled=self._enabled)
        try:
            self._client.update(block=wait > 0.0, timeout_s=wait)
        except TimeoutError:
            self._unanswered += 1
        except OSError as error:
            self._link_fault = Fault("board_lost", f"{self._board.port}: {error}")
        except RuntimeError as error:
            # the driver sends nothing any more after a fault, until it is made anew; the state names the cause
            self._refusal = f"the driver sends nothing: {error}"
        else:
            return wait > 0.0
        return False

    def _set_point(self, number: int, current: float) -> MotorSetPoint:
        """Return the inner loop of a motor for the current (A) of the law's torque."""
        state, target, drive = self._client.state, self._target, self._board.pair[number]
        if target is None or not state:
            return OPEN
        reading = state[f"m{number}_q"]
        # the turn on which the robot is makes no difference to the board
        missing = math.remainder(target.positions[number] - joint_angle(drive, reading, self._near[number]), math.tau)
        angle = reading, reading + drive.sign * missing
        speed = state[f"m{number}_v"], drive.sign * target.velocities[number]
        weight = target.weight * away_from_jump(reading)
        return set_point(self._board.inner_loop, current_limit(drive), current, weight, angle, speed)

    def _readings(self, state: dict[str, Any]) -> tuple[DriveReading, DriveReading]:
        first, second = (
            self._reading(number, state[f"m{number}_q"], state[f"m{number}_v_highfrequency"], state[f"m{number}_i"])
            for number in range(2)
        )
        self._near = first.position, second.position
        return first, second

    def _reading(self, number: int, angle: float, speed: float, current: float) -> DriveReading:
        drive = self._board.pair[number]
        return DriveReading(
            joint_angle(drive, angle, self._near[number]), drive.sign * speed, joint_torque(drive, current)
        )

    def _first_guess(self) -> tuple[float, float]:
        """Joint angles (rad) within half a turn of which the first readings lie."""
        posture = self._board.posture
        if posture is not None:
            return posture.q11, posture.q21
        first, second = self._board.pair
        return first.zero_rad, second.zero_rad


def open_board(board: BoardFile) -> MotorBoard:
    """Open the port and find the board, whose motors stay without current.

    Raises:
        DriveError: the port cannot be opened, or the board is silent or reports a fault; the port is closed then.
    """
    return set_up_or_closed(MotorBoard(board))


def connect(configuration: str) -> DriveConnection:
    """Return the board of a configuration, given by name or path.

    Raises:
        InputError: the file is missing or not a configuration, or its robot's file is.
    """
    board = load_board(configuration)

    def opening(missing: int = USUAL_MISSING) -> MotorBoard:
        return open_board(board.bearing(missing))

    loop = board.inner_loop
    inner_loop = LoopTargets(loop, board.period_us).target if loop.on else None
    return DriveConnection(board.period_us, "period_us", TEND_PERIOD, opening, board.paced_by_commands, inner_loop)
