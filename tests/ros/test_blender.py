# SPDX-License-Identifier: Apache-2.0
"""The blender: the torque it commands, what it takes for a fault, and that a fault stays until it is reset."""

from __future__ import annotations

import math
import signal
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from graph_probe import Bench, Probe
from middle_motion import MiddleMotion, Pair
from std_msgs.msg import String
from std_srvs.srv import Trigger

from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.laws.blend import blend
from fivebar_control.laws.torque import Torque
from fivebar_control.nodes.blender import deadlines_of
from fivebar_control.ros.node_settings import BlenderSettings
from fivebar_control.safety.brake import brake_of, stopping
from fivebar_control.safety.settings import SafetySettings
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ALL_WELL,
    CTC_TORQUE,
    DRIVES_STATE,
    FAULTS,
    JOINT_STATES,
    REFERENCE,
    SAFETY_STATE,
    SUPERVISOR_STATE,
    TORQUE_COMMAND,
    TORQUE_REQUESTED,
    VHC_TORQUE,
    Topic,
)
from fivebar_description.ros.publisher_watch import NAME_TIME_AT_REST, REPORT_TIME
from fivebar_sim.ros.node_settings import PlantNodeSettings

INPUTS = (JOINT_STATES, REFERENCE, CTC_TORQUE, VHC_TORQUE, SUPERVISOR_STATE)
CTC, VHC = (1.1, -0.7), (0.3, 0.9)
UNDEFINED = (math.nan, math.nan)
ZERO = (0.0, 0.0)
DEADLINE_MS = 1500.0
REST = 0.5
"""Speed (rad/s) below which this robot counts as at rest."""


class Rig:
    """A blender, and the rest of the graph played by a probe."""

    def __init__(
        self, bench: Bench, motion: MiddleMotion, namespace: str = "", rest_speed: float = REST, **more: Any
    ) -> None:
        self.bench = bench
        self.motion = motion
        self.node = f"{namespace}/blender"
        # the robot of the motion is never quite at rest
        self.process = bench.start(
            "blender", namespace, candidate_deadline_ms=DEADLINE_MS, **{"safety.rest_speed": rest_speed}, **more
        )
        self.probe: Probe = bench.probe(namespace)
        self.probe.join(
            "blender", [*INPUTS, FAULTS, DRIVES_STATE], [TORQUE_REQUESTED, TORQUE_COMMAND, FAULTS, SAFETY_STATE]
        )
        self.sample = 0
        self.faults_seen = 0
        self.begin()

    def begin(self) -> None:
        """Start over at sample 0, with candidates that ask for no torque."""
        probe, motion = self.probe, self.motion
        inputs = [
            (JOINT_STATES, motion.joint_states_message(0)),
            (REFERENCE, motion.reference_message(0)),
            (CTC_TORQUE, motion.torque_message(0, ZERO)),
            (VHC_TORQUE, motion.torque_message(0, ZERO)),
            (SUPERVISOR_STATE, motion.supervisor_message(0, 0.5)),
        ]
        probe.ask(inputs, [TORQUE_COMMAND], 0)

    def publish(self, sigma: float = 0.5, ctc: Pair = CTC, vhc: Pair = VHC, dx: float = 0.0, without: str = "") -> int:
        """Publish all inputs of the next sample, save for one topic; return its number."""
        self.sample += 1
        sample, motion = self.sample, self.motion
        messages = {
            REFERENCE: motion.reference_message(sample, dx),
            CTC_TORQUE: motion.torque_message(sample, ctc),
            VHC_TORQUE: motion.torque_message(sample, vhc),
            SUPERVISOR_STATE: motion.supervisor_message(sample, sigma),
            JOINT_STATES: motion.joint_states_message(sample),
        }
        for topic, message in messages.items():
            if topic.name != without:
                self.probe.publish(topic, message)
        return sample

    def command(self, sample: int) -> Pair:
        """Return the torque commanded for a sample."""
        message = self.probe.answer(TORQUE_COMMAND, sample)
        assert tuple(message.name) == ACTIVE_JOINTS
        assert (len(message.position), len(message.velocity)) == (0, 0)
        tau1, tau2 = message.effort
        return tau1, tau2

    def requested(self, sample: int) -> Pair:
        """Return the torque asked for at a sample, before limits."""
        tau1, tau2 = self.probe.answer(TORQUE_REQUESTED, sample).effort
        return tau1, tau2

    def ask(self, service: str) -> Trigger.Response:
        return self.probe.call(Trigger, f"{self.node}/{service}", Trigger.Request())

    def expect_state(self, text: str) -> None:
        """Wait until safety/state begins with a text."""
        self.probe.wait_for(
            lambda: bool(states := self.probe.got(SAFETY_STATE)) and states[-1].data.startswith(text), text
        )

    def next_fault(self) -> str:
        """Wait for a fault that has not been seen yet."""
        faults = self.probe.got(FAULTS)
        self.probe.wait_for(lambda: len(faults) > self.faults_seen, "a fault")
        self.faults_seen += 1
        assert len(faults) == self.faults_seen
        return faults[-1].data

    def reset(self, name: str) -> None:
        """Reset a fault; the inputs of the last sample may still be on their way."""
        answers: list[Trigger.Response] = []

        def taken() -> bool:
            answers.append(self.probe.reset(self.node))
            return bool(answers[-1].success)

        self.probe.wait_for(taken, "a reset")
        assert answers[-1].message.startswith(f"cleared {name}: "), answers

    def expect_latched_until_reset(self, name: str) -> None:
        """Further samples get no torque, however good they are, until the reset."""
        self.expect_state(f"{name}: ")
        for _ in range(2):
            sample = self.publish()
            assert self.command(sample) == ZERO
        status, _ = self.probe.health(self.node)
        assert status.level == DiagnosticStatus.ERROR
        assert status.message.startswith(f"{name}: ")
        self.reset(name)
        self.expect_state("ok")
        assert self.probe.samples(TORQUE_REQUESTED)[-1] < sample, "nothing was asked for while the fault was latched"
        assert self.command(self.publish()) == blend(0.5, Torque(*CTC), Torque(*VHC))
        assert self.probe.reset(self.node).message == "no fault was latched"
        assert len(self.probe.got(FAULTS)) == self.faults_seen


