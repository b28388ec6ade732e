# SPDX-License-Identifier: Apache-2.0
"""A law that is not in the tree runs everywhere: as a node, without ROS, compiled, and in the comparison."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from bag_contents import contents
from fivebar_command import FivebarCommand

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.recording import Recording
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.engine import traced_crossing
from fivebar_bringup.simulation.engine_table import TraceRow
from fivebar_control.loop.sampled_plan import sampled
from fivebar_description.interface import JOINT_STATES, TORQUE_COMMAND, Topic, torque_topic

SCENARIO = """
name: with_toy_law
controller: toy_law:LAW
waypoints: [[0.0, 0.15], [0.02, 0.13]]
segment_duration: 0.4
law: {ki: 40.0}
"""
SAMPLES = 201
TOY_TORQUE = torque_topic("toy")


@pytest.fixture(scope="module")
def scenario(folder: Path) -> Iterator[Path]:
    """The scenario, while every process finds the module of the law."""
    path = folder / "with_toy_law.yaml"
    path.write_text(SCENARIO, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(Path(__file__).parents[1] / "support"))
        yield path


@pytest.fixture(scope="module")
def bags(fivebar: Callable[..., FivebarCommand], folder: Path, scenario: Path) -> dict[str, Recording]:
    bags = {}
    for command in ("run", "simulate"):
        out = folder / f"toy_{command}"
        call = fivebar(command, str(scenario), "--json", "--out", str(out))
        assert call.finish() == 0, call.stderr
        assert call.json()["outcome"] == "succeeded"
        bags[command] = read_bag(out / "bag")
    return bags


@pytest.mark.extra
@pytest.mark.parametrize("topic", [TOY_TORQUE, TORQUE_COMMAND, JOINT_STATES], ids=lambda topic: topic.name)
def test_the_graph_and_the_offline_runner_agree_bit_for_bit(bags: dict[str, Recording], topic: Topic) -> None:
    ros, offline = (contents(bags[command], topic) for command in ("run", "simulate"))
    assert len(ros) >= SAMPLES
    assert ros == offline


@pytest.mark.extra
def test_the_compiled_engine_runs_the_law_with_its_settings_and_its_memory(
    bags: dict[str, Recording], scenario: Path
) -> None:
    loaded = load_scenario(str(scenario))
    plan = sampled(loaded.five_bar(), loaded.plan(), loaded.rate_hz, loaded.lead_samples)
    outcome, trace = traced_crossing(case_of(loaded), plan)
    assert (outcome.samples, outcome.fault) == (SAMPLES, 0)
    columns = [TraceRow._fields.index(name) for name in ("command1", "command2")]
    wanted = bags["simulate"].field(TORQUE_COMMAND, "effort")[:SAMPLES]
    np.testing.assert_allclose(trace[:, columns], wanted, rtol=0.0, atol=1e-9)
    # the integral action is at work: without it the torque is another one
    without, _ = traced_crossing(case_of(loaded.model_copy(update={"law": {"ki": 0.0}})), plan)
    assert abs(without.error_final - outcome.error_final) > 1e-5


@pytest.mark.extra
def test_it_is_compared_with_the_laws_of_the_tree(
    fivebar: Callable[..., FivebarCommand], folder: Path, scenario: Path
) -> None:
    out = folder / "compared"
    call = fivebar(
        "compare", str(scenario), "--controllers", "toy_law:LAW", "--rig", "ideal", "--durations", "0.4",
        "--jobs", "1", "--json", "--out", str(out),
    )  # fmt: skip
    assert call.finish() in (0, 1), call.stderr
    controllers = {run["controller"] for run in call.json()["runs"]}
    assert controllers == {"toy_law:LAW"}
    assert "toy_law:LAW" in (out / "compare.html").read_text(encoding="utf-8")


@pytest.mark.extra
@pytest.mark.parametrize(
    ("controller", "words"),
    [
        (
            "toy",
            "expected one of ctc, multi_joint, multi_cartesian, multi_model_ctc, unified, mpc, lqr, path, or ",
        ),
        ("toy_law:NOTHING", "cannot be loaded"),
        ("no_such_module:LAW", "cannot be loaded: No module named"),
        ("toy_law:NO_LAW", "expected a fivebar_control.laws.law.Law, found float"),
        ("toy_law:TAKEN", "the name 'ctc' is taken"),
        ("toy_law:NOT_A_TOPIC", "expected a word of lower-case letters"),
    ],
)
def test_a_controller_that_is_none_is_refused_with_a_reason(
    fivebar: Callable[..., FivebarCommand], folder: Path, scenario: Path, controller: str, words: str
) -> None:
    path = folder / "refused.yaml"
    path.write_text(SCENARIO.replace("toy_law:LAW", controller), encoding="utf-8")
    call = fivebar("simulate", str(path))
    assert call.finish() == 2
    assert len(call.stderr.strip().splitlines()) == 1
    assert words in call.stderr
    assert "controller" in call.stderr


def test_settings_of_the_law_are_checked(fivebar: Callable[..., FivebarCommand], folder: Path, scenario: Path) -> None:
    path = folder / "bad_setting.yaml"
    path.write_text(SCENARIO.replace("ki: 40.0", "ki: -1.0"), encoding="utf-8")
    call = fivebar("simulate", str(path))
    assert call.finish() == 2
    assert "ki: -1.0: expected at least 0" in call.stderr
