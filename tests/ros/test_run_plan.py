# SPDX-License-Identifier: Apache-2.0
"""The plan of a run: nodes wait for it, compare their own parameters with it, and refuse to answer on a difference."""

from __future__ import annotations

from typing import Any

from graph_probe import RATE_HZ, Bench
from middle_motion import MiddleMotion
from std_msgs.msg import String

from fivebar_description.interface import (
    FAULTS,
    JOINT_STATES,
    NANOSECONDS,
    REFERENCE,
    RUN_EPOCH,
    RUN_PLAN,
    SUPERVISOR_STATE,
    sample_stamp_ns,
)
from fivebar_description.ros.messages import to_stamp
from fivebar_description.run_plan import epoch_text, read_plan


def test_a_node_answers_only_what_its_plan_agrees_with(bench: Bench, motion: MiddleMotion) -> None:
    process = bench.start("supervisor")
    probe = bench.probe()
    probe.publish_plan(**{"zone.epsilon": 0.02})
    probe.listen(SUPERVISOR_STATE)
    probe.advertise(JOINT_STATES)

    def refused() -> bool:
        probe.publish(JOINT_STATES, motion.joint_states_message(0))
        status, values = probe.health("/supervisor")
        return status.message.startswith("plan_differs") and values["dropped"] == "0"

    probe.wait_for(refused, "the supervisor says what differs")
    assert not probe.got(SUPERVISOR_STATE)
    errors = [line for line in process.stderr.splitlines() if "[ERROR]" in line]
    assert len(errors) == 1
    assert "zone.epsilon: 0.05 here, 0.02 in the plan" in errors[0]
    # the same node with a plan that agrees, as of a trajectory generator that was started again
    probe.close()
    bench.start("trajectory_generator")
    probe = bench.probe()
    probe.listen(RUN_PLAN, SUPERVISOR_STATE)
    probe.wait_for(lambda: any(read_plan(one.data).values.get("waypoints") for one in probe.got(RUN_PLAN)), "its plan")
    probe.ask([(JOINT_STATES, motion.joint_states_message(0))], [SUPERVISOR_STATE], 0)


def test_the_plan_names_whatever_nodes_share(bench: Bench, motion: MiddleMotion) -> None:
    bench.start("trajectory_generator")
    other = bench.start("ctc_controller", waypoints=[0.0, 0.15, 0.0, 0.03, 0.0, 0.15])
    same = bench.start("vhc_controller")
    probe = bench.probe()
    probe.advertise(JOINT_STATES)
    probe.listen(REFERENCE, RUN_PLAN)
    probe.wait_for(lambda: "refuses" in other.stderr and probe.got(RUN_PLAN), "the other motion is found")
    plan = read_plan(probe.got(RUN_PLAN)[0].data)
    assert {"rate_hz", "robot", "working_mode", "waypoints", "segment_duration", "zone.epsilon"} <= set(plan.values)
    assert "waypoints: [0.0, 0.15, 0.0, 0.03, 0.0, 0.15] here, [0.0, 0.15, 0.0, 0.02, 0.0, 0.15]" in other.stderr
    assert "refuses" not in same.stderr


def test_a_sample_heard_before_its_epoch_has_no_number_yet(bench: Bench, motion: MiddleMotion) -> None:
    """As a node may that is started again during a run: it hears of its publishers in any order."""
    epoch = 1_700_000_000 * NANOSECONDS

    def message(sample: int) -> Any:
        content = motion.joint_states_message(sample)
        content.header.stamp = to_stamp(sample_stamp_ns(sample, RATE_HZ, epoch))
        return content

    bench.start("blender")
    probe = bench.probe()
    probe.advertise(JOINT_STATES)
    probe.listen(FAULTS)

    def dropped() -> bool:
        probe.publish(JOINT_STATES, message(40))
        _, values = probe.health("/blender")
        return values["dropped"] != "0"

    def noticed() -> bool:
        probe.publish(JOINT_STATES, message(41))
        return bool(probe.got(FAULTS))

    probe.wait_for(dropped, "a sample without a number")
    probe.publish(RUN_EPOCH, String(data=epoch_text(epoch)))
    probe.wait_for(noticed, "a fault")
    assert " for sample 41 within " in probe.got(FAULTS)[0].data
