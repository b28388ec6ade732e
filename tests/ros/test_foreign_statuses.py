# SPDX-License-Identifier: Apache-2.0
"""Statuses of other runs and of nobody: none of them decides, and none ends who listens."""

from __future__ import annotations

import json
import os
from typing import Any

import pytest
from graph_probe import DEADLINE, Bench
from std_msgs.msg import String

from fivebar_bringup.nodes.goal_client import GoalClient
from fivebar_bringup.nodes.run_monitor import RunMonitor
from fivebar_description.interface import GOAL, GOAL_STATUS, GOAL_TRAJECTORY, PROGRAM_STATUS, RUN_PLAN, RUN_STATUS
from fivebar_description.ros.domain_member import DomainMember
from fivebar_description.run_plan import plan_text

UNREADABLE = ("x", '{"sample": 5}', '{"sample":"x","samples":1}', "[" * 5000, "[]", '{"state": "arrived", "goal": 5}')
OWN, OTHER = 1_000_001, 1_000_002


def status(sample: int, **source: int) -> str:
    return json.dumps({"state": "running", "sample": sample, "samples": 50, "overruns": 0, **source})


def test_a_launcher_takes_the_statuses_of_its_own_nodes_alone(bench: Bench) -> None:
    with DomainMember("rogue", bench.domain) as rogue, RunMonitor(bench.domain, "", [OWN]) as monitor:
        run, program = rogue.advertise(RUN_STATUS), rogue.advertise(PROGRAM_STATUS)
        assert rogue.wait_for(lambda: run.get_subscription_count() and program.get_subscription_count(), DEADLINE)

        def publish(text: str, taken: Any) -> None:
            run.publish(String(data=text))
            assert monitor.wait_for(taken, DEADLINE), text[:50]

        publish(status(7, pid=OWN), lambda: monitor.status)
        for count, text in enumerate(UNREADABLE, start=1):
            publish(text, lambda count=count: monitor.refused[RUN_STATUS.name] == count)
        publish(status(50, pid=OTHER), lambda: OTHER in monitor.strangers)
        publish(status(50), lambda: None in monitor.strangers)
        program.publish(String(data="[" * 5000))
        assert monitor.wait_for(lambda: monitor.refused[PROGRAM_STATUS.name] == 1, DEADLINE)
        program.publish(String(data=json.dumps({"state": "completed", "pid": OTHER + 1})))
        assert monitor.wait_for(lambda: OTHER + 1 in monitor.strangers, DEADLINE)
        publish(status(8, pid=OWN), lambda: monitor.status["sample"] == 8)
        assert monitor.program == {}


def test_a_request_ends_with_its_own_status_alone(bench: Bench) -> None:
    with DomainMember("server", bench.domain) as server, GoalClient(bench.domain) as client:
        asked: list[Any] = []
        server.listen(GOAL, asked.append)
        server.listen(GOAL_TRAJECTORY, asked.append)
        publisher = server.advertise(GOAL_STATUS)
        assert client.find()
        client.request({"x": 0.0, "y": 0.1})
        assert server.wait_for(lambda: asked and publisher.get_subscription_count(), DEADLINE)
        for text in UNREADABLE:
            publisher.publish(String(data=text))
            assert client.wait_for(
                lambda text=text: client.refused[GOAL_STATUS.name] == UNREADABLE.index(text) + 1, DEADLINE
            )
        answer = {"state": "arrived", "goal": [0.0, 0.1]}
        for foreign in (answer, {**answer, "id": "another"}):
            publisher.publish(String(data=json.dumps(foreign)))
            assert client.next_status(0.2) is None
        publisher.publish(String(data=json.dumps({**answer, "id": asked[0].header.frame_id})))
        found = client.next_status(DEADLINE)
        assert found is not None
        assert found["state"] == "arrived"


@pytest.mark.extra
def test_a_node_says_whose_plan_it_refuses(bench: Bench) -> None:
    node = bench.start("supervisor")
    probe = bench.probe()
    probe.publish(RUN_PLAN, String(data="[" * 5000))
    probe.report("/supervisor", lambda values: values["dropped"] == "1")
    probe.publish(RUN_PLAN, String(data=plan_text({"zone.epsilon": {"content": "\x1b[31m"}})))
    probe.wait_for(lambda: "refuses" in node.stderr, "the refusal")
    (line,) = [line for line in node.stderr.splitlines() if "refuses" in line]
    assert f"; that plan is of process {os.getpid()} (" in line
    assert "\x1b[31m" not in line
