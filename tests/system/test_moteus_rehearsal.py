"""Crossings at 500 Hz on two emulated moteus drives: frames of CAN FD between bridge and drives, in two processes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from fivebar_command import FivebarCommand
from rehearsed import expect_crossing, expect_stop, last_torque

pytestmark = pytest.mark.clock
"""At 500 Hz nothing else may run beside them."""

REHEARSED = ("run", "middle_moteus", "--hardware", "emulated", "--json")


def test_the_middle_crossing(fivebar: Callable[..., FivebarCommand], folder: Path) -> None:
    expect_crossing(fivebar(*REHEARSED, "--out", str(folder / "moteus")))


@pytest.mark.extra
@pytest.mark.parametrize(
    ("broken", "fault"),
    [
        *(
            pytest.param(f"{moment} fault 1 UNDER_VOLTAGE", "moteus_error: q11 (id 1): UNDER_VOLTAGE (40)")
            for moment in (0.1, 0.3, 0.5, 1.0, 1.5)
        ),
        pytest.param("1.2 unplug", "feedback_missing: "),
        pytest.param("0.5 silent 2", "feedback_missing: q21 (id 2): no answer"),
        pytest.param("1.2 frozen 2", "encoder_frozen: "),
        pytest.param("0.5 kill drive_bridge", "node_died: drive_bridge "),
        pytest.param("0.5 kill blender", "node_died: controllers "),
    ],
)
def test_a_fault_on_the_way(fivebar: Callable[..., FivebarCommand], folder: Path, broken: str, fault: str) -> None:
    out = folder / broken.replace(" ", "_")
    # whether bridge, runner or blender notices silence first depends on the machine: at 500 Hz all do within 20 ms
    silenced = ("state_stale: ", "command_stale: ") if "fault" not in broken and "frozen" not in broken else ()
    expect_stop(fivebar(*REHEARSED, "--inject", broken, "--out", str(out)), fault, *silenced)
    # nobody commands anything once the blender is dead
    assert "blender" in broken or last_torque(out) == (0.0, 0.0)
