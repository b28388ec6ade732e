# SPDX-License-Identifier: Apache-2.0
"""The ways to reach a robot's drives, each registered by an entry point of the group `fivebar.drives`.

An installed package adds one of its own by such an entry point; a drives file may name any other as MODULE:NAME.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.metadata import entry_points
from importlib.util import find_spec
from typing import Any, NamedTuple

from fivebar_description.known_drives import CANOPEN, NO_INTERFACE
from fivebar_description.modules import PLACE, load_part
from fivebar_description.optional import confirm_package
from fivebar_description.strict_yaml import InputError

GROUP = "fivebar.drives"

OWN_BRIDGE = "drive_bridge"
"""The bridge of interfaces that have none of their own."""


class DriveKind(NamedTuple):
    """A way to reach drives. Its parts are named as MODULE:NAME, so that each process imports only what it needs.

    Attributes:
        name: the `interface` of a drives file, or of the section `drives` of a robot file.
        connection: function that reads the configuration of the drives, given by name or path, and returns a
            `fivebar_control.hardware.drive_connection.DriveConnection`.
        emulation: the `fivebar_sim.emulators.emulator.Emulator` of such drives.
        run_files: the `fivebar_bringup.drives.run_files.RunFiles` that write the files of a run on such drives.
        faults: mapping of the names of their faults to meaning and recovery, both in plain words; empty for none.
        bridge: executable of `fivebar_control` that connects them to the graph; its name ends in `_bridge`.
        beside: name of a node that runs beside the bridge, with the same configuration as its parameter `drives`; empty
            for none.
        on_topics: whether they are reached by topics, so that a run on real ones is in their DDS domain.
        awaited: function of a scenario, a configuration and a DDS domain that waits before a run until real ones are
            there, and refuses those of another robot; empty for none.
        hardware: the value of `--hardware` that stands for real ones besides `real`; empty for none.
        library: the vendor's module that the connection needs; empty for none.
        installed_by: what `pip install` gets it by.
    """

    name: str
    connection: str
    emulation: str
    run_files: str
    faults: str = ""
    bridge: str = OWN_BRIDGE
    beside: str = ""
    on_topics: bool = False
    awaited: str = ""
    hardware: str = ""
    library: str = ""
    installed_by: str = ""


def drive_kind(name: str) -> DriveKind:
    """Return a way to reach drives by its registered name or by MODULE:NAME, whose module is imported.

    Robots whose file names no interface have their drives on a CAN bus.

    Raises:
        InputError: there is none of that name, its package is not installed, or it cannot be loaded.
    """
    if PLACE.fullmatch(name):
        return _checked(name, load_part(name))
    registered = _registered()
    wanted = CANOPEN if name == NO_INTERFACE else name
    if wanted not in registered:
        known = ", ".join(interfaces())
        raise InputError(f"interface of the drives: {name!r}: expected one of {known}, or my_package.my_drives:KIND")
    confirm_package(registered[wanted], f"interface of the drives: {name!r}")
    return _checked(name, load_part(registered[wanted]))


def interfaces() -> list[str]:
    """Return the names of the registered ways to reach drives."""
    return sorted(_registered())


def confirm_installed(kind: DriveKind) -> None:
    """Confirm that there is what the connection to drives needs.

    Raises:
        InputError: it is not installed; the text says by what it gets there.
    """
    for place in (kind.connection, kind.run_files):
        confirm_package(place, f"interface of the drives: {kind.name!r}")
    if kind.library and find_spec(kind.library) is None:
        raise InputError(
            f"interface of the drives: {kind.name!r}: needs the module {kind.library}, which is not installed:"
            f" pip install '{kind.installed_by}'"
        )


def named_interface(content: object, source: str) -> str | None:
    """Return the interface that the content of a drives or emulation file names, None where it names none.

    Raises:
        InputError: its key `interface` is no text.
    """
    named = content.get("interface") if isinstance(content, Mapping) else None
    if named is not None and not isinstance(named, str):
        raise InputError(f"{source}: interface: {named!r}: expected the name of an interface of drives")
    return named


def _checked(name: str, kind: Any) -> DriveKind:
    if not isinstance(kind, DriveKind):
        expected = f"{DriveKind.__module__}.{DriveKind.__name__}"
        raise InputError(f"interface of the drives: {name!r}: expected a {expected}, found {type(kind).__name__}")
    return kind


@cache
def _registered() -> dict[str, str]:
    """Return where each registered way is, by its name."""
    return {entry.name: entry.value for entry in entry_points(group=GROUP)}
