# SPDX-License-Identifier: Apache-2.0
"""Crossings on joints under an emulated controller manager, over DDS, with the watchdog beside the bridge."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from fivebar_command import FivebarCommand
from graph_probe import Bench
from rehearsed import expect_crossing, expect_stop

from fivebar_bringup.drives.choice import write_drive_files
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_description.modules import module_command

pytestmark = [pytest.mark.clock, pytest.mark.extra]

REHEARSED = ("run", "middle_ros2_control", "--hardware", "emulated", "--json")


def test_the_middle_crossing(fivebar: Callable[..., FivebarCommand], folder: Path) -> None:
    call = fivebar(*REHEARSED, "--out", str(folder / "ros2_control"))
    expect_crossing(call)


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
    expect_stop(fivebar, REHEARSED, broken, folder / broken.replace(" ", "_"), fault)


@pytest.mark.parametrize("updates", [1, 2])
def test_a_robot_that_is_there_sets_the_pace(folder: Path, updates: int) -> None:
    """Its controller manager runs by the clock, at the rate of the run or twice as often."""
    own = folder / f"updates{updates}"
    own.mkdir()
    content = load_scenario("middle_ros2_control").model_dump(mode="json")
    content["safety"]["stop_cycles"] = 10
    scenario = Scenario.model_validate(content)
    path = own / "experiment.yaml"
    path.write_text(scenario.to_yaml(), encoding="utf-8")
    files = write_drive_files(scenario, own)
    emulation: dict[str, Any] = yaml.safe_load(files.emulation.read_text(encoding="utf-8"))
    emulation["period_us"] //= updates
    drives: dict[str, Any] = yaml.safe_load(files.drives.read_text(encoding="utf-8"))
    for file, values in ((files.emulation, emulation), (files.drives, drives)):
        file.write_text(yaml.safe_dump({**values, "pace": "clock"}), encoding="utf-8")
    with Bench(own) as bench:
        bench.run([*module_command("fivebar_sim.emulators.drives"), str(files.emulation)])
        options = ("--hardware", "external", "--drives", str(files.drives), "--activate", "--json", "--out", "out")
        call = FivebarCommand(own, "run", str(path), *options, domain=bench.domain)
        assert call.finish() == 0, call.stdout + call.stderr
    summary = call.json()
    assert (summary["outcome"], summary["faults"], summary["assembly_mode_changes"]) == ("succeeded", [], 2)
    assert summary["tracking_error_peak_m"] < 0.004
    # such a robot goes on until it is switched off
    assert summary["samples"] >= summary["planned_samples"]
