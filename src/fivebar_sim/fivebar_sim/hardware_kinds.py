"""Which hardware is emulated: drives on a CAN bus, or a motor board on a serial port, as the file says."""

from __future__ import annotations

from pathlib import Path

from fivebar_description.share import share_file
from fivebar_description.strict_yaml import InputError, load_yaml, validate
from fivebar_sim.boards.commands import USAGE as BOARD_USAGE
from fivebar_sim.boards.commands import read_order
from fivebar_sim.boards.configuration import BoardEmulationFile
from fivebar_sim.boards.emulation import BoardEmulation
from fivebar_sim.drives.commands import USAGE as DRIVES_USAGE
from fivebar_sim.drives.commands import read_command
from fivebar_sim.drives.configuration import EmulationFile
from fivebar_sim.drives.hardware import DrivesOnBus
from fivebar_sim.emulated_hardware import EmulatedHardware

USAGE = f"{DRIVES_USAGE}; of a motor board: {BOARD_USAGE}"


def is_order(line: str) -> bool:
    """Return whether drives or a board understand a line."""
    return read_command(line) is not None or read_order(line) is not None


def open_hardware(emulation: str) -> EmulatedHardware:
    """Emulate what a file describes, given by its shipped name or by its path.

    Raises:
        InputError: the file is missing or describes neither, or its bus or its robot cannot be.
    """
    path = _path(emulation)
    content = load_yaml(path)
    if isinstance(content, dict) and "drives" in content:
        return DrivesOnBus(validate(content, EmulationFile, str(path)))
    return BoardEmulation(validate(content, BoardEmulationFile, str(path)))


def _path(emulation: str) -> Path:
    if emulation.endswith((".yaml", ".yml")):
        return Path(emulation)
    folders = [share_file("fivebar_sim", "config", kind) for kind in ("drives", "boards")]
    found = {file.stem: file for folder in folders for file in folder.glob("*.yaml")}
    if emulation not in found:
        raise InputError(
            f"emulation {emulation!r}: expected one of {', '.join(sorted(found))}, or a path to a .yaml file"
        )
    return found[emulation]
