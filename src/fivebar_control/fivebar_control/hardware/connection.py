# SPDX-License-Identifier: Apache-2.0
"""The drives of a configuration, whatever their interface is."""

from __future__ import annotations

from pathlib import Path

from fivebar_control.hardware.drive_connection import DriveConnection
from fivebar_description.drive_kinds import drive_kind, named_interface
from fivebar_description.files import is_file, is_yaml_path, share_file
from fivebar_description.known_drives import NO_INTERFACE
from fivebar_description.modules import load_part
from fivebar_description.strict_yaml import load_yaml


def interface_of(configuration: str) -> str | None:
    """Return the interface that a configuration names, None for one that names none.

    Raises:
        InputError: there is no such file, or its key `interface` is no text.
    """
    shipped = share_file("fivebar_control", "config", "motors", f"{configuration}.yaml")
    if not (is_yaml_path(configuration) or is_file(shipped)):
        return None
    path = Path(configuration) if is_yaml_path(configuration) else shipped
    return named_interface(load_yaml(path), configuration)


def connect(configuration: str) -> DriveConnection:
    """Return the drives of a configuration, given by name or path, by the interface that it names.

    Raises:
        InputError: the file is missing or not a configuration, or there is no such interface.
    """
    kind = drive_kind(interface_of(configuration) or NO_INTERFACE)
    connection: DriveConnection = load_part(kind.connection)(configuration)
    return connection
