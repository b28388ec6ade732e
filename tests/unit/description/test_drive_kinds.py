# SPDX-License-Identifier: Apache-2.0
"""Interfaces of drives are found by their registered name or by MODULE:NAME, and all parts of the shipped ones load."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from fivebar_bringup.drives.kinds import CANOPEN_DRIVES
from fivebar_bringup.drives.run_files import RunFiles
from fivebar_bringup.graph.node_spec import BRIDGES
from fivebar_description.drive_kinds import OWN_BRIDGE, DriveKind, drive_kind
from fivebar_description.modules import load_part
from fivebar_description.strict_yaml import InputError
from fivebar_sim.emulated_hardware import Emulator
from fivebar_vendor_drives.kinds import MOTKIN_BOARD


def test_registered_and_named_ones_are_found() -> None:
    assert drive_kind("canopen") == drive_kind("none") == CANOPEN_DRIVES
    assert OWN_BRIDGE in BRIDGES
    assert drive_kind("motkin") == drive_kind("fivebar_vendor_drives.kinds:MOTKIN_BOARD") == MOTKIN_BOARD


@pytest.mark.parametrize("kind", [CANOPEN_DRIVES, MOTKIN_BOARD], ids=lambda kind: kind.name)
def test_every_part_of_a_shipped_one_is_there(kind: DriveKind) -> None:
    assert kind.bridge in BRIDGES
    files: RunFiles = load_part(kind.run_files)
    assert load_part(kind.connection)(files.real_drives).period_us == 2000
    emulator = load_part(kind.emulation)
    assert isinstance(emulator, Emulator)
    assert emulator.understands("fault 1")
    assert not emulator.understands("tickle 1")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        (
            "odrif",
            r"'odrif': expected one of canopen, moteus, motkin, odrive, ros2_control, or my_package.my_drives:KIND",
        ),
        ("no_such_module:KIND", r"no_such_module:KIND: cannot be loaded"),
        ("fivebar_bringup.drives.kinds:NO_KIND", r"cannot be loaded: .*NO_KIND"),
        ("fivebar_description.drive_kinds:GROUP", r"expected a fivebar_description.drive_kinds.DriveKind, found str"),
    ],
)
def test_others_are_refused_by_name(name: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        drive_kind(name)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("import json\ndef ::\n", r"broken_kind:KIND: cannot be loaded: SyntaxError: .*\(broken_kind\.py, line 2\)"),
        (
            "KIND = 1\n\nKIND / 0\n",
            r"broken_kind:KIND: cannot be loaded: ZeroDivisionError: .*\(broken_kind\.py, line 3\)",
        ),
    ],
)
def test_a_module_that_fails_is_named_with_the_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: str, words: str
) -> None:
    (tmp_path / "broken_kind.py").write_text(content, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "broken_kind", raising=False)
    with pytest.raises(InputError, match=words):
        drive_kind("broken_kind:KIND")
