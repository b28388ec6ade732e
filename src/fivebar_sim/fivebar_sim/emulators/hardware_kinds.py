"""Which hardware is emulated: drives on a CAN bus, or a motor board on a serial port, as the file says."""

from __future__ import annotations

from fivebar_description.share import placed_beside, share_file, yaml_path
from fivebar_description.strict_yaml import load_yaml, validate
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


def is_order(line: str) -> bool:
    """Return whether drives or a board understand a line."""
    return read_command(line) is not None or read_order(line) is not None


def open_hardware(emulation: str) -> EmulatedHardware:
    """Emulate what a file describes, given by its shipped name or by its path.

    Raises:
        InputError: the file is missing or describes neither, or its bus or its robot cannot be.
    """
    folders = (share_file("fivebar_sim", "config", kind) for kind in ("drives", "boards"))
    path = yaml_path("emulation", emulation, *folders)
    content = placed_beside(path.parent, load_yaml(path), ("robot",))
    if isinstance(content, dict) and "drives" in content:
        return DrivesOnBus(validate(content, EmulationFile, str(path)))
    return BoardEmulation(validate(content, BoardEmulationFile, str(path)))
