# SPDX-License-Identifier: Apache-2.0
"""Input that must not be used: it is left out and counted, and the next good sample is answered as if nothing was."""

from __future__ import annotations

import copy
import math
from array import array
from collections.abc import Callable
from typing import Any, NamedTuple

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from graph_probe import RATE_HZ, Bench, Probe
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from middle_motion import MiddleMotion

from fivebar_description.interface import (
    CTC_TORQUE,
    FAULTS,
    IMU_DATA,
    IMU_ERROR,
    JOINT_STATES,
    JOINTS,
    REFERENCE,
    START_STAMP_NS,
    SUPERVISOR_STATE,
    TORQUE_COMMAND,
    UNIFIED_TORQUE,
    VHC_TORQUE,
    Topic,
    sample_stamp_ns,
)
from fivebar_description.joint_sample import LARGEST
from fivebar_description.ros.messages import stamp_of, to_stamp


class Part(NamedTuple):
    """A node's inputs, each with the fields that it reads; the first drives. Then the topic of its answers."""

    inputs: dict[Topic, tuple[str, ...]]
    output: Topic


STATE = ("position", "velocity")
PARTS = {
    "trajectory_generator": Part({JOINT_STATES: ("position",)}, REFERENCE),
    "supervisor": Part({JOINT_STATES: STATE}, SUPERVISOR_STATE),
    "ctc_controller": Part({JOINT_STATES: STATE, REFERENCE: STATE}, CTC_TORQUE),
    "vhc_controller": Part({JOINT_STATES: STATE, REFERENCE: STATE}, VHC_TORQUE),
    "unified_controller": Part({JOINT_STATES: STATE, REFERENCE: STATE}, UNIFIED_TORQUE),
    "imu_listener": Part({IMU_DATA: ("linear_acceleration",), REFERENCE: STATE}, IMU_ERROR),
    "blender": Part(
        {
            JOINT_STATES: STATE,
            REFERENCE: ("position",),
            CTC_TORQUE: ("effort",),
            VHC_TORQUE: ("effort",),
            SUPERVISOR_STATE: ("position",),
        },
        TORQUE_COMMAND,
    ),
}
MAY_BE_NAN = (CTC_TORQUE, VHC_TORQUE)
"""Candidates: NaN says that a law is undefined, which is for the blend to judge."""


class Setting(NamedTuple):
    """A node under test, and what has been done to it so far."""

    node: str
    probe: Probe
    motion: MiddleMotion
    expected: dict[str, int]

    def good(self, topic: Topic, sample: int) -> Any:
        messages: dict[Topic, Callable[[], Any]] = {
            JOINT_STATES: lambda: self.motion.joint_states_message(sample),
            REFERENCE: lambda: self.motion.reference_message(sample),
            CTC_TORQUE: lambda: self.motion.torque_message(sample, (0.1, 0.2)),
            VHC_TORQUE: lambda: self.motion.torque_message(sample, (0.3, 0.4)),
            SUPERVISOR_STATE: lambda: self.motion.supervisor_message(sample, 0.5),
            IMU_DATA: lambda: self.motion.imu_message(sample, (1e3 * sample, 0.0)),
        }
        return messages[topic]()

    def next_sample(self) -> int:
        self.expected["sample"] += 1
        return self.expected["sample"]

    def spoil(self, topic: Topic, message: Any) -> None:
        """Publish a message that must be dropped."""
        self.probe.publish(topic, message)
        self.expected["dropped"] += 1

    def expect_answer(self, sample: int) -> None:
        """Publish the good inputs of a sample and wait until it is answered."""
        # the driving one last: its neighbours' order is the network's affair, that within a topic is not
        for topic in reversed(PARTS[self.node].inputs):
            self.probe.publish(topic, self.good(topic, sample))
        self.wait(sample)

    def wait(self, sample: int) -> None:
        output = PARTS[self.node].output
        if output is IMU_ERROR:
            self.probe.wait_for(lambda: sample in self.answered(), f"{output.name} of sample {sample}")
        else:
            self.probe.answer(output, sample + self.ahead)

    @property
    def ahead(self) -> int:
        """How many samples the answers are ahead."""
        return 1 if self.node == "trajectory_generator" else 0

    def answered(self) -> list[int]:
        """Return the samples that were answered, in order; of those with an unstamped answer the figure tells."""
        output = PARTS[self.node].output
        if output is IMU_ERROR:
            return [round(message.data / 1e3) for message in self.probe.got(output)]
        return [sample - self.ahead for sample in self.probe.samples(output) if sample is not None]


