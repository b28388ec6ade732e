# SPDX-License-Identifier: Apache-2.0
"""The kinds of emulated hardware, by its file, and when faults are injected."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_description.drive_kinds import drive_kind, interfaces, named_interface
from fivebar_description.files import placed_beside, share_file, yaml_path
from fivebar_description.known_drives import CANOPEN
from fivebar_description.modules import load_part
from fivebar_description.strict_yaml import InputError, load_yaml
from fivebar_sim.emulated_hardware import EmulatedHardware, Emulator


class OpenedHardware(NamedTuple):
    """Emulated hardware, and how its faults are injected."""

    hardware: EmulatedHardware
    emulator: Emulator


def timed_order(text: str) -> tuple[float, str] | None:
    """Return time (s) and order of a text such as "1.2 fault 1"; None where it does not begin with such a time.

    The order may be any text.
    """
    moment, _, order = text.strip().partition(" ")
    try:
        seconds = float(moment)
    except ValueError:
        return None
    return (seconds, order.strip()) if 0.0 <= seconds < 1e6 else None


def emulator_of(interface: str) -> Emulator:
    """Return how the hardware of an interface is emulated.

    Raises:
        InputError: there is no such interface, or it cannot be loaded.
    """
    emulator: Emulator = load_part(drive_kind(interface).emulation)
    return emulator


def open_hardware(emulation: str, default: str = "") -> OpenedHardware:
    """Emulate what a file describes, given by its shipped name or by its path.

    Args:
        emulation: the file.
        default: interface of a file that names none and has no section `drives`, as that of drives on a CAN bus has.

    Raises:
        InputError: the file is missing or describes no hardware, or its bus or its robot cannot be.
    """
    folders = (share_file("fivebar_sim", "config", kind) for kind in ("drives", "boards"))
    path = yaml_path("emulation", emulation, *folders)
    content = placed_beside(path.parent, load_yaml(path), ("robot",))
    on_bus = isinstance(content, dict) and "drives" in content
    interface = named_interface(content, str(path)) or (CANOPEN if on_bus else default)
    if not interface:
        raise InputError(f"{path}: interface: expected that of the drives, one of {', '.join(interfaces())}")
    emulator = emulator_of(interface)
    return OpenedHardware(emulator.open(content, path), emulator)
