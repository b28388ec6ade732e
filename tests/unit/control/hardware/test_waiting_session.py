# SPDX-License-Identifier: Apache-2.0
"""A cycle that waits for its torque, for a robot that moves on with the commands alone."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from fivebar_control.fault import Fault
from fivebar_control.hardware.drive_interface import ZERO, DriveReading, Exchange, JointTarget, Torques
from fivebar_control.hardware.drive_session import DriveSession

PERIOD = 0.002
TIMEOUT = 10 * PERIOD
TORQUES = (0.01, -0.02)


class Drives:
    """Two drives that answer everything and remember what they were told."""

    def __init__(self) -> None:
        self.enabled = False
        self.unused: tuple[tuple[str, int], ...] = ()
        self.notes: tuple[str, ...] = ()
        self.told: list[Torques] = []
        self._torques = ZERO
        self.target: JointTarget | None = None
        self.silent = False

    def tend(self) -> None:
        """Nothing to do."""

    def confirm_start(self, timeout: float) -> None:
        """Stand where the run starts."""

    reset = confirm_start

    def enable(self, timeout: float) -> None:
        self.enabled = True

    def disable(self, timeout: float) -> None:
        self.enabled = False

    def quick_stop(self) -> None:
        self.enabled = False

    switch_off = release = close = quick_stop

    def write(self, torques: Torques, target: JointTarget | None = None) -> None:
        self._torques, self.target = torques, target

    def exchange(self) -> Exchange:
        self.told.append(self._torques)
        reading = DriveReading(0.0, 0.0, 0.0)
        return Exchange((reading, None if self.silent else reading), None)


def running(waits: bool) -> tuple[DriveSession, Drives]:
    """Return a session at sample 1, whose sample 0 was answered at time 0."""
    drives, faults = Drives(), list[Fault]()
    session = DriveSession(
        lambda: drives, round(1.0 / PERIOD), TIMEOUT, 1.0, lambda fault, own: faults.append(fault), "bridge", waits
    )
    assert session.open()
    assert session.activate(lambda: 0.0)
    assert session.command(0, ZERO, 0.0)
    sample = session.cycle(PERIOD)
    assert sample is not None
    assert sample.number == 1
    return session, drives


def test_a_cycle_waits_for_the_torque_and_then_uses_it_at_once() -> None:
    session, drives = running(waits=True)
    assert session.cycle(2 * PERIOD) is None
    assert session.overdue
    assert session.command(1, TORQUES, 2.4 * PERIOD)
    sample = session.cycle(2.4 * PERIOD)
    assert sample is not None
    assert sample.number == 2
    assert not session.overdue
    assert drives.told[-1] == TORQUES


def test_a_torque_that_does_not_come_is_waited_for_no_longer_than_half_its_time_and_becomes_a_fault() -> None:
    session, drives = running(waits=True)
    moments = [PERIOD * beat for beat in range(2, 13)]
    went_on = [moment for moment in moments if session.cycle(moment) is not None]
    assert went_on[0] - PERIOD >= 0.5 * TIMEOUT - 1e-9
    assert session.fault is not None
    assert session.fault.name == "command_stale"
    assert not drives.enabled


def test_a_torque_that_came_while_the_process_stood_still_is_taken_before_it_counts_as_stale() -> None:
    session, drives = running(waits=True)
    # the timer comes before the message that has been waiting
    awake = PERIOD + 1.2 * TIMEOUT
    assert session.cycle(awake) is None
    assert session.overdue
    assert session.command(1, TORQUES, awake)
    sample = session.cycle(awake)
    assert sample is not None and session.fault is None
    assert drives.told[-1] == TORQUES


def test_a_torque_that_has_not_come_while_the_process_stood_still_becomes_a_fault_however_often_it_does() -> None:
    session, _ = running(waits=True)
    awake = PERIOD + 1.2 * TIMEOUT
    assert session.cycle(awake) is None
    session.cycle(awake + TIMEOUT)
    assert session.fault is not None and session.fault.name == "command_stale"


def test_an_inner_loop_follows_the_reference_of_the_present_sample_alone() -> None:
    target = JointTarget(1.0, (0.1, 0.2), (0.0, 0.0))
    braked = Fault("tracking_lost", "at sample 3")
    for fault, brakes in ((None, False), (braked, True), (braked, False)):
        session, drives = running(waits=False)
        assert session.command(1, TORQUES, 1.5 * PERIOD, target)
        assert drives.target == target
        if fault is None:
            # no new torque in time: the last one holds, without the target of another sample
            session.cycle(2 * PERIOD)
            assert drives.target == target
            session.cycle(3 * PERIOD)
            assert (drives.told[-1], drives.target) == (TORQUES, None)
            continue
        if brakes:
            session.follow_brake(fault, 1.0)
        else:
            session.latch(fault)
        # the torque of the brake is followed, nothing else
        assert session.command(1, TORQUES, 1.6 * PERIOD, target)
        session.cycle(2 * PERIOD)
        assert drives.told[-1] == (TORQUES if brakes else ZERO)
        assert drives.target is None


def test_no_torque_is_waited_for_where_the_sample_was_not_measured() -> None:
    session, drives = running(waits=True)
    assert session.command(1, TORQUES, 1.5 * PERIOD)
    drives.silent = True
    assert session.cycle(2 * PERIOD) is None
    drives.silent = False
    sample = session.cycle(3 * PERIOD)
    assert sample is not None
    assert (sample.number, session.overdue) == (3, False)
    assert drives.told[-1] == TORQUES


def test_drives_that_follow_the_clock_are_not_kept_waiting() -> None:
    session, _ = running(waits=False)
    sample = session.cycle(2 * PERIOD)
    assert sample is not None
    assert (sample.number, session.overdue) == (2, False)


def session_that_opens(driver: Callable[[], Drives]) -> tuple[DriveSession, list[str]]:
    faults: list[str] = []
    session = DriveSession(
        driver, round(1.0 / PERIOD), TIMEOUT, 1.0, lambda fault, own: faults.append(str(fault)), "bridge", False
    )
    return session, faults


def test_a_driver_whose_port_cannot_be_opened_is_a_fault() -> None:
    def no_device() -> Drives:
        raise OSError(19, "No such device")

    session, faults = session_that_opens(no_device)
    assert not session.open() and not session.is_open
    assert faults == ["bus_missing: [Errno 19] No such device"]


def test_a_mistake_in_a_driver_is_a_fault_beside_its_traceback() -> None:
    session, faults = session_that_opens(lambda: {}["port"])
    with pytest.raises(KeyError):
        session.open()
    assert faults == ["drive_setup: the driver failed: KeyError: 'port'"]
