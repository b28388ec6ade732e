# SPDX-License-Identifier: Apache-2.0
"""Crossings on two emulated moteus drives: frames of CAN FD between bridge and drives, each in a process of its own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from fivebar_command import FivebarCommand
from rehearsed import expect_crossing, expect_stop

pytestmark = [pytest.mark.clock, pytest.mark.extra]

REHEARSED = ("run", "middle_robot", "--hardware", "emulated", "--drives", "moteus", "--json")


AT_500_HZ = ("run", "middle_moteus", "--hardware", "emulated", "--json")
"""Of the scenario that names these drives, with nothing else beside it."""

UNDER_VOLTAGE = "moteus_error: q11 (id 1): UNDER_VOLTAGE (40)"


def test_the_middle_crossing_at_500_hz(fivebar: Callable[..., FivebarCommand], folder: Path) -> None:
    expect_crossing(fivebar(*AT_500_HZ, "--out", str(folder / "quick")))


def test_a_fault_at_500_hz(fivebar: Callable[..., FivebarCommand], folder: Path) -> None:
    expect_stop(fivebar, AT_500_HZ, "0.5 fault 1 UNDER_VOLTAGE", folder / "quick_fault", UNDER_VOLTAGE)


def test_the_middle_crossing(fivebar: Callable[..., FivebarCommand], folder: Path) -> None:
    expect_crossing(fivebar(*REHEARSED, "--out", str(folder / "moteus")))


@pytest.mark.parametrize(
    ("broken", "fault"),
    [
        *((f"{moment} fault 1 UNDER_VOLTAGE", UNDER_VOLTAGE) for moment in (0.1, 0.3, 0.5, 1.0, 1.5)),
        ("1.2 unplug", "feedback_missing: q11 (id 1): no answer"),
        ("0.5 silent 2", "feedback_missing: q21 (id 2): no answer"),
        ("1.2 frozen 2", "encoder_frozen: "),
        ("0.5 kill drive_bridge", "node_died: drive_bridge "),
        ("0.5 kill blender", "node_died: controllers "),
    ],
)
def test_a_fault_on_the_way(fivebar: Callable[..., FivebarCommand], folder: Path, broken: str, fault: str) -> None:
    expect_stop(fivebar, REHEARSED, broken, folder / broken.replace(" ", "_"), fault)
