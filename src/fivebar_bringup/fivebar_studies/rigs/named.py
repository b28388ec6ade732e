# SPDX-License-Identifier: Apache-2.0
"""Rigs by name: a shipped one, the path of a file, or that of a robot's file."""

from __future__ import annotations

import functools
from collections.abc import Collection
from pathlib import Path

from fivebar_description.errors import InputError
from fivebar_description.files import is_yaml_path, share_file, yaml_path
from fivebar_description.suggestion import expected_one_of
from fivebar_studies.rigs.declared import declared_rig
from fivebar_studies.rigs.rig import CHANGES, OF_ROBOT, SET, Rig, changed, read_rig


def rig_directory() -> Path:
    """Return the folder of the shipped rigs."""
    return share_file("fivebar_bringup", "config", "rigs")


def shipped_rigs() -> list[str]:
    """Return the names of the shipped rigs."""
    return sorted(path.stem for path in rig_directory().glob("*.yaml"))


@functools.cache
def find_rig(name: str) -> Rig:
    """Return a rig by the name of a shipped one or by the path of its file, which a process reads once.

    A name that begins with `OF_ROBOT` is that of the rig which a robot's file declares; one of `CHANGES` may follow,
    and then changed keys after `SET`.

    Raises:
        InputError: there is no such rig, or its file does not describe one.
    """
    base, *changes = name.split(SET)
    if changes:
        return find_rig(base).with_changes(tuple(changes))
    base, _, change = name.rpartition(":")
    if base and change in CHANGES:
        return changed(find_rig(base), change, name)
    if name.startswith(OF_ROBOT):
        return declared_rig(name.removeprefix(OF_ROBOT))
    return read_rig(yaml_path("rig", name, rig_directory()))


def named_rigs(option: str, text: str, others: Collection[str] = ()) -> tuple[str, ...]:
    """Return the rigs in a list that is separated by commas, each once, files by their whole path.

    Args:
        option: that takes the list, for messages.
        text: names of shipped rigs and paths of files.
        others: further words that may stand in it.

    Raises:
        InputError: one of them is no rig.
    """
    return tuple(dict.fromkeys(named_rig(option, name.strip(), others) for name in text.split(",")))


def named_rig(option: str, name: str, others: Collection[str] = ()) -> str:
    """Return the name of a rig, a file's by its whole path, and read it.

    Raises:
        InputError: it is no rig.
    """
    if name in others:
        return name
    base, _, change = name.rpartition(":")
    if base and change in CHANGES:
        return f"{named_rig(option, base)}:{change}"
    known = (*shipped_rigs(), *others)
    if not is_yaml_path(name) and name not in known:
        raise InputError(f"{option}: {name!r}: {expected_one_of(name, known, ', or a path to a .yaml file')}")
    source = str(Path(name).resolve()) if is_yaml_path(name) else name
    find_rig(source)
    return source
