# SPDX-License-Identifier: Apache-2.0
"""Fault injection into a rehearsal: when, and which fault."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from fivebar_bringup.runs.launcher import Kill
from fivebar_bringup.runs.processes import ProcessSpec
from fivebar_description.drive_kinds import DriveKind
from fivebar_description.modules import load_part
from fivebar_description.strict_yaml import InputError
from fivebar_description.suggestion import expected_one_of
from fivebar_sim.emulated_hardware import Emulator
from fivebar_sim.emulators.hardware_kinds import timed_order

KILL = "kill"


class Injection(NamedTuple):
    """A fault at a time (s since sample 0): a command to the emulated drives, or "kill NODE"."""

    seconds: float
    command: str

    @property
    def victim(self) -> str | None:
        """The node to be killed, None for a command to the drives."""
        word, _, node = self.command.partition(" ")
        return node.strip() if word == KILL else None

    def __str__(self) -> str:
        return f"{self.seconds!r} {self.command}"


def read_injection(text: str, kind: DriveKind) -> Injection:
    """Parse a text such as "1.2 fault 1" or "0.5 kill blender", for emulated drives of an interface.

    Raises:
        InputError: it is not a number of seconds followed by a known fault.
    """
    emulator: Emulator = load_part(kind.emulation)
    timed = timed_order(text)
    injection = None if timed is None else Injection(*timed)
    if injection is None or not (injection.victim or emulator.understands(injection.command)):
        raise InputError(f"--inject {text!r}: expected seconds and one of {emulator.usage}, kill NODE")
    return injection


def refuse_late(injections: Sequence[Injection], end: float) -> None:
    """Refuse faults that would come after the end of a motion (s), and so never: a run would seem to survive them.

    Raises:
        InputError: one comes later.
    """
    for injection in injections:
        if injection.seconds > end:
            raise InputError(f"--inject {str(injection)!r}: expected at most {end:g} s, the end of the motion")


def kills(injections: Sequence[Injection], processes: Sequence[ProcessSpec], rate_hz: int) -> list[Kill]:
    """Return the processes to be killed, in order of time.

    Raises:
        InputError: no process runs a node of that name.
    """
    hosts = {node.executable: process.name for process in processes for node in process.nodes}
    injected = []
    for injection in sorted(injections):
        if injection.victim is None:
            continue
        if injection.victim not in hosts:
            raise InputError(
                f"--inject {str(injection)!r}: node {injection.victim}: {expected_one_of(injection.victim, hosts)}"
            )
        injected.append(Kill(round(injection.seconds * rate_hz), hosts[injection.victim]))
    return injected
