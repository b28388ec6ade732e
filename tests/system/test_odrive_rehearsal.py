"""Crossings on two emulated ODrives: frames on a CAN bus between bridge and drives, each in a process of its own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from fivebar_command import FivebarCommand
from rehearsed import expect_crossing, expect_stop

REHEARSED = ("run", "middle_robot", "--hardware", "emulated", "--drives", "odrive", "--json")


def test_the_middle_crossing(fivebar: Callable[..., FivebarCommand], folder: Path) -> None:
    call = fivebar(*REHEARSED, "--out", str(folder / "odrive"))
    expect_crossing(call)


@pytest.mark.extra
@pytest.mark.parametrize(
    ("broken", "fault"),
    [
        ("0.5 fault 1 DC_BUS_UNDER_VOLTAGE", "odrive_error: q11 (node 0): DC_BUS_UNDER_VOLTAGE"),
        ("1.2 unplug", "feedback_missing: q11 (id 0): no answer"),
        ("0.5 fault 2 BRAKE_RESISTOR_DISARMED", "odrive_error: q21 (node 1): BRAKE_RESISTOR_DISARMED"),
        ("0.5 silent 2", "feedback_missing: q21 (id 1): no answer"),
        ("1.2 frozen 2", "encoder_frozen: "),
        ("0.5 kill drive_bridge", "node_died: drive_bridge "),
        ("0.5 kill blender", "node_died: controllers "),
    ],
)
def test_a_fault_on_the_way(fivebar: Callable[..., FivebarCommand], folder: Path, broken: str, fault: str) -> None:
    expect_stop(fivebar, REHEARSED, broken, folder / broken.replace(" ", "_"), fault)
