# SPDX-License-Identifier: Apache-2.0
"""The drive's side of the CiA 402 power state machine."""

from __future__ import annotations

from enum import Enum


class PowerState(Enum):
    """States, each with its bits of the statusword."""

    SWITCH_ON_DISABLED = 0x0040
    READY = 0x0021
    SWITCHED_ON = 0x0023
    ENABLED = 0x0027
    QUICK_STOP = 0x0007
    FAULT = 0x0008


REMOTE = 0x0200
"""Bit of the statusword: the controlword is processed."""

VOLTAGE = 0x0010
"""Bit of the statusword: high voltage is applied."""


class PowerStateMachine:
    """Follows controlwords; only a rising edge of bit 7 leaves the fault state."""

    def __init__(self) -> None:
        """Start switched off."""
        self.state = PowerState.SWITCH_ON_DISABLED
        self.brakes = False
        """Whether a quick stop brakes the motor first, instead of switching off at once."""
        self.stays = False
        """Whether the drive stays powered after the quick stop."""
        self._last = 0

    @property
    def statusword(self) -> int:
        """The value of 0x6041."""
        return self.state.value | REMOTE | VOLTAGE

    def control(self, word: int) -> bool:
        """Process a controlword; return whether it reset a fault."""
        rising = bool(word & 0x80 and not self._last & 0x80)
        self._last = word
        if self.state is PowerState.FAULT:
            if rising:
                self.state = PowerState.SWITCH_ON_DISABLED
            return rising
        self.state = self._after(word)
        return False

    def _after(self, word: int) -> PowerState:
        """Return the state that follows."""
        if not word & 0x02:
            return PowerState.SWITCH_ON_DISABLED
        if not word & 0x04:
            powered = self.state in (PowerState.ENABLED, PowerState.QUICK_STOP)
            return PowerState.QUICK_STOP if powered and self.brakes else PowerState.SWITCH_ON_DISABLED
        if self.state is PowerState.QUICK_STOP:
            return PowerState.ENABLED if self.stays and word & 0x0F == 0x0F else self.state
        if not word & 0x01:
            return PowerState.READY
        if self.state is PowerState.SWITCH_ON_DISABLED:
            return self.state
        if not word & 0x08:
            return PowerState.SWITCHED_ON
        return PowerState.SWITCHED_ON if self.state is PowerState.READY else PowerState.ENABLED

    def come_to_rest(self) -> None:
        """Report that the motor is at rest: a quick stop without staying powered is over."""
        if self.state is PowerState.QUICK_STOP and not self.stays:
            self.state = PowerState.SWITCH_ON_DISABLED

    def trip(self) -> None:
        """Enter the fault state."""
        self.state = PowerState.FAULT
