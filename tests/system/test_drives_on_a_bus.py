# SPDX-License-Identifier: Apache-2.0
"""A run on drives that are there already: whoever stands at the robot begins it, it ends by itself, and tells how.

The drives are emulated, in a process of their own, as real ones are; the command knows nothing of that.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fault_bench import PRIORITY, DrivesProcess
from fivebar_command import FivebarCommand
from graph_probe import Bench
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.drives.can_files import TEMPLATE, drive_file
from fivebar_bringup.drives.choice import write_drive_files
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.hardware.configuration import drives_path
from fivebar_description.errors import InputError
from fivebar_description.interface import MOTOR_STATES, TORQUE_COMMAND

BRIDGE = "/dextar_bridge"

RATE_HZ = 50
STEADY_S = 0.2
"""Time for which a torque holds: many times what a shared machine stands still now and then."""


class Laboratory:
    """Drives, a run on them, and an operator."""

    def __init__(self, bench: Bench, seconds: float) -> None:
        self.bench = bench
        content = load_scenario("middle_robot").model_dump(mode="json")
        # straight down, far from the locus
        content |= {"name": "down", "waypoints": [[0.0, 0.15], [0.0, 0.13]], "segment_duration": seconds}
        content |= {"rate_hz": RATE_HZ, "force": True}
        content["safety"]["stop_cycles"] = round(STEADY_S * RATE_HZ)
        scenario = Scenario.model_validate(content)
        self.path = bench.folder / "down.yaml"
        self.path.write_text(scenario.to_yaml())
        files = write_drive_files(scenario, bench.folder)
        self.configuration = files.drives
        self.drives = DrivesProcess(files.emulation, PRIORITY + 1)
        # obeyed once they are on the bus
        self.drives.order("home")
        self.call: FivebarCommand | None = None

    def run(self, *options: str) -> FivebarCommand:
        arguments = ("run", str(self.path), "--hardware", "socketcan", "--drives", str(self.configuration), "--json")
        domain = self.bench.domain
        self.call = FivebarCommand(self.bench.folder / "run", *arguments, "--out", "out", *options, domain=domain)
        return self.call

    def close(self) -> None:
        if self.call is not None:
            self.call.close()
        self.drives.close()


@pytest.fixture
def laboratory(bench: Bench, request: pytest.FixtureRequest) -> Iterator[Laboratory]:
    laboratory = Laboratory(bench, request.param)
    yield laboratory
    laboratory.close()


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    with Bench(tmp_path) as bench:
        yield bench


@pytest.mark.clock
@pytest.mark.extra
@pytest.mark.parametrize("laboratory", [0.4], indirect=True)
def test_it_ends_with_the_motion_and_says_that_it_succeeded(laboratory: Laboratory) -> None:
    call = laboratory.run("--activate")
    assert call.finish() == 0, call.stdout + call.stderr
    summary = call.json()
    assert (summary["outcome"], summary["faults"]) == ("succeeded", [])
    assert summary["planned_samples"] == 21
    call.expect_no_process(0.0)


@pytest.mark.clock
@pytest.mark.extra
@pytest.mark.parametrize("laboratory", [20.0], indirect=True)
@pytest.mark.parametrize("end", ["fault", "deactivate"])
def test_the_operator_begins_it_and_it_ends_with_a_fault_or_the_operator(laboratory: Laboratory, end: str) -> None:
    call, probe = laboratory.run(), laboratory.bench.probe()
    probe.listen(MOTOR_STATES, TORQUE_COMMAND)

    def ask(kind: Any, name: str, request: Any) -> Any:
        assert call.status is None, call.stdout + call.stderr
        return probe.call(kind, f"{BRIDGE}/{name}", request)

    def change(transition: int) -> bool:
        return bool(ask(ChangeState, "change_state", ChangeState.Request(transition=Transition(id=transition))).success)

    assert change(Transition.TRANSITION_CONFIGURE)
    # refused as long as a node is missing, whose names the log has
    probe.wait_for(lambda: change(Transition.TRANSITION_ACTIVATE), "the drives are enabled")
    assert f"ROS_DOMAIN_ID={laboratory.bench.domain}: ros2 lifecycle set {BRIDGE} configure" in call.stderr
    probe.wait_for(lambda: len(probe.got(TORQUE_COMMAND)) > 20, "the motion")
    assert ask(GetState, "get_state", GetState.Request()).current_state.id == State.PRIMARY_STATE_ACTIVE
    if end == "fault":
        laboratory.drives.order("fault 2")
    else:
        change(Transition.TRANSITION_DEACTIVATE)
    assert call.finish() == 1, call.stdout + call.stderr
    summary = call.json()
    assert summary["outcome"] == "stopped"
    assert summary["samples"] < summary["planned_samples"]
    assert ("drive_fault" in summary["faults"]) == (end == "fault")
    assert tuple(read_bag(laboratory.bench.folder / "run" / "out" / "bag").field(TORQUE_COMMAND, "effort")[-1]) == (
        0,
        0,
    )
    call.expect_no_process(0.0)


def test_nothing_waits_for_an_operator_where_the_drives_have_another_rate(tmp_path: Path) -> None:
    own = tmp_path / "own.yaml"
    shutil.copy(drives_path(TEMPLATE), own)
    options = ("--hardware", "socketcan", "--drives", str(own), "--out", "out")
    call = FivebarCommand(tmp_path, "run", "middle_robot", *options)
    assert call.finish() == 2
    assert call.stderr == f"fivebar: {own}: sync_period_us 2000: expected that of the scenario's rate_hz 100\n"
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("rate_hz", [100, 500, 800])
def test_the_template_of_drives_has_the_rate_of_the_scenario(rate_hz: int) -> None:
    scenario = load_scenario("middle_robot").model_copy(update={"rate_hz": rate_hz})
    assert drive_file(scenario, TEMPLATE).sync_period_us * rate_hz == 1_000_000


def test_the_template_of_drives_is_refused_at_a_rate_that_its_bus_cannot_have() -> None:
    scenario = load_scenario("middle_robot").model_copy(update={"rate_hz": 1000})
    with pytest.raises(InputError, match="sync_period_us 2000: expected that of the scenario's rate_hz 1000"):
        drive_file(scenario, TEMPLATE)
