# SPDX-License-Identifier: Apache-2.0
"""Crossings on two emulated ODrives: frames on a CAN bus between bridge and drives, each in a process of its own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from fivebar_command import FivebarCommand
from rehearsed import expect_crossing, expect_stop

from fivebar_bringup.bag.reader import read_bag
from fivebar_description.interface import JOINT_STATES, MOTOR_STATES, REFERENCE, TORQUE_COMMAND

pytestmark = [pytest.mark.clock, pytest.mark.extra]

REHEARSED = ("run", "middle_robot", "--hardware", "emulated", "--drives", "odrive", "--json")


def test_the_middle_crossing(fivebar: Callable[..., FivebarCommand], folder: Path) -> None:
    call = fivebar(*REHEARSED, "--out", str(folder / "odrive"))
    expect_crossing(call)


@pytest.mark.parametrize(
    ("broken", "fault"),
    [
        ("0.5 fault 1 DC_BUS_UNDER_VOLTAGE", "odrive_error: q11 (node 0): DC_BUS_UNDER_VOLTAGE"),
        ("1.2 unplug", "feedback_missing: q11 (id 0): no answer"),
        ("0.5 fault 2 BRAKE_RESISTOR_DISARMED", "odrive_error: q21 (node 1): BRAKE_RESISTOR_DISARMED"),
        ("0.5 silent 2", "feedback_missing: q21 (id 1): no answer"),
        ("1.2 frozen 2", "encoder_frozen: "),
        ("0.5 kill drive_bridge", "node_died: drive_bridge "),
        ("0.5 kill blender", "node_died: controllers "),
    ],
)
def test_a_fault_on_the_way(fivebar: Callable[..., FivebarCommand], folder: Path, broken: str, fault: str) -> None:
    expect_stop(fivebar, REHEARSED, broken, folder / broken.replace(" ", "_"), fault)


TOGETHER = (*REHEARSED, "--together")
"""With the bridge in the process of the control chain."""


def test_the_middle_crossing_in_one_process(fivebar: Callable[..., FivebarCommand], folder: Path) -> None:
    call = fivebar(*TOGETHER, "--out", str(folder / "together"))
    expect_crossing(call)
    latency = call.json()["latency_ms"]
    assert 0.0 < latency["p50"] <= latency["p99"] <= latency["max"]
    # what the chain computes is published all the same, though the torque does not wait for it
    bag = read_bag(folder / "together" / "bag")
    assert {bag.count(topic) >= 201 for topic in (MOTOR_STATES, JOINT_STATES, REFERENCE, TORQUE_COMMAND)} == {True}


@pytest.mark.parametrize(
    ("broken", "fault"),
    [("0.5 silent 2", "feedback_missing: q21 (id 1): no answer"), ("0.5 kill blender", "node_died: controllers ")],
)
def test_a_fault_in_one_process(fivebar: Callable[..., FivebarCommand], folder: Path, broken: str, fault: str) -> None:
    expect_stop(fivebar, TOGETHER, broken, folder / f"together_{broken.replace(' ', '_')}", fault)
