# SPDX-License-Identifier: Apache-2.0
"""How long planning takes is measured by kind of request, each in a process of its own."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

import planning_times
from fivebar_bringup.odds.robot_errors import has_odds
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_studies.rigs.named import find_rig
from planning_times import KINDS, RIG, Times, Watch, prepared


def test_what_is_planned_has_the_odds_of_the_rig() -> None:
    with prepared() as folder:
        scenario = load_scenario(str(folder / "crossing.yaml"))
    assert has_odds(scenario)
    assert scenario.loads is not None and scenario.loads.push == find_rig(RIG).errors.push


def test_the_table_has_the_second_of_two_measurements_of_each_kind(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    calls: list[str] = []

    def measured(name: str, folder: Path) -> Times:
        calls.append(name)
        return Times((float(len(calls)), 9.0), None)

    monkeypatch.setattr(planning_times, "_measured", measured)
    monkeypatch.setattr(sys, "argv", ["planning_times"])
    planning_times.main()
    assert calls == [name for name in KINDS for _ in range(2)]
    lines = [line for line in capsys.readouterr().out.splitlines() if "(9.00)" in line]
    assert [line.split("│")[2].strip() for line in lines] == [f"{2 * n + 2}.00 (9.00)" for n in range(len(KINDS))]


@pytest.mark.extra
@pytest.mark.parametrize("kind", [name for name in KINDS if name != "case of a sweep"])
def test_each_kind_is_planned(kind: str) -> None:
    with prepared() as folder:
        times = KINDS[kind](folder, Watch())
    assert times.first is not None
    assert min(*times.loading, *times.first) > 0.0
