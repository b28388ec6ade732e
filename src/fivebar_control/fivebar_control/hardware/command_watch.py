# SPDX-License-Identifier: Apache-2.0
"""Watchdog of the torque command: which one is in force, and whether it is stale."""

from __future__ import annotations

from fivebar_control.fault import Fault
from fivebar_control.hardware.drive_interface import ZERO, Torques


class CommandWatch:
    """Holds the newest torque command. Times are seconds of a steady clock, given by the caller.

    A command is stale when it came too long ago, or when the sample that it answers was measured too many samples ago.
    Before the first command of a run the torque is zero and no command is stale.
    """

    def __init__(self, timeout: float, rate_hz: int) -> None:
        """Make a watch with the longest time (s) for which a command holds."""
        self._timeout = timeout
        self._samples = max(1, round(timeout * rate_hz))
        self.begin()

    def begin(self) -> None:
        """Begin a run without any command."""
        self.answered = -1
        """The sample that the newest command answers, -1 for none."""
        self._torques = ZERO
        self._came = 0.0

    def accepts(self, sample: int, present: int) -> bool:
        """Return whether a command of a sample may be taken: neither of the future nor older than the newest."""
        return self.answered <= sample <= present

    def take(self, sample: int, torques: Torques, now: float) -> None:
        """Take the command that answers a sample."""
        self.answered, self._torques, self._came = sample, torques, now

    def rearm(self, sample: int, now: float) -> None:
        """Hold zero torque and restart the timeout at a sample: the operator has reset the fault."""
        if self.answered >= 0:
            self.take(sample, ZERO, now)

    @property
    def torques(self) -> Torques:
        """The torques (Nm) in force."""
        return self._torques

    def fault(self, sample: int, now: float) -> Fault | None:
        """Return the fault that a stale command is, at the present sample."""
        if self.answered < 0:
            return None
        age = now - self._came
        if age > self._timeout:
            return Fault("command_stale", f"last torque came {age * 1e3:.0f} ms ago, limit {self._timeout * 1e3:g} ms")
        if sample - self.answered > self._samples:
            return Fault(
                "command_stale",
                f"sample {sample} still waits for the torque of sample {self.answered + 1}, limit {self._samples}"
                " samples",
            )
        return None
