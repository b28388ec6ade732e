# SPDX-License-Identifier: Apache-2.0
"""The MOTKIN bench's crossings under a controller of five values a joint, and nine ways of dying."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from fivebar_command import FivebarCommand
from rehearsed import expect_crossing, expect_stop

pytestmark = [pytest.mark.clock, pytest.mark.extra]

REHEARSED = ("run", "motkin_middle", "--hardware", "emulated", "--drives", "motkin_ros2_control", "--json")


def test_the_bench_crosses_to_and_fro(fivebar: Callable[..., FivebarCommand], folder: Path) -> None:
    expect_crossing(fivebar(*REHEARSED, "--out", str(folder / "there_and_back")))


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
    ],
)
def test_it_dies_in_mid_crossing(fivebar: Callable[..., FivebarCommand], folder: Path, broken: str, fault: str) -> None:
    expect_stop(fivebar, REHEARSED, broken, folder / broken.replace(" ", "_"), fault)
