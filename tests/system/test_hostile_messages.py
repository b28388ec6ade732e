# SPDX-License-Identifier: Apache-2.0
"""Messages of random and mutated kinds beside a running graph change nothing in it, and the run keeps its result."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml
from fivebar_command import RUN_DEADLINE, FivebarCommand, GraphRun
from graph_probe import Bench
from hostile_messages import HostileMessages

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.recording import Recording
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    CONTROL_CHAIN,
    ESTIMATE_COVARIANCE,
    ESTIMATE_NAMES,
    FAULTS,
    GOAL,
    GOAL_STATUS,
    GROUND_TRUTH,
    JOINT_STATES,
    JOINTS,
    PROGRAM_STATUS,
    RUN_READY,
    RUN_STATUS,
    TORQUE_COMMAND,
    TORQUE_REQUESTED,
    Topic,
)
from fivebar_description.ros.domain_member import DomainMember

TEXTS = {
    RUN_STATUS: json.dumps({"state": "completed", "sample": 7, "samples": 9, "overruns": 3, "pid": 1}),
    RUN_READY: '{"node": "plant"}',
    GOAL_STATUS: json.dumps({"state": "arrived", "goal": [0.0, 0.1]}),
    PROGRAM_STATUS: json.dumps({"state": "completed", "reason": "none"}),
}
JOINT_TOPICS = {
    GOAL: ("x", "y"),
    GROUND_TRUTH: JOINTS,
    TORQUE_REQUESTED: ACTIVE_JOINTS,
    ESTIMATE_COVARIANCE: ESTIMATE_NAMES,
}
"""Topics outside the control chain: on those of the chain a second publisher is a fault, whatever it says."""


def torques(bag: Recording) -> dict[int, bytes]:
    """Return the first torque of each stamp, as bytes."""
    stamps, efforts = bag.stamps(TORQUE_COMMAND), bag.field(TORQUE_COMMAND, "effort")
    _, first = np.unique(stamps, return_index=True)
    return {int(stamps[place]): efforts[place].tobytes() for place in first}


SENSORS = {
    "plant": {"encoder_counts": 20000, "delay_samples": 1},
    "estimator": "ekf",
    "ekf": {"gyro": True},
    "sensors": {"passive_encoder": {"leg": 1}},
}


def test_messages_on_the_chain_stop_the_robot_by_name_and_end_no_node(graph_run: Callable[..., GraphRun]) -> None:
    """On every topic of the chain in turn, by one rogue that stays; then the run is interrupted."""
    run = graph_run("--no-page", controller="unified", **SENSORS)
    run.probe.listen(FAULTS)
    run.wait_for_sample(50)
    messages = HostileMessages(seed=10)
    with DomainMember("rogue", run.probe.domain) as rogue:
        published = [one for one in CONTROL_CHAIN if run.probe.node.get_publishers_info_by_topic(resolved(run, one))]
        assert len(published) > 10
        begun = len(run.probe.got(TORQUE_COMMAND))
        for topic in published:
            publisher = rogue.advertise(topic)
            for _ in range(20):
                publisher.publish(messages.any(topic))
        run.probe.wait_for(lambda: run.probe.got(FAULTS), "the fault")
        # the rogue's own commands may come after it
        run.probe.wait_for(
            lambda: any(tuple(one.effort) == (0.0, 0.0) for one in run.probe.got(TORQUE_COMMAND)[begun:]), "no torque"
        )
        run.command.send(signal.SIGINT)
        summary = run.finish()
    assert (summary["faults"][0], summary["outcome"]) == ("second_publisher", "stopped")
    assert not {name for name in summary["faults"] if name.startswith("node_")}
    assert tuple(run.bag().field(TORQUE_COMMAND, "effort")[-1]) == (0.0, 0.0)
    assert run.bag().count(JOINT_STATES) >= 50
    logs = "".join(path.read_text(encoding="utf-8") for path in (run.out / "logs").iterdir())
    assert "Traceback" not in logs + run.command.stderr


def resolved(run: GraphRun, topic: Topic) -> str:
    return str(run.probe.node.resolve_topic_name(topic.name))


@pytest.mark.extra
@pytest.mark.parametrize(
    ("count", "segment"),
    [(1000, 1.0), (20_000, 30.0)],
    ids=["short", "full"],
)
def test_messages_outside_the_chain_change_no_torque(tmp_path: Path, count: int, segment: float) -> None:
    scenario = tmp_path / "scenario.yaml"
    waypoints = [[0.0, 0.15], [0.0, 0.02], [0.0, 0.15]]
    content = {"name": "attacked", "waypoints": waypoints, "segment_duration": segment, "force": True}
    scenario.write_text(yaml.safe_dump(content), encoding="utf-8")
    last = 1_000_000_000 + round(2 * segment * 1e9)
    messages = HostileMessages(seed=35)
    with Bench(tmp_path / "bench") as bench, DomainMember("rogue", bench.domain) as rogue:
        heard: list[int] = []
        rogue.listen(JOINT_STATES, lambda message: heard.append(message.header.stamp.sec))
        publishers = {topic: rogue.advertise(topic) for topic in (*TEXTS, *JOINT_TOPICS)}
        attacked = FivebarCommand(
            tmp_path / "run", "run", str(scenario), "--json", "--out", "out", "--domain", str(bench.domain),
            domain=bench.domain,
        )  # fmt: skip
        try:
            assert rogue.wait_for(lambda: heard, RUN_DEADLINE)
            topics = [*TEXTS, *JOINT_TOPICS]
            for number in range(count):
                topic = topics[number % len(topics)]
                message = messages.texts(TEXTS[topic]) if topic in TEXTS else messages.joints(JOINT_TOPICS[topic])
                publishers[topic].publish(message)
            assert attacked.status is None, attacked.stderr
            assert attacked.finish() == 0, attacked.stderr + attacked.stdout
            assert "Traceback" not in attacked.stderr
        finally:
            attacked.close()
    summary = attacked.json()
    assert summary["faults"] == []
    assert summary["stray_messages"] > 0
    clean = FivebarCommand(tmp_path / "clean", "simulate", str(scenario), "--json", "--out", "out")
    try:
        assert clean.finish() == 0, clean.stderr
    finally:
        clean.close()
    expected = torques(read_bag(tmp_path / "clean" / "out" / "bag"))
    assert len(expected) == round(2 * segment * 500) + 1
    assert max(expected) == last
    assert torques(read_bag(tmp_path / "run" / "out" / "bag")) == expected
    logs = "".join(path.read_text(encoding="utf-8") for path in (tmp_path / "run" / "out" / "logs").iterdir())
    assert "Traceback" not in logs
