# SPDX-License-Identifier: Apache-2.0
"""The MOTKIN bench's crossings under a controller of five values a joint, and nine ways of dying."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from described_bench import described, description, emulated
from fivebar_command import FivebarCommand, InstalledCommand
from graph_probe import Bench
from rehearsed import expect_crossing, expect_stop

from fivebar_description.modules import module_command

pytestmark = [pytest.mark.clock, pytest.mark.extra]

ON_THE_STACK = ("--hardware", "emulated", "--drives", "motkin_ros2_control", "--json")
REHEARSED = ("run", "motkin_middle", *ON_THE_STACK)


@pytest.mark.parametrize("scenario", ["motkin_middle", "motkin_vertical"])
def test_the_bench_crosses_to_and_fro(fivebar: Callable[..., FivebarCommand], folder: Path, scenario: str) -> None:
    expect_crossing(fivebar("run", scenario, *ON_THE_STACK, "--out", str(folder / scenario)))


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


def test_a_run_crosses_beside_a_bench_that_is_there_first(folder: Path) -> None:
    own = folder / "there_first"
    own.mkdir()
    emulation, drives = emulated(own)
    with Bench(own) as bench, described(bench, description()):
        bench.run([*module_command("fivebar_sim.emulators.drives"), str(emulation)])
        options = ("--hardware", "external", "--drives", str(drives), "--activate", "--json", "--namespace", "fivebar")
        # the other command forks its nodes, which is not safe once it has joined the domain
        call = InstalledCommand(own, "run", "motkin_middle", *options, "--out", "out", domain=bench.domain)
        call.finish()
    summary = call.json()
    # a busy machine loses this light robot later, which the crossing above is for: here it has power and moves as told
    assert set(summary["faults"]) <= {"estimate_inconsistent"}
    assert summary["samples"] > 40
    assert min(summary["torque_peak_nm"]) > 0.01
