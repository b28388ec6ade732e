# SPDX-License-Identifier: Apache-2.0
"""Two drives on one CAN bus as one thing: open, set up, enable, exchange data once per SYNC, disable, close."""

from __future__ import annotations

import contextlib
import math
import threading
import time
from collections import deque
from typing import Any, NamedTuple

import can
import canopen
from canopen.sdo.client import SdoClient
from canopen.sdo.exceptions import SdoError

from fivebar_control.fault import Fault
from fivebar_control.hardware.can_port import CanPort, open_bus
from fivebar_control.hardware.cia402 import FAULT_RESET_SEQUENCE, DriveState, PowerTarget, next_controlword, reached
from fivebar_control.hardware.configuration import MICROSECONDS, USUAL_MISSING, DriveFile, load_drives
from fivebar_control.hardware.cycle_pace import CyclePace
from fivebar_control.hardware.drive_connection import DriveConnection
from fivebar_control.hardware.drive_interface import ZERO, Exchange, JointTarget, Torques, set_up_or_closed
from fivebar_control.hardware.drive_link import DriveLink
from fivebar_control.hardware.drive_setup import DriveSetup
from fivebar_control.hardware.fault import DriveError
from fivebar_control.hardware.frames import (
    COMMAND_BASE,
    HEARTBEAT_BASE,
    NMT_ID,
    NMT_PRE_OPERATIONAL,
    NMT_START,
    OPERATIONAL,
    SDO_ANSWER_BASE,
    SDO_REQUEST_BASE,
    SYNC_ID,
    FrameReader,
    Heartbeat,
    Malformed,
    MastersOwn,
    SdoAnswer,
    command_data,
)
from fivebar_control.hardware.units import torque_raw
from fivebar_description.interface import ACTIVE_JOINTS

RESET_HOLD_CYCLES = 5
"""Cycles for which each word of a fault reset stands, for drives that look at it more slowly than SYNC."""


class BusCounters(NamedTuple):
    """Frames that were not used: of unknown id, with other contents than the id promises, and unreadable ones."""

    unknown: int
    malformed: int
    unreadable: int


