# SPDX-License-Identifier: Apache-2.0
"""The node behind the live page, over DDS and over its connection: what it shows, and the little that it can do."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest
from graph_probe import Bench
from live_client import Page
from middle_motion import RATE_HZ, MiddleMotion
from std_msgs.msg import String

from fivebar_description.interface import (
    ALL_WELL,
    DRIVES_STATE,
    GOAL,
    JOINT_STATES,
    NANOSECONDS,
    RUN_EPOCH,
    RUN_STATUS,
    SAFETY_STATE,
    SUPERVISOR_STATE,
    sample_stamp_ns,
)
from fivebar_description.ros.messages import to_stamp
from fivebar_description.run_plan import epoch_text


def test_it_shows_one_robot_and_commands_no_torque(bench: Bench, motion: MiddleMotion) -> None:
    """In a namespace, beside the nodes of the same names in another."""
    viewer = bench.start("viewer", "/left")
    bench.start("trajectory_generator", "/left")
    left, right = bench.probe("/left"), bench.probe("/right")
    left.advertise(SAFETY_STATE)
    right.advertise(SAFETY_STATE)
    address = left.wait_for(lambda: re.search(r"view: (http\S+)", viewer.stdout), "the address")[1]
    page = Page(address)
    try:
        scene = page.next_of("scene", left)
        assert scene["waypoints"][0] == ["A", 0.0, 150.0]

        left.join("viewer", [SAFETY_STATE], [])
        right.publish(SAFETY_STATE, String(data="over_speed: of the other robot"))
        left.publish(SAFETY_STATE, String(data="tracking_lost: 51 mm"))

        def faults() -> list[Any]:
            found: list[Any] = page.next_of("states", left)["faults"]
            return found

        (fault,) = left.wait_for(faults, "the fault")
        assert (fault["text"], fault["meaning"][:12]) == ("tracking_lost: 51 mm", "The platform")

        page.send(command="torque_command", effort=[1.0, 1.0])
        assert page.next_of("notice", left)["text"].startswith("refused: expected one of the commands")
        page.send(command="emergency_stop")
        assert page.next_of("notice", left) == {"good": False, "text": "no node of the graph offers this"}
        page.send(command="plan", x=0.0, y=0.1, assembly=0)
        assert page.next_of("plan", left)["refused"] == "the run has not begun"

        topics = dict(left.node.get_publisher_names_and_types_by_node("viewer", "/left"))
        said = {name for name in topics if name.startswith("/left/")}
        assert said == {f"/left/{GOAL.name}", "/left/run/ready"}
    finally:
        page.close()


@pytest.mark.extra
def test_it_says_where_no_graph_is_seen(bench: Bench) -> None:
    hint = "view: no node of a graph is seen in"
    probe = bench.probe("/left")
    bench.start("trajectory_generator", "/left")
    probe.health("/left/trajectory_generator")
    beside_it = bench.start("viewer", "/left")
    probe.wait_for(lambda: "view: http" in beside_it.stdout, "the address")
    # begun later, hence silent for longer than the one above had to find its graph
    alone = bench.start("viewer", "/right")
    probe.wait_for(lambda: hint in alone.stdout, "the hint")
    assert f"{hint} domain {bench.domain}, namespace /right; waiting for one" in alone.stdout
    assert hint not in beside_it.stdout


def test_its_rows_are_the_samples(bench: Bench, motion: MiddleMotion) -> None:
    viewer = bench.start("viewer")
    bench.start("trajectory_generator")
    probe = bench.probe()
    probe.advertise(JOINT_STATES, SUPERVISOR_STATE)
    page = Page(probe.wait_for(lambda: re.search(r"view: (http\S+)", viewer.stdout), "the address")[1])
    try:
        page.next_of("scene", probe)
        probe.join("viewer", [JOINT_STATES], [])

        def rows_of(message: Any) -> dict[str, list[float]]:
            rows: dict[str, list[float]] = {"time": []}
            while not rows["time"]:
                # again and again, because the viewer does not ask for what is lost
                probe.publish(JOINT_STATES, message)
                rows = page.next_of("rows", probe)
            return rows

        message = motion.joint_states_message(100)
        rows = rows_of(message)
        assert rows["time"] == [0.2]
        state = motion.state(100)
        assert (rows["x"][0], rows["y"][0]) == pytest.approx((1e3 * state.x, 1e3 * state.y), abs=1e-6)
        assert rows["sigma"] == [None]

        # in real time, where stamps are those of the clock
        epoch_ns = 1_700_000_000 * NANOSECONDS
        probe.publish(RUN_EPOCH, String(data=epoch_text(epoch_ns)))
        page.next_of("restart", probe)
        message.header.stamp = to_stamp(sample_stamp_ns(200, RATE_HZ, epoch_ns))
        assert rows_of(message)["time"] == [0.4]
    finally:
        page.close()


def test_the_end_of_a_run_is_no_fault(bench: Bench) -> None:
    """Of a graph that nobody tells the viewer about: finished, interrupted and stopped, from its messages alone."""
    viewer = bench.start("viewer")
    probe = bench.probe()
    probe.advertise(RUN_STATUS, DRIVES_STATE)
    page = Page(probe.wait_for(lambda: re.search(r"view: (http\S+)", viewer.stdout), "the address")[1])

    def publish(state: str, sample: int, drives: str) -> None:
        status = {"state": state, "sample": sample, "samples": 9}
        probe.publish(RUN_STATUS, String(data=json.dumps(status)))
        probe.publish(DRIVES_STATE, String(data=drives))

    def said() -> tuple[str, list[str]]:
        states = page.next_of("states", probe)
        return states["state"]["word"], [fault["text"] for fault in states["faults"]]

    ended, diverged = "drives_off: the plant has ended", "plant_diverged: after sample 7"
    try:
        probe.join("viewer", [RUN_STATUS, DRIVES_STATE], [])
        for state, sample, drives, expected in (
            ("running", 5, ALL_WELL, ("running", [])),
            ("completed", 9, ended, ("finished", [])),
            ("running", 5, ALL_WELL, ("running", [])),
            ("running", 6, ended, ("interrupted", [])),
            ("running", 5, ALL_WELL, ("running", [])),
            ("failed", 7, diverged, ("stopped", [diverged])),
            ("failed", 7, ended, ("stopped", [diverged])),
        ):
            publish(state, sample, drives)
            probe.wait_for(lambda expected=expected: said() == expected, str(expected))  # type: ignore[misc]
    finally:
        page.close()
