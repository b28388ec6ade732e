# SPDX-License-Identifier: Apache-2.0
"""Nodes that share a process answer as nodes of their own do, and hear outsiders as these do."""

from __future__ import annotations

from typing import Any

import pytest
from graph_probe import Bench, Probe
from middle_motion import MiddleMotion
from std_msgs.msg import String

from fivebar_description.interface import (
    CTC_TORQUE,
    FAULTS,
    JOINT_STATES,
    REFERENCE,
    SUPERVISOR_STATE,
    TORQUE_COMMAND,
    TORQUE_REQUESTED,
    VHC_TORQUE,
)
from fivebar_description.ros.messages import stamp_of

CHAIN = ("trajectory_generator", "supervisor", "ctc_controller", "vhc_controller", "blender")
OUTPUTS = [REFERENCE, SUPERVISOR_STATE, CTC_TORQUE, VHC_TORQUE, TORQUE_REQUESTED, TORQUE_COMMAND]
COUNT = 60


def join(probe: Probe) -> None:
    probe.advertise(FAULTS)
    for node in CHAIN:
        probe.join(node, [JOINT_STATES], OUTPUTS if node == CHAIN[0] else [])


@pytest.fixture
def group(bench: Bench) -> Probe:
    modules = [f"fivebar_control.nodes.{node}" for node in CHAIN]
    bench.start_group(*modules)
    probe = bench.probe()
    join(probe)
    return probe


def ask(probe: Probe, motion: MiddleMotion, samples: range) -> None:
    """Ask for the torque of one sample after the other, as the plant does in lockstep."""
    for sample in samples:
        if sample == 0:
            probe.ask([(JOINT_STATES, motion.joint_states_message(0))], [TORQUE_COMMAND], 0)
        else:
            probe.publish(JOINT_STATES, motion.joint_states_message(sample))
        probe.answer(TORQUE_COMMAND, sample)


def answers(probe: Probe, last: int) -> dict[str, dict[int, tuple[Any, ...]]]:
    """Return what each topic said of each stamp, once all of it has come; the reference is one sample ahead."""
    for topic in OUTPUTS:
        probe.answer(topic, last + (topic is REFERENCE))
    return {
        topic.name: {
            stamp_of(message): (tuple(message.position), tuple(message.velocity), tuple(message.effort))
            for message in probe.got(topic)
        }
        for topic in OUTPUTS
    }


def test_in_one_process_they_answer_as_in_five(bench: Bench, group: Probe, motion: MiddleMotion) -> None:
    ask(group, motion, range(COUNT))
    together = answers(group, COUNT - 1)
    with Bench(bench.folder / "apart") as apart:
        for node in CHAIN:
            apart.start(node)
        probe = apart.probe()
        join(probe)
        ask(probe, motion, range(COUNT))
        separate = answers(probe, COUNT - 1)
    assert together == separate
    assert {name: len(said) for name, said in together.items()} == {
        topic.name: COUNT + (topic is REFERENCE) for topic in OUTPUTS
    }


def test_a_fault_from_outside_stops_the_group(group: Probe, motion: MiddleMotion) -> None:
    ask(group, motion, range(5))
    assert tuple(group.answer(TORQUE_COMMAND, 4).effort) != (0.0, 0.0)
    group.publish(FAULTS, String(data="camera_lost: for this test"))
    group.wait_for(lambda: tuple(group.got(TORQUE_COMMAND)[-1].effort) == (0.0, 0.0), "zero torque")
    ask(group, motion, range(5, 8))
    assert tuple(group.answer(TORQUE_COMMAND, 7).effort) == (0.0, 0.0)