@pytest.fixture(scope="module")
def parts(shared_bench: Bench, motion: MiddleMotion) -> dict[str, Setting]:
    """All nodes, each with a probe that is the rest of its graph, after sample 0."""
    for node in PARTS:
        more = {"candidate_deadline_ms": 30_000.0} if node == "blender" else {}
        shared_bench.start(node, f"/{node}", **more)
    settings = {}
    for node, part in PARTS.items():
        probe = shared_bench.probe(f"/{node}")
        probe.join(node, [*part.inputs, *([FAULTS] if node == "blender" else [])], [part.output])
        settings[node] = Setting(node, probe, motion, {"sample": 0, "dropped": 0})
    for setting in settings.values():
        setting.expect_answer(setting.next_sample())
    return settings


def changed(message: Any, **fields: Any) -> Any:
    other = copy.deepcopy(message)
    for field, value in fields.items():
        setattr(other, field, value)
    return other


def stamped(message: Any, stamp_ns: int) -> Any:
    other = copy.deepcopy(message)
    other.header.stamp = to_stamp(stamp_ns)
    return other


def wrong_stamps(message: Any, sample: int) -> list[Any]:
    stamps = (
        stamp_of(message) + 1,
        stamp_of(message) - 1,
        START_STAMP_NS - (sample_stamp_ns(1, RATE_HZ) - START_STAMP_NS),
        0,
        sample_stamp_ns(sample - 2, RATE_HZ),
    )
    return [stamped(message, stamp) for stamp in stamps]


def wrong_contents(topic: Topic, message: Any, fields: tuple[str, ...]) -> list[Any]:
    if topic is IMU_DATA:
        spoiled = [copy.deepcopy(message) for _ in range(3)]
        spoiled[0].linear_acceleration.x = math.nan
        spoiled[1].linear_acceleration.y = math.inf
        spoiled[2].linear_acceleration.x = -math.inf
        return spoiled
    names = list(message.name)
    results = [
        changed(message, name=given)
        for given in ([], names[:-1], [*names, "more"], [*names[:-1], "other"], [names[0]] * len(names))
    ]
    for field in fields:
        values = list(getattr(message, field))
        wrong = [values[:-1], [*values, 0.0], [], [*values[:-1], math.inf], [-math.inf, *values[1:]]]
        wrong += [] if topic in MAY_BE_NAN else [[math.nan, *values[1:]]]
        results += [changed(message, **{field: array("d", given)}) for given in wrong]
    return results


@pytest.mark.parametrize("node", PARTS)
def test_every_input_is_checked(parts: dict[str, Setting], node: str) -> None:
    setting = parts[node]
    while setting.expected["sample"] < 4:
        setting.expect_answer(setting.next_sample())
    for topic, fields in PARTS[node].inputs.items():
        example = setting.good(topic, 0)
        for number in range(len(wrong_stamps(example, 2)) + len(wrong_contents(topic, example, fields))):
            sample = setting.next_sample()
            good = setting.good(topic, sample)
            setting.spoil(topic, [*wrong_stamps(good, sample), *wrong_contents(topic, good, fields)][number])
            setting.expect_answer(sample)
    # another one, so that an answer to the last bad message would have come by now
    setting.expect_answer(setting.next_sample())
    last = setting.expected["sample"]
    answered = setting.answered()
    assert answered[answered.index(5) :] == list(range(5, last + 1))
    setting.probe.wait_for_dropped(f"/{node}/{node}", setting.expected["dropped"])
    status, values = setting.probe.health(f"/{node}/{node}")
    assert status.level == DiagnosticStatus.WARN
    assert status.message.startswith("messages dropped, last: ") or node == "imu_listener"
    assert int(values["answered"]) >= last


