# SPDX-License-Identifier: Apache-2.0
"""State of one drive from its frames: last values, their ages, and its fault."""

from __future__ import annotations

from fivebar_control.fault import Fault
from fivebar_control.hardware.cia402 import DriveState, state_of
from fivebar_control.hardware.configuration import MICROSECONDS, Drive
from fivebar_control.hardware.drive_interface import DriveReading
from fivebar_control.hardware.fault import ERROR_RESET, emergency_name
from fivebar_control.hardware.frames import NMT_NAMES, OPERATIONAL, Effort, Emergency, Heartbeat, Status
from fivebar_control.hardware.units import position_rad, scale_of, torque_nm, velocity_rad_s
from fivebar_description.whole_turns import counter_change

EMERGENCY_CYCLES = 2
"""Cycles after which an emergency message without a fault in the statusword counts as a fault."""


class DriveLink:
    """The receiving side of one drive. Times are seconds of a steady clock, given by the caller."""

    def __init__(self, name: str, drive: Drive, sync_period_us: int, missing_limit: int) -> None:
        """Make a link to a drive of which nothing is known yet."""
        self.name = name
        self.drive = drive
        self.scale = scale_of(drive)
        self._period = sync_period_us / MICROSECONDS
        self._missing_limit = missing_limit
        self.statusword = 0
        self.nmt_state: int | None = None
        self.heard_at: float | None = None
        """When its last heartbeat came; None before the first."""
        self.missed = 0
        """Cycles in a row without its answer."""
        self._counts: int | None = None
        self._turning = 0.0
        """Counts by which the motor has turned in the last cycle."""
        self._status: Status | None = None
        self._effort: Effort | None = None
        self._still = 0.0
        self._emergency: Emergency | None = None
        self._emergency_cycles = 0

    @property
    def state(self) -> DriveState:
        """The state that its last statusword encodes."""
        return state_of(self.statusword)

    @property
    def place(self) -> str:
        """The joint and node id, for messages."""
        return f"{self.name} (node {self.drive.node_id})"

    @property
    def complete(self) -> bool:
        """Whether both of its answers to the present SYNC are there."""
        return self._status is not None and self._effort is not None

    @property
    def silent(self) -> bool:
        """Whether it has left more SYNCs in a row unanswered than it may."""
        return self.missed > self._missing_limit

    def expect(self) -> None:
        """Begin a cycle: what has come so far answers an older SYNC."""
        self._status = self._effort = None

    def take(self, frame: Status | Effort | Heartbeat | Emergency, now: float) -> None:
        """Take a frame of this drive."""
        if isinstance(frame, Status):
            self._status = frame
        elif isinstance(frame, Effort):
            self._effort = frame
        elif isinstance(frame, Heartbeat):
            self.nmt_state, self.heard_at = frame.state, now
        elif frame.code != ERROR_RESET:
            self._emergency, self._emergency_cycles = frame, 0

    def close_cycle(self) -> DriveReading | None:
        """End a cycle: return the reading, or None where an answer is missing."""
        self._emergency_cycles += 1
        if self._status is None or self._effort is None:
            self.missed += 1
            return None
        cycles = self.missed + 1
        self.missed = 0
        self.statusword = self._status.statusword
        before = self._counts
        # beyond the 32 bits of 0x6064 where it has wrapped, and beyond the turn of an encoder that counts no turns
        counts = self._status.counts
        if before is not None:
            # no motor changes its speed by half a turn in a cycle
            changed = counter_change(before, counts)
            turns = round((changed - self._turning * cycles) / self.drive.counts_per_revolution)
            counts = before + changed - turns * self.drive.counts_per_revolution
            self._turning = (counts - before) / cycles
        if self._effort.velocity is not None:
            velocity = velocity_rad_s(self.scale, self._effort.velocity)
        else:
            moved = 0 if before is None else counts - before
            velocity = moved / (self.scale.counts_per_rad * self._period * cycles)
        torque = torque_nm(self.scale, self._effort.torque)
        self._watch_encoder(counts == before, torque, cycles)
        self._counts = counts
        return DriveReading(position_rad(self.scale, counts), velocity, torque)

    def _watch_encoder(self, same: bool, torque: float, cycles: int) -> None:
        stall = self.drive.stall
        pushed = stall is not None and abs(torque) >= stall.torque_nm
        self._still = self._still + self._period * cycles if same and pushed else 0.0

    def forget(self) -> None:
        """Clear past emergencies and standstill: the operator has reset them."""
        self._emergency = None
        self._still = 0.0

    def fault(self, now: float) -> Fault | None:
        """Return the drive's fault, the most specific first; None without one."""
        if self.state in (DriveState.FAULT, DriveState.FAULT_REACTION):
            cause = "no emergency message" if self._emergency is None else _words(self._emergency)
            return Fault("drive_fault", f"{self.place}: statusword 0x{self.statusword:04X}, {cause}")
        # the statusword of the fault that it reports may come with the next answer
        if self._emergency is not None and self._emergency_cycles >= EMERGENCY_CYCLES:
            return Fault("drive_emergency", f"{self.place}: {_words(self._emergency)}")
        age = None if self.heard_at is None else (now - self.heard_at) * 1e3
        if age is None or age > self.drive.heartbeat_timeout_ms:
            since = "no heartbeat yet" if age is None else f"last heartbeat {age:.0f} ms ago"
            return Fault("drive_lost", f"{self.place}: {since}, limit {self.drive.heartbeat_timeout_ms} ms")
        if self.nmt_state != OPERATIONAL:
            state = NMT_NAMES[self.nmt_state or 0]
            return Fault("drive_restarted", f"{self.place}: NMT state {state}, expected operational")
        if self.silent:
            return Fault("feedback_missing", f"{self.place}: no complete answer to {self.missed} SYNCs in a row")
        if self.drive.stall is not None and self._still * 1e3 > self.drive.stall.time_ms:
            return Fault(
                "encoder_frozen",
                f"{self.place}: no count in {self._still * 1e3:.0f} ms under {self.drive.stall.torque_nm:g} Nm or more",
            )
        return None


def _words(emergency: Emergency) -> str:
    code = f"0x{emergency.code:04X}"
    return f"{emergency_name(emergency.code)} ({code}), error register 0x{emergency.register:02X}"
