# SPDX-License-Identifier: Apache-2.0
"""`import fivebar`: what is public works as its documentation says, and loads neither ROS nor matplotlib."""

from __future__ import annotations

import doctest
import importlib
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import fivebar
from fivebar.picture import DISPLAYS

PACKAGE = Path(fivebar.__file__).parent
MODULES = ("fivebar", *(f"fivebar.{path.stem}" for path in sorted(PACKAGE.glob("[a-z]*.py"))))
LONG = ("fivebar.run.Run.plot", "fivebar.studies.sweep")
"""Those whose examples draw, or compile the loop, which takes longer than all others."""


def examples(names: tuple[str, ...]) -> list[doctest.DocTest]:
    modules = [importlib.import_module(name) for name in names]
    return [test for module in modules for test in doctest.DocTestFinder().find(module) if test.examples]


def expect_as_printed(test: doctest.DocTest) -> None:
    report: list[str] = []
    doctest.DocTestRunner().run(test, out=report.append)
    assert not report, "".join(report)


def marked(test: doctest.DocTest) -> Any:
    """Return a test of the examples of a name, a long one if they take long."""
    return pytest.param(test, id=test.name, marks=[pytest.mark.extra] if test.name in LONG else [])


@pytest.mark.parametrize("test", map(marked, examples(MODULES)))
def test_examples_print_what_they_say(test: doctest.DocTest) -> None:
    expect_as_printed(test)


@pytest.mark.extra
def test_a_run_draws_itself() -> None:
    assert fivebar.simulate("middle").plot("path")._repr_png_().startswith(b"\x89PNG")


def test_what_is_public_says_what_it_is_and_has_its_place_on_the_page() -> None:
    assert all(getattr(fivebar, name).__doc__ for name in fivebar.__all__)
    page = Path(__file__).parents[2] / "docs" / "reference" / "python.md"
    shown = re.findall(r"^::: ([\w.]+)\.(\w+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    assert all(hasattr(importlib.import_module(module), name) for module, name in shown)
    assert set(fivebar.__all__) - {name for _, name in shown} == {"Scenario"}, "whose keys are on the page of settings"


@pytest.mark.extra
def test_the_import_loads_neither_ros_nor_matplotlib() -> None:
    command = "import sys, fivebar; assert not {'rclpy', 'matplotlib'} & sys.modules.keys()"
    subprocess.run([sys.executable, "-c", command], check=True)


def test_a_run_is_described_in_a_notebook() -> None:
    motion = fivebar.plan("dextar", goal=(0.0, 0.02), assembly_mode="-", fastest=True)
    run = fivebar.simulate(motion)
    assert "<th>outcome</th><td>&quot;succeeded&quot;</td>" in run._repr_html_()
    assert (run.outcome, str(run).partition(",")[0]) == (fivebar.RunOutcome.SUCCEEDED, "succeeded")
    with pytest.raises(ValueError, match="one of them"):
        fivebar.plan("dextar", goal=(0.0, 0.02), duration=1.0, fastest=True)


def test_a_point_out_of_reach_has_no_posture() -> None:
    with pytest.raises(ValueError, match="out of reach"):
        fivebar.load_robot().posture(0.0, 0.4)


def test_objects_are_printed_in_a_few_lines() -> None:
    robot = fivebar.load_robot("dextar")
    motion = fivebar.plan(robot, goal=(0.0, 0.12))
    run = fivebar.simulate(motion)
    for thing in (robot, motion, run, run.scenario, run.summary, run.series, run.outcome, robot.posture(0.0, 0.1)):
        for text in (repr(thing), str(thing)):
            assert text.count("\n") < 5 and max(map(len, text.splitlines())) <= 200, text[:300]


def test_a_wrong_name_gets_the_one_that_is_meant() -> None:
    run = fivebar.simulate(fivebar.plan("dextar", goal=(0.0, 0.12)))
    with pytest.raises(fivebar.InputError, match=r"'torqes': expected one of .*did you mean torques\?"):
        run.plot("torqes")
    with pytest.raises(AttributeError, match="did you mean load_robot"):
        _ = fivebar.load_robots


def test_a_scenario_or_a_motion_is_loaded_with_changes() -> None:
    motion = fivebar.plan("dextar", goal=(0.0, 0.12))
    assert fivebar.load_scenario(motion) == fivebar.load_scenario(motion.scenario) == motion.scenario
    assert fivebar.load_scenario(motion, unified={"kp": 400.0}).unified.kp == 400.0
    for source in (motion, "unified_middle"):
        with pytest.raises(fivebar.InputError, match=r"^gains\.kp: does not apply to `unified`; use `unified:`$"):
            fivebar.load_scenario(source, gains={"kp": 400.0})


def test_the_loop_of_the_readme_ends_at_the_goal_without_a_fault() -> None:
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    loop = re.findall(r"```python\n(.*?)```", readme, re.DOTALL)[1]
    names: dict[str, Any] = {"fivebar": fivebar, "motion": fivebar.plan("dextar", goal=(0.0, 0.02), assembly_mode="-")}
    exec(loop, names)
    assert names["control"].fault is None
    assert names["command"].estimate[3:5] == pytest.approx((0.0, 0.02), abs=1e-4)


def test_the_readme_as_a_script_prints_a_result_and_where_its_figure_is(tmp_path: Path) -> None:
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    script = tmp_path / "snippet.py"
    script.write_text(re.findall(r"```python\n(.*?)```", readme, re.DOTALL)[0], encoding="utf-8")
    hidden = {name: value for name, value in os.environ.items() if name not in DISPLAYS} | {"TMPDIR": str(tmp_path)}
    done = subprocess.run([sys.executable, script], env=hidden, capture_output=True, text=True, check=True)
    result, figure = done.stdout.splitlines()
    assert result.startswith("succeeded, at most 0.08 mm from the reference")
    picture = Path(figure.removeprefix("figure: "))
    assert picture.read_bytes().startswith(b"\x89PNG") and picture.stat().st_size > 10_000
