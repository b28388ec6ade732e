"""`import fivebar`: what is public works as its documentation says, and loads neither ROS nor matplotlib."""

from __future__ import annotations

import doctest
import importlib
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import fivebar

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
