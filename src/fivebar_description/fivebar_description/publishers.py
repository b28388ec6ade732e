# SPDX-License-Identifier: Apache-2.0
"""Who publishes a topic, and whether more than one does, from the identities (GIDs) that DDS gives to publishers."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

SECOND_PUBLISHER = "second_publisher"
"""Name of the fault."""

UNKNOWN_NAME = "_NODE_NAME_UNKNOWN_"
"""ROS' name for the node of a publisher whose name has not been announced yet."""

UNNAMED = "a node whose name is not known yet"
"""How such a node is called in a fault."""

FAST_DDS = b"\x01\x0f"
"""How the identities of Fast DDS begin. Two bytes of the machine follow, then the lower two of the process' number."""

HALF = 1 << 16
"""Numbers that the half of a process' number in an identity can tell apart."""

LONGEST_LEASE = 30.0
"""Time (s) after which a publisher that has died is forgotten by DDS, with a margin: the default lease is 20 s."""


class PublisherOf(NamedTuple):
    """A publisher of a topic: the full name of its node and its identity."""

    node: str
    gid: bytes

    @property
    def known(self) -> bool:
        """Whether the name of its node has been announced."""
        return UNKNOWN_NAME not in self.node

    @property
    def machine(self) -> bytes:
        """The part of its identity that all publishers of its machine share, b"" where that is not known."""
        return self.gid[:4] if self.gid[:2] == FAST_DDS else b""

    @property
    def process(self) -> int:
        """The lower half of its process' number."""
        return int.from_bytes(self.gid[4:6], "little")

    def describe(self, machine: bytes) -> str:
        """Return node and process for people on a machine."""
        name = self.node if self.known else UNNAMED
        if not self.machine or not machine:
            return name
        if self.machine != machine:
            return f"{name} (on another machine)"
        numbers = processes_with(self.process)
        return f"{name} (process {numbers[0]})" if len(numbers) == 1 else name


def processes_with(half: int) -> list[int]:
    """Return the running processes of this machine, of any user, whose number has this lower half."""
    try:
        most = int(Path("/proc/sys/kernel/pid_max").read_text(encoding="ascii"))
    except (OSError, ValueError):
        most = 1 << 22
    return [number for number in range(half, most + 1, HALF) if number and _runs(number)]


def _runs(number: int) -> bool:
    """Return whether a number is that of a process, rather than of a thread or of one that has ended."""
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    try:
        lines = Path(f"/proc/{number}/status").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        # it is hidden from this user, or has just ended
        return Path("/proc/self").exists()
    values = dict(line.split(":\t", 1) for line in lines if ":\t" in line)
    return not values.get("State", "").startswith(("Z", "X")) and values.get("Tgid", str(number)) == str(number)


class Living:
    """Tells publishers that live from the dead predecessor of a node that was started again.

    DDS keeps a publisher whose process was killed for the length of its lease. It is left out where another publisher
    has the same node name, its process was on this machine and is gone, and it is not kept for longer than a lease.
    """

    def __init__(self, clock: Callable[[], float], exists: Callable[[int], object] = processes_with) -> None:
        """Begin without having seen any."""
        self._clock = clock
        self._exists = exists
        self._dead_since: dict[bytes, float] = {}

    def among(self, publishers: Sequence[PublisherOf], machine: bytes) -> list[PublisherOf]:
        """Return those that live, as seen from a machine; b"" where its own identity is not known."""
        return [publisher for publisher in publishers if not self._is_predecessor(publisher, publishers, machine)]

    def is_gone(self, publisher: PublisherOf, machine: bytes) -> bool:
        """Return whether the process of a publisher was on this machine and has ended."""
        return bool(machine) and publisher.machine == machine and not self._exists(publisher.process)

    def _is_predecessor(self, publisher: PublisherOf, all_of_them: Iterable[PublisherOf], machine: bytes) -> bool:
        if not any(other.node == publisher.node and other.gid[:12] != publisher.gid[:12] for other in all_of_them):
            return False
        if not self.is_gone(publisher, machine):
            return False
        now = self._clock()
        return now - self._dead_since.setdefault(publisher.gid, now) < LONGEST_LEASE


class OneSender:
    """Tells a second sender on a topic by the numbers that each publisher gives its own messages, from 1 on."""

    def __init__(self) -> None:
        """Begin before the first message."""
        self._last = 0

    def is_contradicted(self, number: int | None) -> bool:
        """Return whether a message does not follow the last one, as none of its sender does; None is no number."""
        if number is None:
            return False
        before, self._last = self._last, number
        return number <= before


def second_publisher_of(topic: str) -> str:
    """Return the begin of the text of the fault that several publishers of a topic are."""
    return f"{SECOND_PUBLISHER}: {topic} is published by "


def second_publisher(topic: str, publishers: Sequence[PublisherOf], machine: bytes, joints: Sequence[str] = ()) -> str:
    """Return the text of the fault that several publishers of a topic, or on it of the same joints, are."""
    *others, last = [publisher.describe(machine) for publisher in publishers]
    of_joints = f" of {', '.join(joints)}" if joints else ""
    return f"{second_publisher_of(topic)}{', '.join(others)} and {last}, expected one publisher{of_joints}"


def contradiction(topic: str, moment: str, publishers: Sequence[PublisherOf], machine: bytes) -> str:
    """Return the text of the fault that two different messages of one moment are."""
    names = ", ".join(publisher.describe(machine) for publisher in publishers) or "nobody any more"
    return f"{SECOND_PUBLISHER}: two different messages on {topic} for {moment}, which is published by {names}"


def same(first: object, second: object) -> bool:
    """Return whether two values are the same, NaN included."""
    return first == second or repr(first) == repr(second)