def permuted(message: Any) -> Any:
    """Return the message with its joints in reverse order."""
    other = copy.deepcopy(message)
    other.name = list(reversed(message.name))
    for field in ("position", "velocity", "effort"):
        setattr(other, field, array("d", reversed(getattr(message, field))))
    return other


@pytest.mark.parametrize("node", ["supervisor", "ctc_controller", "vhc_controller", "imu_listener", "blender"])
def test_joints_may_come_in_any_order(parts: dict[str, Setting], node: str) -> None:
    setting = parts[node]
    first, second = setting.next_sample(), setting.next_sample()
    setting.expect_answer(first)
    for topic in reversed(PARTS[node].inputs):
        # the same figures one sample later
        message = stamped(setting.good(topic, first), sample_stamp_ns(second, RATE_HZ))
        setting.probe.publish(topic, message if topic is IMU_DATA else permuted(message))
    output = PARTS[node].output
    if output is IMU_ERROR:
        setting.probe.wait_for(lambda: setting.answered()[-2:] == [first, first], "the same error twice")
    else:
        answer, before = setting.probe.answer(output, second), setting.probe.answer(output, first)
        assert [answer.position, answer.velocity, answer.effort] == [before.position, before.velocity, before.effort]


FLOATS = st.floats(width=64)
NAMES = st.one_of(st.permutations(JOINTS), st.lists(st.sampled_from([*JOINTS, "", "q13", "Q11"]), max_size=6))
VALUES = st.one_of(
    st.lists(st.floats(-1e3, 1e3), min_size=4, max_size=4),
    st.lists(FLOATS, min_size=4, max_size=4),
    st.lists(FLOATS, max_size=6),
)
OFFSETS = st.one_of(st.just(0), st.integers(-1_999_999, 1_999_999))


def is_good(names: list[str], position: list[float], velocity: list[float]) -> bool:
    return sorted(names) == sorted(JOINTS) and all(
        len(values) == len(JOINTS) and all(abs(value) <= LARGEST for value in values) for values in (position, velocity)
    )


@settings(
    max_examples=150, deadline=None, derandomize=True, database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)  # fmt: skip
@given(names=NAMES, position=VALUES, velocity=VALUES, effort=VALUES, offset=OFFSETS)
def test_no_content_disturbs_the_supervisor(
    parts: dict[str, Setting],
    names: list[str],
    position: list[float],
    velocity: list[float],
    effort: list[float],
    offset: int,
) -> None:
    """Arbitrary names, lengths, figures and stamps around the sample that is due."""
    setting = parts["supervisor"]
    due = [setting.next_sample()]
    message = stamped(setting.good(JOINT_STATES, due[0]), sample_stamp_ns(due[0], RATE_HZ) + offset)
    message.name = list(names)
    message.position, message.velocity, message.effort = (array("d", values) for values in (position, velocity, effort))
    before = len(setting.probe.got(SUPERVISOR_STATE))
    if offset == 0 and is_good(names, position, velocity):
        setting.probe.publish(JOINT_STATES, message)
        due.append(setting.next_sample())
    else:
        setting.spoil(JOINT_STATES, message)
    setting.expect_answer(due[-1])
    assert setting.probe.samples(SUPERVISOR_STATE)[before:] == due


def test_the_supervisor_has_counted_all_of_it(parts: dict[str, Setting]) -> None:
    setting = parts["supervisor"]
    setting.expect_answer(setting.next_sample())
    setting.probe.wait_for_dropped("/supervisor/supervisor", setting.expected["dropped"])