@pytest.fixture(scope="module")
def rig(shared_bench: Bench, motion: MiddleMotion) -> Rig:
    return Rig(shared_bench, motion)


@pytest.mark.parametrize(
    ("sigma", "ctc", "vhc", "wanted"),
    [
        (0.0, CTC, VHC, CTC),
        (1.0, CTC, VHC, VHC),
        (0.3, CTC, VHC, (0.7 * 1.1 + 0.3 * 0.3, 0.7 * -0.7 + 0.3 * 0.9)),
        (0.0, CTC, UNDEFINED, CTC),
        (1.0, UNDEFINED, VHC, VHC),
        (0.0, (1e6, -1e6), VHC, (10.0, -10.0)),
    ],
)
def test_blends_by_sigma(rig: Rig, sigma: float, ctc: Pair, vhc: Pair, wanted: Pair) -> None:
    sample = rig.publish(sigma, ctc, vhc)
    assert rig.command(sample) == wanted
    assert rig.requested(sample) == (ctc if wanted == (10.0, -10.0) else wanted)
    assert not rig.probe.got(FAULTS)


@pytest.mark.parametrize("sigma", [0.5, 1.0])
def test_an_undefined_candidate_that_counts_is_a_fault(rig: Rig, sigma: float) -> None:
    sample = rig.publish(sigma, vhc=(0.1, math.nan))
    assert rig.command(sample) == ZERO
    assert rig.next_fault().startswith("torque_undefined: ")
    fault = rig.probe.got(FAULTS)[-1].data
    assert f"at sample {sample}: " in fault
    assert f"sigma = {sigma:.3f}" in fault
    rig.expect_latched_until_reset("torque_undefined")


def test_in_lockstep_a_second_publisher_is_named_before_its_victim_is_missing() -> None:
    """A law that hears two publishers answers nothing while it looks for their names; the plant waits for longer."""
    candidates, states = deadlines_of(load_scenario("middle"), BlenderSettings())
    assert NAME_TIME_AT_REST + REPORT_TIME < candidates < PlantNodeSettings().command_timeout_s
    assert math.isinf(states)


def test_a_platform_far_from_its_reference_is_a_fault(rig: Rig) -> None:
    # the limit is 50 mm, and the robot itself is up to 1.1 mm off
    assert rig.command(rig.publish(0.0, dx=0.048)) == CTC
    sample = rig.publish(0.0, dx=-0.052)
    assert rig.command(sample) == ZERO
    fault = rig.next_fault()
    assert fault.startswith("tracking_lost: ")
    assert f"at sample {sample}: " in fault
    assert fault.endswith("limit 50 mm")
    assert 50.8 < float(fault.split()[4]) < 53.2
    rig.expect_latched_until_reset("tracking_lost")


