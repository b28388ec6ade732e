"""Crossings on joints under an emulated controller manager, over DDS, with the watchdog beside the bridge."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from fivebar_command import FivebarCommand
from rehearsed import expect_crossing, expect_stop, last_torque

REHEARSED = ("run", "middle_ros2_control", "--hardware", "emulated", "--json")


def test_the_middle_crossing(fivebar: Callable[..., FivebarCommand], folder: Path) -> None:
    call = fivebar(*REHEARSED, "--out", str(folder / "ros2_control"))
    expect_crossing(call)


@pytest.mark.extra
@pytest.mark.parametrize(
    ("broken", "fault"),
    [
        ("0.5 fault 1 BROADCASTER_STOPPED", "states_stale: "),
        ("0.5 fault 1 CONTROLLER_UNLOADED", "controller_lost: "),
        ("0.5 fault 2 STATE_NOT_FINITE", "states_invalid: "),
        ("0.5 fault 1 SECOND_COMMANDER", "second_publisher: "),
        ("1.2 frozen 2", "encoder_frozen: "),
        ("1.2 unplug", "states_stale: "),
        ("0.5 kill drive_bridge", "node_died: drive_bridge "),
        ("0.5 kill command_watchdog", "node_died: command_watchdog "),
        ("0.5 kill blender", "node_died: controllers "),
    ],
)
def test_a_fault_on_the_way(fivebar: Callable[..., FivebarCommand], folder: Path, broken: str, fault: str) -> None:
    out = folder / broken.replace(" ", "_")
    call = fivebar(*REHEARSED, "--inject", broken, "--out", str(out))
    expect_stop(call, fault)
    # nobody commands anything once the blender is dead
    assert "blender" in broken or last_torque(out) == (0.0, 0.0)