class DriveBus:
    """The master's side of the bus.

    Every method is for one thread; frames are received in another. Torque other than zero is sent only while both
    drives are enabled and were asked to be. The master's heartbeat is sent by `exchange` and `tend`, so a loop that
    hangs silences it and the drives stop by themselves.
    """

    def __init__(self, drives: DriveFile, bus: can.BusABC | None = None) -> None:
        """Open the bus that the configuration names, or take one that is open already.

        Raises:
            DriveError: it cannot be opened.
        """
        self._drives = drives
        self._reader = FrameReader(drives.pair, drives.master.node_id)
        self.links = (
            DriveLink(ACTIVE_JOINTS[0], drives.pair[0], drives.sync_period_us, drives.most_missing),
            DriveLink(ACTIVE_JOINTS[1], drives.pair[1], drives.sync_period_us, drives.most_missing),
        )
        self._received = threading.Condition()
        self._unknown = self._malformed = 0
        self._goal = PowerTarget.OFF
        self._enabled = False
        self._reset_words: deque[int] = deque()
        self._send_fault: Fault | None = None
        self._heartbeat_due: float | None = None
        self._pace = CyclePace(drives.sync_period_us / MICROSECONDS)
        self.notes: list[str] = []
        """Optional objects that the drives lack."""
        self._port = CanPort(bus if bus is not None else open_bus(drives.bus), self._take)
        # only its SDO clients are used: frames reach it through us, and it sends on the same interface
        self._network = canopen.Network(self._port.bus)

    def __enter__(self) -> DriveBus:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    @property
    def counters(self) -> BusCounters:
        """Frames that were not used so far."""
        return BusCounters(self._unknown, self._malformed, self._port.unreadable)

    @property
    def unused(self) -> tuple[tuple[str, int], ...]:
        """The same by name."""
        return tuple(zip(BusCounters._fields, self.counters, strict=True))

    @property
    def states(self) -> tuple[DriveState, DriveState]:
        """The drives' states as of the last exchange."""
        return self.links[0].state, self.links[1].state

    @property
    def enabled(self) -> bool:
        """Whether both drives have been enabled and none has dropped out since."""
        return self._enabled

    def close(self) -> None:
        """Stop receiving and close the bus; drives that were not released notice that the heartbeat has ended."""
        self._port.close()

    def release(self) -> None:
        """Release the drives once they are off: they stop supervising our heartbeat, so that its end is no fault.

        A drive that does not answer is left as it is.
        """
        for link in self.links:
            with contextlib.suppress(SdoError, can.CanError, OSError):
                self._sdo(link).download(0x1016, 1, bytes(4))
                self._port.send(NMT_ID, bytes((NMT_PRE_OPERATIONAL, link.drive.node_id)))
        self._network.subscribers.clear()

    def set_up(self) -> None:
        """Check and set up both drives and make them operational; no power, no torque.

        Raises:
            DriveError: a drive is missing, is another one than expected, refuses an object or does not start.
        """
        try:
            for link in self.links:
                self._port.send(NMT_ID, bytes((NMT_PRE_OPERATIONAL, link.drive.node_id)))
            for link in self.links:
                setup = DriveSetup(self._sdo(link), link, self._drives)
                setup.run()
                self.notes += setup.notes
            for link in self.links:
                self._port.send(NMT_ID, bytes((NMT_START, link.drive.node_id)))
        except (can.CanError, OSError) as error:
            raise DriveError(Fault("bus_error", str(error))) from error
        finally:
            # late answers would accumulate
            self._network.subscribers.clear()
        self._wait_operational()

    def _sdo(self, link: DriveLink) -> Any:
        node = link.drive.node_id
        dictionary = canopen.ObjectDictionary()  # type: ignore[no-untyped-call]
        client: Any = SdoClient(SDO_REQUEST_BASE + node, SDO_ANSWER_BASE + node, dictionary)  # type: ignore[no-untyped-call]
        client.network = self._network
        client.RESPONSE_TIMEOUT = self._drives.sdo_timeout_ms / 1e3
        self._network.subscribers[SDO_ANSWER_BASE + node] = [client.on_response]
        return client

    def _wait_operational(self) -> None:
        end = time.monotonic() + max(drive.heartbeat_timeout_ms for drive in self._drives.pair) / 1e3
        while any(link.nmt_state != OPERATIONAL for link in self.links):
            with self._received:
                self._received.wait(self._drives.master.heartbeat_ms / 1e3)
            if time.monotonic() > end:
                silent = next(link for link in self.links if link.nmt_state != OPERATIONAL)
                raise DriveError(Fault("drive_missing", f"{silent.place}: no heartbeat in operational state"))

    def tend(self) -> None:
        """Send the master's heartbeat where it is due; call it often while nothing is exchanged.

        The first is sent by the first exchange: from then on the drives watch it, and before it they have no power.
        """
        now = time.monotonic()
        if self._heartbeat_due is not None and now >= self._heartbeat_due:
            self._heartbeat_due = now + self._drives.master.heartbeat_ms / 1e3
            self._send(HEARTBEAT_BASE + self._drives.master.node_id, bytes((OPERATIONAL,)))

    def confirm_start(self, timeout: float) -> None:
        """Confirm that both encoders read the declared posture, where there is one.

        Raises:
            DriveError: a fault, another posture than the declared one, or no answer within `timeout` (s).
        """
        posture, end = self._drives.posture, time.monotonic() + timeout
        while posture is not None:
            exchange = self.exchange_paced()
            if exchange.fault is not None:
                raise DriveError(exchange.fault)
            first, second = exchange.readings
            if first is not None and second is not None:
                posture.confirm((first.position, second.position), "correct home_offset_rad")
                return
            if time.monotonic() > end:
                raise DriveError(Fault("feedback_missing", f"no cycle with both answers in {timeout:g} s"))

    def enable(self, timeout: float) -> None:
        """Enable both drives at zero torque, exchanging once per period.

        Raises:
            DriveError: a fault, or they are not enabled within `timeout` (s). They are commanded to switch off then.
        """
        self._goal = PowerTarget.ENABLED
        try:
            self._cycle_until(PowerTarget.ENABLED, timeout)
        except DriveError:
            self._goal = PowerTarget.OFF
            self.write(ZERO)
            raise
        self._enabled = True

    def disable(self, timeout: float) -> None:
        """Command zero torque, then switch both drives off in order.

        Raises:
            DriveError: they are not off within `timeout` (s).
        """
        self.write(ZERO)
        self.exchange()
        self._enabled = False
        self._goal = PowerTarget.DISABLED
        self._cycle_until(PowerTarget.DISABLED, timeout)

    def switch_off(self) -> None:
        """Remove power from both drives with the next frames, without waiting for it."""
        self._enabled = False
        self._goal = PowerTarget.OFF
        self._reset_words.clear()
        self.write(ZERO)

    def quick_stop(self) -> None:
        """Command zero torque and, where they were to be enabled, a quick stop (controlword bit 2 = 0)."""
        self._enabled = False
        if self._goal is PowerTarget.ENABLED:
            self._goal = PowerTarget.QUICK_STOP
        self.write(ZERO)

    def reset(self, timeout: float) -> None:
        """Reset the drives' faults. The drives stay off: only `enable` enables.

        Raises:
            DriveError: a fault is still there after `timeout` (s).
        """
        for link in self.links:
            link.forget()
        self._send_fault = None
        # a bridge that was started again knows nothing of their states yet
        self.exchange_paced()
        if DriveState.FAULT in self.states:
            self._enabled = False
            self._goal = PowerTarget.OFF
            self._reset_words.extend(word for word in FAULT_RESET_SEQUENCE for _ in range(RESET_HOLD_CYCLES))
        end = time.monotonic() + timeout
        while True:
            fault = self.exchange_paced().fault
            if not self._reset_words and fault is None:
                return
            if time.monotonic() > end:
                self._reset_words.clear()
                raise DriveError(fault or Fault("drive_stuck", f"no fault reset within {timeout:g} s"))

    def _cycle_until(self, goal: PowerTarget, timeout: float) -> None:
        end = time.monotonic() + timeout
        while True:
            fault = self.exchange_paced().fault
            if all(reached(state, goal) for state in self.states) and (
                goal is not PowerTarget.ENABLED or fault is None
            ):
                return
            if fault is not None and goal is PowerTarget.ENABLED:
                raise DriveError(fault)
            if time.monotonic() > end:
                states = ", ".join(f"{link.place} is {link.state.value}" for link in self.links)
                raise DriveError(fault or Fault("drive_stuck", f"not {goal.value} within {timeout:g} s: {states}"))

    def exchange_paced(self) -> Exchange:
        """Wait for the next period, then command zero torque and exchange: a cycle without a control law."""
        self._pace.wait()
        self.write(ZERO)
        return self.exchange()

    def exchange(self) -> Exchange:
        """Send SYNC and gather both drives' answers until all are there or the deadline has passed."""
        with self._received:
            for link in self.links:
                link.expect()
        if self._heartbeat_due is None:
            self._heartbeat_due = 0.0
        self.tend()
        self._send(SYNC_ID, b"")
        with self._received:
            self._received.wait_for(
                lambda: self.links[0].complete and self.links[1].complete,
                self._drives.gather_deadline_us / MICROSECONDS,
            )
            readings = self.links[0].close_cycle(), self.links[1].close_cycle()
            fault = self._fault()
        return Exchange(readings, fault)

    def _fault(self) -> Fault | None:
        if self._port.off:
            return Fault("bus_off", "the CAN controller has left the bus")
        if self._send_fault is not None:
            return self._send_fault
        now = time.monotonic()
        for link in self.links:
            fault = link.fault(now)
            if fault is not None:
                return fault
        for link in self.links:
            if self._enabled and link.state is not DriveState.ENABLED:
                return Fault("drive_dropped_out", f"{link.place}: {link.state.value}, expected operation enabled")
        return None

    def write(self, torques: Torques, target: JointTarget | None = None) -> None:
        """Send each drive its controlword and torque (Nm), which act from the next SYNC on.

        Zero torque goes out unless both drives are enabled and should be. Once one has dropped out or does not answer
        any more, both are stopped quickly, and neither is enabled again by itself.

        Raises:
            ValueError: a torque is not finite; zero has been sent instead.
        """
        finite = all(math.isfinite(torque) for torque in torques)
        live = self._enabled and all(link.state is DriveState.ENABLED and not link.silent for link in self.links)
        if self._enabled and not live:
            self._enabled = False
            self._goal = PowerTarget.QUICK_STOP
        reset_word = self._reset_words.popleft() if self._reset_words else None
        for link, torque in zip(self.links, torques, strict=True):
            word = next_controlword(link.state, self._goal)
            if reset_word is not None and link.state is DriveState.FAULT:
                word = reset_word
            raw = torque_raw(link.scale, torque) if live and finite else 0
            self._send(COMMAND_BASE + link.drive.node_id, command_data(word, raw))
        if not finite:
            raise ValueError(f"torques {torques} Nm: expected finite numbers")

    def _send(self, can_id: int, data: bytes) -> None:
        try:
            self._port.send(can_id, data)
        except (can.CanError, OSError) as error:
            self._send_fault = Fault("bus_error", f"cannot send: {error}")

    def _take(self, can_id: int, data: bytes) -> None:
        """Take a frame; called in the receiving thread."""
        frame = self._reader.read(can_id, data)
        if isinstance(frame, MastersOwn):
            # multicast brings our own frames back; on any other bus a second master is at work
            self._unknown += self._drives.bus.interface != "udp_multicast"
        elif isinstance(frame, Malformed):
            if frame.known:
                self._malformed += 1
            else:
                self._unknown += 1
        elif isinstance(frame, SdoAnswer):
            for answer in self._network.subscribers.get(can_id, ()):
                answer(can_id, bytearray(data), 0.0)
        else:
            with self._received:
                link = self.links[frame.drive]
                link.take(frame, time.monotonic())
                if isinstance(frame, Heartbeat) or link.complete:
                    self._received.notify_all()


def open_drives(drives: DriveFile) -> DriveBus:
    """Open the bus and set up both drives, which stay without power.

    Raises:
        DriveError: the bus cannot be opened, or a drive cannot be set up; the bus is closed then.
    """
    return set_up_or_closed(DriveBus(drives))


def connect(configuration: str) -> DriveConnection:
    """Return the drives of a configuration, given by name or path.

    Raises:
        InputError: the file is missing or not a configuration.
    """
    drives = load_drives(configuration)
    # twice as often as heartbeats are due
    tended = drives.master.heartbeat_ms / 2e3

    def opened(missing: int = USUAL_MISSING) -> DriveBus:
        return open_drives(drives.bearing(missing))

    return DriveConnection(drives.sync_period_us, "sync_period_us", tended, opened)
