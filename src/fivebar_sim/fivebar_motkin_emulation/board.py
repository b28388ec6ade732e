# SPDX-License-Identifier: Apache-2.0
"""The emulated board and the robot that it moves, without a port: bytes in, bytes out.

Times are seconds of a steady clock, given by the caller.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator

from fivebar_description.motors_file import BY_THE_CLOCK
from fivebar_motkin_emulation.configuration import BoardEmulationFile
from fivebar_motkin_emulation.motor import OFF, EmulatedMotor
from fivebar_motkin_emulation.protocol import BUTTON, CommandFrame, CommandReader, StateFrame, fault_flags, write_state
from fivebar_sim.emulated_hardware import HISTORY, MeasuredRecord
from fivebar_sim.moved_robot import MovedRobot
from fivebar_sim.plant import PlantDiverged

LONGEST_CATCH_UP = 0.25
"""Longest time (s) that is simulated at once, after this process was stopped for a while."""

IDLE_PERIOD = 0.02
"""Period (s) of state frames while commands set the pace and none comes."""

WITHOUT_WATCHDOG = 0.05
"""Time (s) without a command after which the clock sets the pace where no watchdog runs."""

LOOP_US = 40.0
"""Duration (us) of one run of the control that the board reports."""

NOT_FINITE = 7
BOTH = 3


class EmulatedBoard(MovedRobot):
    """Two motors, their current loops and encoders, a watchdog, faults and a button, on the simulated robot."""

    def __init__(self, file: BoardEmulationFile, now: float) -> None:
        """Switch the board on.

        Raises:
            InputError: the robot or its posture cannot be.
        """
        self._file = file
        first, second = file.pair
        self.motors = EmulatedMotor(first, file.tick), EmulatedMotor(second, file.tick)
        self.history: deque[MeasuredRecord] = deque(maxlen=HISTORY)
        """The last measurements, the newest at the end."""
        self.measured = self._ticks = 0
        """Number of measurements reported so far."""
        self.drop = self.corrupt = self.ignore = 0
        """State frames to lose, state frames to corrupt, and command frames to lose from now on."""
        self.silent = False
        """Whether no state frame is sent."""
        super().__init__(file, round(1.0 / file.tick))
        self.reboot(now)

    def go_home(self) -> None:
        """Put the robot into its initial posture, at rest; it keeps its payload.

        Raises:
            InputError: the robot or its posture cannot be.
        """
        super().go_home()
        (q11, _, q21, _), _ = self.plant.seen()
        self.motors[0].place(q11)
        self.motors[1].place(q21)

    def reboot(self, now: float) -> None:
        """Reset the board: faults and commands are cleared, its clock and frame numbers start again at zero."""
        self._reader = CommandReader()
        self._sequence = self._time = 0
        self._command = CommandFrame(0, 0, 0, (OFF, OFF))
        self._commanded_at: float | None = None
        self._clock = self._reported_at = now
        self._cause: int | None = None
        self.ready = BOTH
        """Bit i: motor i is calibrated and has passed its checks."""
        self._button_since: float | None = None
        self._expired = True

    @property
    def periods(self) -> int:
        """Periods since the board was switched on, resets included."""
        return self._ticks // self._file.ticks

    @property
    def flags(self) -> int:
        """The flags of a state frame."""
        return self.ready | (0 if self._cause is None else fault_flags(self._cause))

    def trip(self, cause: int) -> None:
        """Enter a control fault: both currents are zero until the board is reset; the button clears its own fault."""
        self._cause = cause
        self._button_since = None

    def hold_button(self, now: float) -> None:
        """Press the emergency stop button and hold it; pressed again after a release it can clear its own fault."""
        if self._cause == BUTTON:
            self._button_since = now
        else:
            self.trip(BUTTON)

    def release_button(self) -> None:
        """Release the emergency stop button."""
        self._button_since = None

    def take(self, data: bytes, now: float) -> Iterator[bytes]:
        """Take bytes from the port; yield each frame that answers them, and move the robot on once it is taken."""
        for command in self._reader.read(data):
            if self.ignore > 0:
                self.ignore -= 1
                continue
            self._command, self._commanded_at, self._expired = command, now, False
            if self._file.pace != BY_THE_CLOCK:
                # the answer first: the client need not wait for the simulation of the next period
                yield self._report()
                self._reported_at = self._clock = now
                for _ in range(self._file.ticks):
                    self._advance()

    def tend(self, now: float) -> bytes:
        """Do what is due at this time; return the frames to send."""
        if self._button_since is not None and now - self._button_since >= self._file.button_s:
            self._cause = self._button_since = None
        since = None if self._commanded_at is None else now - self._commanded_at
        watchdog = self._command.timeout_ms / 1e3
        self._expired = since is None or (watchdog > 0.0 and since > watchdog)
        if self._file.pace == BY_THE_CLOCK:
            return self._follow_clock(now, self._file.tick)
        if since is not None and since <= (watchdog or WITHOUT_WATCHDOG):
            # the next command, which may be late, moves the robot on
            self._clock = now
            return b""
        return self._follow_clock(now, IDLE_PERIOD)

    def _follow_clock(self, now: float, report_period: float) -> bytes:
        """Move on to the present; return the state frames that are due."""
        states = []
        self._clock = max(self._clock, now - LONGEST_CATCH_UP)
        while self._clock + self._file.tick <= now:
            self._clock += self._file.tick
            self._advance()
            if self._clock - self._reported_at >= report_period * (1.0 - 1e-6):
                self._reported_at = self._clock
                states.append(self._report())
        return b"".join(states)

    def _report(self) -> bytes:
        """Return the state frame; empty or corrupted where that was injected."""
        self._sequence += 1
        self.measured += 1
        first, second = self.motors
        self.history.append(MeasuredRecord(self.measured, (first.joint_angle, second.joint_angle), self.plant.truth()))
        if self.silent or self.drop > 0:
            self.drop = max(0, self.drop - 1)
            return b""
        frame = write_state(
            StateFrame(
                self._sequence, self._time, self._command.number, LOOP_US, (first.state, second.state), self.flags
            )
        )
        if self.corrupt > 0:
            self.corrupt -= 1
            middle = len(frame) // 2
            frame = frame[:middle] + bytes((frame[middle] ^ 0x10,)) + frame[middle + 1 :]
        return frame

    def _advance(self) -> None:
        """Run the control once and move the robot on by one tick."""
        live = self._cause is None and not self._expired
        enabled = self._command.enabled & self.ready if live else 0
        torques = [
            motor.drive(command if enabled & 1 << number else OFF)
            for number, (motor, command) in enumerate(zip(self.motors, self._command.motors, strict=True))
        ]
        self._ticks += 1
        self._time += round(self._file.tick * 1e6)
        try:
            self.move((torques[0], torques[1]))
        except PlantDiverged:
            self.trip(NOT_FINITE)
            return
        (q11, _, q21, _), _ = self.plant.seen()
        if math.isfinite(q11) and math.isfinite(q21):
            self.motors[0].sense(q11)
            self.motors[1].sense(q21)