def test_a_moving_robot_is_braked_until_something_else_goes_wrong(bench: Bench, motion: MiddleMotion) -> None:
    """From the sample of the fault on, by the joint states alone; then by nothing, for good."""
    rig = Rig(bench, motion, rest_speed=0.01)
    brake = brake_of(SafetySettings(rest_speed=0.01), motion.robot, 500)
    wanted = {}

    def expected(sample: int) -> Torque:
        wanted[sample] = stopping(brake, motion.robot, motion.state(sample), 100).torque
        assert min(map(abs, wanted[sample])) > 0.0
        return wanted[sample]

    assert rig.command(rig.publish()) != ZERO
    sample = rig.publish(dx=0.06)
    assert rig.command(sample) == expected(sample)
    assert rig.next_fault().startswith("tracking_lost: ")
    for _ in range(3):
        sample = rig.publish(without=CTC_TORQUE.name)
        assert rig.command(sample) == expected(sample)
    before = len(rig.probe.got(TORQUE_COMMAND))
    rig.probe.publish(JOINT_STATES, motion.joint_states_message(sample))
    rig.probe.wait_for(lambda: len(rig.probe.got(TORQUE_COMMAND)) > before, "an answer to the repeated sample")
    assert tuple(rig.probe.got(TORQUE_COMMAND)[-1].effort) == wanted[sample]
    assert rig.ask("emergency_stop").message.startswith("zero torque: tracking_lost: ")
    rig.probe.wait_for(lambda: tuple(rig.probe.got(TORQUE_COMMAND)[-1].effort) == ZERO, "zero torque at once")
    for _ in range(2):
        assert rig.command(rig.publish()) == ZERO


@pytest.mark.parametrize("by", ["another fault", "drives"])
def test_braking_ends_with_what_makes_it_unsound(bench: Bench, motion: MiddleMotion, by: str) -> None:
    rig = Rig(bench, motion, rest_speed=0.01)
    assert rig.command(rig.publish(vhc=UNDEFINED)) != ZERO
    rig.next_fault()
    if by == "drives":
        rig.probe.publish(DRIVES_STATE, String(data="drive_fault: q11 is hot"))
    else:
        rig.probe.publish(FAULTS, String(data="estimate_lost: mirrored"))

    def no_torque() -> bool:
        return rig.command(rig.publish()) == ZERO

    rig.probe.wait_for(no_torque, "zero torque")
    assert rig.command(rig.publish()) == ZERO


@pytest.mark.parametrize("topic", [CTC_TORQUE, SUPERVISOR_STATE], ids=lambda topic: topic.name)
def test_a_missing_candidate_is_a_fault(rig: Rig, topic: Topic) -> None:
    sample = rig.publish(without=topic.name)
    assert rig.command(sample) == ZERO
    fault = f"candidate_missing: no {topic.name} for sample {sample} within 1500 ms"
    assert rig.next_fault() == fault
    # a latecomer to the latched topic gets it too
    late = rig.bench.probe()
    late.listen(FAULTS)
    late.wait_for(lambda: fault in [message.data for message in late.got(FAULTS)], "the latched fault")
    late.close()
    rig.expect_latched_until_reset("candidate_missing")


def test_a_fault_of_another_node_stops_the_robot(rig: Rig) -> None:
    answered = rig.publish()
    assert rig.command(answered) == blend(0.5, Torque(*CTC), Torque(*VHC))
    waiting = rig.publish(without=VHC_TORQUE.name)
    rig.probe.publish(FAULTS, String(data="drive_hot: 90 degrees"))
    # at once, without the deadline of the missing candidate, which is no fault of its own any more
    assert rig.command(waiting) == ZERO
    before = len(rig.probe.got(TORQUE_COMMAND))
    rig.probe.publish(JOINT_STATES, rig.motion.joint_states_message(waiting))
    rig.probe.wait_for(lambda: len(rig.probe.got(TORQUE_COMMAND)) > before, "an answer to the repeated sample")
    assert tuple(rig.probe.got(TORQUE_COMMAND)[-1].effort) == ZERO
    assert rig.next_fault() == "drive_hot: 90 degrees"
    rig.expect_latched_until_reset("drive_hot")


def test_a_repeated_sample_gets_no_torque_after_a_fault(rig: Rig) -> None:
    sample = rig.publish()
    assert rig.command(sample) != ZERO
    rig.probe.publish(FAULTS, String(data="stop: pressed"))
    rig.next_fault()
    commands = rig.probe.got(TORQUE_COMMAND)
    # the fault and the repeat travel on different topics, so the first repeats may still come before the fault

    def repeat_is_zero() -> bool:
        before = len(commands)
        rig.probe.publish(JOINT_STATES, rig.motion.joint_states_message(sample))
        rig.probe.wait_for(lambda: len(commands) > before, "an answer to the repeated sample")
        return tuple(commands[-1].effort) == ZERO

    rig.probe.wait_for(repeat_is_zero, "zero torque for a repeated sample")
    assert rig.probe.samples(TORQUE_COMMAND)[-1] == sample
    rig.expect_latched_until_reset("stop")


