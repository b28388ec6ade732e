# SPDX-License-Identifier: Apache-2.0
"""`fivebar goto` with a run: by itself, after an earlier one, and on a graph that stands and takes requests."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable
from pathlib import Path

import pytest
from fivebar_command import FivebarCommand
from graph_probe import Bench

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.motions.start import start_after
from fivebar_bringup.recorded.run_directory import RunDirectory
from fivebar_description.interface import FAULTS, REFERENCE, RUN_STATUS

SHORT = "name: short\ncontroller: unified\nwaypoints: [[0.0, 0.15], [0.0, 0.14]]\nsegment_duration: 0.2\n"
"""What a robot does before it stands, by default two seconds' motion."""


@pytest.mark.extra
def test_it_runs_the_plan_and_goes_on_from_there(fivebar: Callable[..., FivebarCommand], tmp_path: Path) -> None:
    """There, and back: the second motion begins where the first has ended, in the other assembly mode."""
    out = tmp_path / "there"
    there = fivebar("goto", "0", "0.03", "--ros", "--json", "--out", str(out))
    assert there.finish() == 0, there.stderr
    summary = there.json()["summary"]
    assert summary["outcome"] == "succeeded"
    assert summary["assembly_mode_changes"] == 1
    assert RunDirectory(out).read_scenario().controller == "unified"
    start = start_after(out)
    assert (start.x, start.y) == pytest.approx((0.0, 0.03), abs=2e-3)
    assert start.working_mode == (1, -1)
    back = fivebar("goto", "0.02", "0.14", "--mode", "+", "--after", str(out), "--plan-only", "--json")
    assert back.finish() == 0, back.stderr
    plan = back.json()["plan"]
    assert (plan["start"]["x"], plan["start"]["y"]) == (start.x, start.y)
    assert (plan["start"]["assembly_mode"], plan["goal"]["assembly_mode"]) == ("-", "+")


def test_a_standing_robot_goes_where_it_is_asked_to(fivebar: Callable[..., FivebarCommand], tmp_path: Path) -> None:
    with Bench(tmp_path) as bench:
        probe = bench.probe()
        probe.listen(RUN_STATUS)
        out = tmp_path / "stand"
        domain = str(bench.domain)
        scenario = tmp_path / "short.yaml"
        scenario.write_text(SHORT, encoding="utf-8")
        standing = fivebar("stand", str(scenario), "--seconds", "600", "--domain", domain, "--out", str(out))
        probe.wait_for(
            lambda: any('"sample": 0,' not in message.data for message in probe.got(RUN_STATUS)), "the run", 60.0
        )

        def ask(*arguments: str) -> FivebarCommand:
            """Ask again until the planned motion is over."""
            while True:
                command = fivebar("goto", *arguments, "--live", "--domain", domain)
                status = command.finish()
                if "moving for another" not in command.stdout:
                    assert status in (0, 2), command.stderr
                    return command

        moved = ask("0.0", "0.03", "--mode", "-", "--duration", "1.0")
        assert moved.stdout.splitlines() == ["planning", "moving: 1.000 s", "arrived"], moved.stderr
        refused = ask("0.0", "0.12", "--mode", "-")
        assert refused.status == 2
        assert "needs working mode (-1, +1)" in refused.stdout
        standing.send(signal.SIGINT)
        assert standing.finish() == 1
        assert "\ninterrupted: interrupted: stopped by a signal" in standing.stdout
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert (summary["outcome"], summary["faults"]) == ("interrupted", ["interrupted"])
    recording = read_bag(out / "bag")
    x, y = recording.field(REFERENCE, "position")[-1, :2].tolist()
    assert (round(x, 6), round(y, 6)) == (0.0, 0.03)
    assert [text.partition(":")[0] for text in recording.texts(FAULTS)] in ([], ["interrupted"])
