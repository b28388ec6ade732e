# SPDX-License-Identifier: Apache-2.0
"""A run waits for somebody else's controller manager, and compares the robot that is described beside it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from described_bench import GAZEBO, described, description, emulated
from graph_probe import Bench

from fivebar_bringup.ros import described_robot
from fivebar_bringup.ros.described_robot import await_robot
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_description.errors import InputError
from fivebar_description.modules import module_command

SCENARIO = load_scenario("motkin_middle")


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Bench, Path]]:
    """A bench's controller manager in a process of its own, and the drives file of the bridge to it."""
    folder = tmp_path_factory.mktemp("described")
    emulation, drives = emulated(folder)
    with Bench(folder) as bench:
        bench.run([*module_command("fivebar_sim.emulators.drives"), str(emulation)])
        yield bench, drives


def test_the_described_robot_is_that_of_the_run(robot: tuple[Bench, Path], capsys: pytest.CaptureFixture[str]) -> None:
    bench, drives = robot
    with described(bench, description()):
        await_robot(SCENARIO, str(drives), bench.domain)
    # a loaded machine may discover late what is there
    assert all(line.startswith("fivebar: waits for ") for line in capsys.readouterr().err.splitlines())


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (description(crank=0.063), "/robot_description: l_11 is 63.0 mm, expected 60.0 mm as robot motkin has"),
        (description(axis="0 0 1"), "motor_1 has zero_rad 1.5708 and sign +1, expected those of q11 in "),
        (description(plugin=GAZEBO), f"{GAZEBO} takes torques, expected link.unit: Nm in "),
        (description().replace("closing_tip_2", "hand"), "/robot_description: frame closing_tip_2: is not there"),
        ("<robot", "/robot_description: is not XML"),
    ],
)
def test_another_robot_is_refused_with_what_differs(robot: tuple[Bench, Path], text: str, reason: str) -> None:
    bench, drives = robot
    with described(bench, text), pytest.raises(InputError) as refused:
        await_robot(SCENARIO, str(drives), bench.domain)
    assert reason in str(refused.value)
    assert len(str(refused.value).splitlines()) == 1


def test_what_does_not_come_is_named(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(described_robot, "LONGEST", 0.2)
    _, drives = emulated(tmp_path)
    with pytest.raises(InputError, match=r"^controller manager /controller_manager: is not there after 0\.2 s"):
        await_robot(SCENARIO, str(drives), bench.domain)
    assert capsys.readouterr().err == "fivebar: waits for the controller manager /controller_manager\n"