def test_an_emergency_stop_by_service(rig: Rig) -> None:
    sample = rig.publish()
    assert rig.command(sample) != ZERO
    answer = rig.ask("emergency_stop")
    assert answer.success
    assert answer.message == "zero torque: emergency_stop: requested by blender/emergency_stop"
    rig.probe.wait_for(lambda: tuple(rig.probe.got(TORQUE_COMMAND)[-1].effort) == ZERO, "zero torque at once")
    assert rig.next_fault().startswith("emergency_stop: ")
    # who comes later is told the present state first, and every fault
    late = rig.bench.probe(rig.node.removesuffix("/blender"))
    late.listen(SAFETY_STATE, FAULTS)
    late.wait_for(lambda: late.got(SAFETY_STATE) and len(late.got(FAULTS)) == rig.faults_seen, "state and faults")
    assert [one.data.partition(":")[0] for one in late.got(SAFETY_STATE)] == ["emergency_stop"]
    rig.expect_latched_until_reset("emergency_stop")


def test_a_reset_is_refused_while_the_cause_is_there(rig: Rig) -> None:
    rig.command(rig.publish(vhc=UNDEFINED))
    assert rig.next_fault().startswith("torque_undefined: ")
    for changes, reason in (
        ({"vhc": UNDEFINED}, "not cleared, torque_undefined: "),
        ({"dx": 0.06}, "not cleared, tracking_lost: "),
    ):
        assert rig.command(rig.publish(**changes)) == ZERO
        answer = rig.probe.wait_for(
            lambda wanted=reason: next(
                (one for one in [rig.probe.reset(rig.node)] if one.message.startswith(wanted)), None
            ),
            reason,
        )
        assert not answer.success
        assert "; latched is torque_undefined: " in answer.message
    rig.expect_latched_until_reset("torque_undefined")


def test_a_reset_is_refused_while_the_drives_hold_a_fault(rig: Rig) -> None:
    rig.command(rig.publish())
    rig.probe.publish(DRIVES_STATE, String(data="drive_fault: q11 is hot"))
    rig.probe.publish(FAULTS, String(data="drive_fault: q11 is hot"))
    rig.next_fault()
    assert rig.command(rig.publish()) == ZERO

    def refused() -> bool:
        answer = rig.probe.reset(rig.node)
        assert not answer.success
        return "the drives are stopped by drive_fault: q11 is hot" in answer.message

    rig.probe.wait_for(refused, "a refusal because of the drives")
    rig.probe.publish(DRIVES_STATE, String(data=ALL_WELL))
    rig.expect_latched_until_reset("drive_fault")


def test_states_that_do_not_come_any_more_are_a_fault(bench: Bench, motion: MiddleMotion) -> None:
    # what a busy machine may take from one sample to the next
    rig = Rig(bench, motion, state_deadline_ms=1500.0, last_sample=7)
    # a run that has come to its last sample misses nothing: two reports on health are a second apart
    rig.sample = 6
    assert rig.command(rig.publish()) != ZERO
    for _ in range(3):
        status, _ = rig.probe.health(rig.node)
        assert status.level == DiagnosticStatus.OK
    rig.sample = 0
    rig.begin()
    sample = rig.publish()
    assert rig.command(sample) != ZERO
    assert rig.next_fault() == f"state_stale: no joint states after sample {sample} within 1500 ms"
    rig.probe.wait_for(lambda: tuple(rig.probe.got(TORQUE_COMMAND)[-1].effort) == ZERO, "zero torque as the last word")
    assert rig.probe.samples(TORQUE_COMMAND)[-1] == sample
    rig.probe.spin_for(0.25)
    assert "no sample has been complete" in rig.probe.reset(rig.node).message


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_zero_torque_is_the_last_word(bench: Bench, motion: MiddleMotion, number: signal.Signals) -> None:
    rig = Rig(bench, motion)
    for _ in range(3):
        sample = rig.publish()
        assert rig.command(sample) != ZERO
    before = len(rig.probe.got(TORQUE_COMMAND))
    rig.process.send(number)
    assert rig.process.wait() == 0
    rig.probe.wait_for(lambda: len(rig.probe.got(TORQUE_COMMAND)) > before, "a last command")
    assert rig.probe.samples(TORQUE_COMMAND)[before:] == [sample]
    assert rig.command(sample) == ZERO
    assert rig.process.complaints == []


def test_without_blending_the_ctc_torque_is_the_command(bench: Bench, motion: MiddleMotion) -> None:
    bench.start("blender", controller="ctc")
    probe = bench.probe()
    probe.join("blender", [JOINT_STATES, REFERENCE, CTC_TORQUE, FAULTS], [TORQUE_COMMAND])
    inputs = [
        (CTC_TORQUE, motion.torque_message(0, CTC)),
        (REFERENCE, motion.reference_message(0)),
        (JOINT_STATES, motion.joint_states_message(0)),
    ]
    probe.ask(inputs, [TORQUE_COMMAND], 0)
    assert tuple(probe.got(TORQUE_COMMAND)[-1].effort) == CTC
