# SPDX-License-Identifier: Apache-2.0
"""The MOTKIN bench's crossings under a controller of five values a joint, and ten ways of dying."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from fivebar_command import FivebarCommand
from rehearsed import expect_crossing, expect_stop

from fivebar_control.hardware.motors_file import motors_path

pytestmark = [pytest.mark.clock, pytest.mark.extra]

INNER_LOOP = "  inner_loop: {stiffness: 1.0, damping: 0.03}\n"


def rehearsed(folder: Path, scenario: str) -> tuple[str, ...]:
    """Return the arguments of a run in which the boards' gains act beside the torque."""
    shipped = motors_path("motkin_ros2_control").read_text(encoding="utf-8")
    path = folder / "gains.yaml"
    path.write_text(shipped.replace("motors:", f"{INNER_LOOP}motors:"), encoding="utf-8")
    return ("run", scenario, "--hardware", "emulated", "--drives", str(path), "--json")


def test_the_bench_crosses_to_and_fro(fivebar: Callable[..., FivebarCommand], folder: Path) -> None:
    expect_crossing(fivebar(*rehearsed(folder, "motkin_middle"), "--out", str(folder / "there_and_back")))


@pytest.mark.parametrize(
    ("broken", "fault"),
    [
        ("0.3 fault 1 BROADCASTER_STOPPED", "states_stale: "),
        ("0.3 frozen 2", "encoder_frozen: "),
        ("0.3 fault 1 CONTROLLER_UNLOADED", "controller_lost: "),
        ("0.3 fault 2 STATE_NOT_FINITE", "states_invalid: "),
        ("0.3 fault 1 SECOND_COMMANDER", "second_publisher: "),
        ("0.3 silent 1", "states_invalid: "),
        ("0.3 unplug", "states_stale: "),
        ("0.3 kill drive_bridge", "node_died: drive_bridge "),
        ("0.3 kill command_watchdog", "node_died: command_watchdog "),
        ("0.3 kill blender", "node_died: controllers "),
    ],
)
def test_it_dies_in_mid_crossing(fivebar: Callable[..., FivebarCommand], folder: Path, broken: str, fault: str) -> None:
    expect_stop(fivebar, rehearsed(folder, "motkin_middle"), broken, folder / broken.replace(" ", "_"), fault)
