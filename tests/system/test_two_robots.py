"""Two robots in one domain, each in its namespace: both run, are recorded and reported, and do not hear each other."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from fivebar_command import FivebarCommand

from fivebar_bringup.report.report import write_report
from fivebar_bringup.runs.bag.definitions import absolute_name
from fivebar_bringup.runs.bag.reader import read_bag
from fivebar_bringup.runs.domain import private_domain
from fivebar_bringup.runs.run_directory import RunDirectory
from fivebar_description.interface import DIAGNOSTICS, GOAL, GOAL_STATUS, JOINT_STATES, RUN_READY

SCENARIO = "name: short\nwaypoints: [[0.0, 0.15], [0.0, {y}]]\nsegment_duration: 0.2\nforce: true\n"
SAMPLES = 101


def test_two_robots_run_in_one_domain(tmp_path: Path) -> None:
    calls: dict[str, FivebarCommand] = {}
    with private_domain() as domain:
        for name, y in (("robot1", 0.14), ("robot2", 0.13)):
            scenario = tmp_path / f"{name}.yaml"
            scenario.write_text(SCENARIO.format(y=y), encoding="utf-8")
            calls[name] = FivebarCommand(
                tmp_path / name,
                *("run", str(scenario), "--json", "--out", str(tmp_path / name / "out")),
                *("--domain", str(domain), "--namespace", name),
                domain=domain,
            )
        try:
            for call in calls.values():
                assert call.finish() == 0, call.stdout + call.stderr
                assert call.json()["samples"] == SAMPLES
        finally:
            for call in calls.values():
                call.close()
    heights = []
    for name in calls:
        bag = read_bag(tmp_path / name / "out" / "bag")
        assert {topic.split("/")[1] for topic in bag.topics} == {name, "diagnostics"}
        assert bag.count(DIAGNOSTICS) > 0
        assert {absolute_name(GOAL, name), absolute_name(GOAL_STATUS, name)} <= set(bag.topics)
        assert len(set(bag.texts(RUN_READY))) == len(bag.texts(RUN_READY))
        assert write_report(RunDirectory(tmp_path / name / "out"), with_page=False).outcome == "succeeded"
        heights.append(bag.field(JOINT_STATES, "position")[-1])
    assert not np.allclose(heights[0], heights[1], atol=1e-3)


def test_a_name_that_ros_does_not_take_is_refused(fivebar: Callable[..., FivebarCommand]) -> None:
    refused = fivebar("run", "middle", "--namespace", "robot 1")
    assert refused.finish() == 2
    assert "--namespace: 'robot 1': expected letters" in refused.stderr
