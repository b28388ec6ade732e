# SPDX-License-Identifier: Apache-2.0
"""In lockstep the plant publishes the simulated time, in its namespace, for the tools of ROS that go by it."""

from __future__ import annotations

import pytest
import rclpy
from graph_probe import RATE_HZ, Bench
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.time import Time
from std_msgs.msg import String

from fivebar_description.interface import (
    ACTIVE_JOINTS,
    CLOCK,
    JOINT_STATES,
    RUN_READY,
    TORQUE_COMMAND,
    sample_stamp_ns,
)
from fivebar_description.ros.messages import joint_state

SAMPLES = 5


@pytest.mark.parametrize("namespace", ["", "/robot1"])
def test_the_clock_shows_the_stamps_of_the_joint_states(bench: Bench, namespace: str) -> None:
    """A tool with `use_sim_time` reads them as its time, in a namespace with the remapping that the pages give."""
    process = bench.start("plant", namespace, samples=SAMPLES, wait_for_nodes=["probe"], command_timeout_s=60.0)
    probe = bench.probe(namespace)
    probe.join("plant", [TORQUE_COMMAND, RUN_READY], [JOINT_STATES, CLOCK])
    assert probe.node.resolve_topic_name(CLOCK.name) == f"{namespace}/clock"
    context = Context()
    rclpy.init(context=context, domain_id=bench.domain, signal_handler_options=SignalHandlerOptions.NO)
    tool = Node(
        "tool",
        context=context,
        cli_args=["--ros-args", "-r", f"/clock:={namespace}/clock"],
        parameter_overrides=[Parameter("use_sim_time", value=True)],
        enable_rosout=False,
    )
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(tool)
    try:
        assert tool.get_clock().now().nanoseconds == 0
        probe.publish(RUN_READY, String(data="probe"))
        for sample in range(SAMPLES):
            stamp = sample_stamp_ns(sample, RATE_HZ)
            probe.answer(JOINT_STATES, sample)

            def shown(stamp: int = stamp) -> bool:
                executor.spin_once(timeout_sec=0.0)
                return tool.get_clock().now().nanoseconds == stamp

            # time stands still until the sample is answered
            probe.wait_for(shown, f"the tool's time is that of sample {sample}")
            probe.publish(TORQUE_COMMAND, joint_state(stamp, ACTIVE_JOINTS, effort=(0.0, 0.0)))
        wanted = [sample_stamp_ns(sample, RATE_HZ) for sample in range(SAMPLES + 1)]

        def told() -> list[int]:
            # sample 0 is repeated
            return list(dict.fromkeys(Time.from_msg(one.clock).nanoseconds for one in probe.got(CLOCK)))

        probe.wait_for(lambda: len(told()) > SAMPLES, "the time of the last sample")
        assert told() == wanted
    finally:
        executor.shutdown()
        tool.destroy_node()
        context.try_shutdown()
    probe.publish(TORQUE_COMMAND, joint_state(wanted[-1], ACTIVE_JOINTS, effort=(0.0, 0.0)))
    assert process.wait() == 0


def test_by_the_clock_of_the_machine_there_is_no_other(bench: Bench) -> None:
    bench.start("plant", mode="realtime", wait_for_nodes=["probe"])
    probe = bench.probe()
    probe.join("plant", [TORQUE_COMMAND, RUN_READY], [JOINT_STATES])
    assert probe.node.count_publishers(CLOCK.name) == 0
