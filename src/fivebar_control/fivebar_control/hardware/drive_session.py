# SPDX-License-Identifier: Apache-2.0
"""One session with the two drives, without ROS: lifecycle, control cycle, latched fault, and what the operator asks.

Times are seconds of the steady clock, given by the caller.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from fivebar_control.fault import Fault
from fivebar_control.hardware.command_watch import CommandWatch
from fivebar_control.hardware.drive_interface import (
    ZERO,
    DriveInterface,
    DriveReading,
    Exchange,
    JointTarget,
    Torques,
)
from fivebar_control.hardware.fault import DriveError
from fivebar_description.interface import ALL_WELL
from fivebar_description.outside_text import one_line

REPEAT_PERIOD = 0.1
"""Time (s) between two publications of sample 0 while nobody has answered it."""

WAITED_PART = 0.5
"""Part of the longest time for which a torque holds that a cycle may wait for the next one, where time waits too."""

LATE_PERIODS = 1.5
"""A cycle that begins later than so many periods after the last one counts as an overrun."""


class MeasuredSample(NamedTuple):
    """A sample to publish: its number and the reading of each drive."""

    number: int
    readings: tuple[DriveReading, DriveReading]


class ServiceOutcome(NamedTuple):
    """Whether a request of the operator was met, and the answer to the operator."""

    success: bool
    message: str


class DriveSession:
    """The drives from configure to cleanup.

    While active, `cycle` exchanges with the drives once per period. Sample 0 is repeated at zero torque until it is
    answered: a run begins where the robot stands. The command that answers sample k is written at once and acts from
    sample k + 1 on. The first fault is latched: zero torque and a quick stop, until `reset` and `enable`. A fault of
    another node that is braking the robot is latched once it commands zero torque.
    """

    def __init__(
        self,
        open_drives: Callable[[], DriveInterface],
        rate_hz: int,
        command_timeout: float,
        enable_timeout: float,
        on_latch: Callable[[Fault, bool], None],
        name: str,
        waits: bool = False,
    ) -> None:
        """Make a session whose drives are closed.

        Args:
            open_drives: opens and sets up both drives, or raises a `DriveError`.
            rate_hz: sampling rate.
            command_timeout: longest time (s) for which a torque holds.
            enable_timeout: longest time (s) for enabling, disabling or resetting the drives.
            on_latch: called when a fault is latched, after the drives have been stopped, with the fault and whether
                it was found here rather than reported by another node.
            name: name of the node whose services the messages name.
            waits: whether a cycle that is due waits for the torque that answers the last sample, for half of
                `command_timeout`: for a robot that moves on with the commands alone.
        """
        self._open_drives = open_drives
        self._rate_hz = rate_hz
        self._name = name
        self._longest_wait = WAITED_PART * command_timeout if waits else 0.0
        self._enable_timeout = enable_timeout
        self._on_latch = on_latch
        self._watch = CommandWatch(command_timeout, rate_hz)
        self._drives: DriveInterface | None = None
        self.active = False
        """Whether the drives were enabled and cycles run."""
        self.fault: Fault | None = None
        """The latched fault."""
        self.sample = 0
        """Number of the present sample."""
        self.overdue = False
        """Whether a cycle is due that waits for its torque."""
        self._measured_last = -1
        self._written = self._led = False
        self._brakes: Fault | None = None
        self._brakes_until = 0.0
        self._overruns = self._incomplete = 0
        self._began = self._repeated = self._looked = 0.0
        self._spared = False

    @property
    def drives(self) -> DriveInterface:
        """The open drives."""
        assert self._drives is not None, "the lifecycle lets nobody come here before configure"
        return self._drives

    @property
    def state(self) -> str:
        """Whether a torque would be obeyed, or why not, as published on drives/state."""
        if self.fault is not None:
            return str(self.fault)
        if not self.active:
            return f"drives_off: {self._name} is not active"
        if not self.drives.enabled:
            return f"drives_off: {self._name}/enable switches them on"
        return ALL_WELL

    @property
    def warning(self) -> str | None:
        """A warning that says which frames and samples were not used; None where all were."""
        if self._drives is None:
            return None
        unused = self._drives.unused
        if not (any(count for _, count in unused) or self._overruns or self._incomplete):
            return None
        return (
            f"frames not used: {', '.join(f'{count} {reason}' for reason, count in unused)};"
            f" {self._incomplete} samples without answer, {self._overruns} overruns"
        )

    def open(self) -> bool:
        """Open and set up both drives, which stay without power; return whether that succeeded.

        A driver may raise an OSError where its bus or port cannot be opened. Any other exception is a mistake in it,
        and is raised again with the fault latched.
        """
        self.fault = None
        try:
            self._drives = self._open_drives()
        except DriveError as error:
            self.latch(error.fault)
            return False
        except OSError as error:
            self.latch(Fault("bus_missing", one_line(str(error))))
            return False
        except Exception as error:
            self.latch(Fault("drive_setup", one_line(f"the driver failed: {type(error).__name__}: {error}")))
            raise
        return True

    def activate(self, clock: Callable[[], float]) -> bool:
        """Enable both drives at zero torque and begin at sample 0; return whether they are enabled."""
        try:
            self.drives.confirm_start(self._enable_timeout)
            self.drives.enable(self._enable_timeout)
        except DriveError as error:
            self.latch(error.fault)
            return False
        self._watch.begin()
        self._brakes = None
        self.sample = 0
        self._measured_last = -1
        self._written = False
        self._began = self._looked = clock()
        self._repeated = 0.0
        self._spared = False
        self.active = True
        return True

    def power_off(self) -> None:
        """Command zero torque, then switch both drives off."""
        self.active = False
        try:
            self.drives.disable(self._enable_timeout)
        except DriveError as error:
            self.drives.switch_off()
            self.latch(error.fault)

    def close(self) -> None:
        """Release the drives, which are off, and close them, where they are open."""
        if self._drives is not None:
            self._drives.release()
            self._drives.close()
            self._drives = None

    @property
    def is_open(self) -> bool:
        """Whether the drives are open."""
        return self._drives is not None

    def cycle(self, now: float) -> MeasuredSample | None:
        """Run one cycle: check the torque's age, exchange with the drives; return the sample to publish, if any."""
        self.overdue = self._waits_for_torque(now)
        if self.overdue:
            return None
        self._overruns += now - self._began > LATE_PERIODS / self._rate_hz
        self._began, self._spared = now, False
        stale = self._watch.fault(self.sample, now)
        if stale is not None:
            self.latch(stale)
        if self._brakes is not None and now >= self._brakes_until:
            self.latch(self._brakes, own=False)
        if self.fault is not None:
            self.drives.write(ZERO)
        elif not self._written:
            self.drives.write(self._watch.torques)
        self._written = False
        cycle = self.drives.exchange()
        if cycle.fault is not None:
            self.latch(cycle.fault)
        if self._watch.answered >= 0:
            self.sample += cycle.periods
            return self._measured(cycle)
        if now - self._repeated >= REPEAT_PERIOD:
            self._repeated = now
            return self._measured(cycle)
        return None

    def _waits_for_torque(self, now: float) -> bool:
        """Return whether the cycle is to wait for the torque that answers the present sample, which is on its way.

        After a pause of this process it may have come, and not been taken yet: the cycle waits once more then. Nothing
        answers a sample that was not measured.
        """
        paused, self._looked = now - self._looked > LATE_PERIODS / self._rate_hz, now
        due = 0 <= self._watch.answered < self.sample == self._measured_last
        expected = due and self.fault is None and self.drives.enabled
        if not expected or not self._longest_wait:
            return False
        if now - self._began < self._longest_wait:
            return True
        spared, self._spared = self._spared, paused
        return paused and not spared

    def _measured(self, cycle: Exchange) -> MeasuredSample | None:
        """Return the sample of a cycle; None where a drive has not answered: nothing is published unmeasured."""
        first, second = cycle.readings
        if first is None or second is None:
            self._incomplete += 1
            return None
        if cycle.periods == 0 and self._watch.answered >= 0:
            return None
        self._measured_last = self.sample
        return MeasuredSample(self.sample, (first, second))

    def command(self, sample: int | None, torques: Torques, now: float, target: JointTarget | None = None) -> bool:
        """Take the torques (Nm) that answer a sample; return whether they answer one that may be answered now.

        The target of drives with an inner loop holds until the next cycle alone, and not while the robot is braked.
        """
        if not self.active or sample is None or not self._watch.accepts(sample, self.sample):
            return False
        self._watch.take(sample, torques, now)
        self._end_of_braking()
        if self.fault is None:
            self._led = target is not None and self._brakes is None
            self.drives.write(torques, target if self._led else None)
            self._written = True
        return True

    def follow_brake(self, fault: Fault, until: float) -> None:
        """Latch another node's fault once that node, which brakes the robot, commands zero torque, or at a time (s)."""
        if self.fault is None and self._brakes is None:
            self._brakes, self._brakes_until = fault, until
            if self._led and self._written:
                # what was written and not exchanged yet, without a target
                self.drives.write(self._watch.torques)
            self._end_of_braking()

    def _end_of_braking(self) -> None:
        if self._brakes is not None and self._watch.torques == ZERO:
            self.latch(self._brakes, own=False)

    def latch(self, fault: Fault, own: bool = True) -> None:
        """Stop the drives and latch why, unless a fault is latched already."""
        self._brakes = None
        if self.fault is not None:
            return
        self.fault = fault
        if self.active:
            self.drives.quick_stop()
        self._on_latch(fault, own)

    def emergency_stop(self) -> ServiceOutcome:
        """Remove power from both drives at once."""
        if self._drives is not None:
            self._drives.switch_off()
        self.latch(Fault("emergency_stop", "requested by service"))
        if self._drives is None:
            return ServiceOutcome(False, "not configured: nothing to stop")
        return ServiceOutcome(True, "power off asked of both drives")

    def reset(self, clock: Callable[[], float]) -> ServiceOutcome:
        """Reset the drives' faults and clear the latched one; the drives stay off."""
        message = f"cleared {self.fault}" if self.fault is not None else "no fault was latched"
        if self._drives is not None:
            try:
                self._drives.reset(self._enable_timeout)
            except DriveError as error:
                return ServiceOutcome(False, f"still there: {error.fault}")
            if self.active and not self._drives.enabled:
                message += f"; the drives are off, {self._name}/enable switches them on"
        self.fault = None
        self._watch.rearm(self.sample, clock())
        return ServiceOutcome(True, message)

    def enable(self, clock: Callable[[], float]) -> ServiceOutcome:
        """Enable both drives again after a reset."""
        if not self.active:
            return ServiceOutcome(False, "not active: activate the node instead")
        if self.fault is not None:
            return ServiceOutcome(False, f"reset first: {self.fault}")
        try:
            self.drives.enable(self._enable_timeout)
            outcome = ServiceOutcome(True, "both drives are enabled")
        except DriveError as error:
            self.latch(error.fault)
            outcome = ServiceOutcome(False, str(error.fault))
        self._watch.rearm(self.sample, clock())
        return outcome
