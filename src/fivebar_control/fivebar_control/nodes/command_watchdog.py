# SPDX-License-Identifier: Apache-2.0
"""Commands zero torque where a controller holds a torque that the bridge no longer renews.

A forward controller of ros2_control holds its last command for ever. Where the bridge is killed, or hangs, nobody else
ends that torque. This node is a process of its own: it hears the commands, and publishes zero once they stop.
"""

from __future__ import annotations

import time
from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from std_msgs.msg import Float64MultiArray, String

from fivebar_control.hardware.controlled_joints import HEARS, SEPARATOR, WATCHDOG, load_joints
from fivebar_control.hardware.held_command import HeldCommand
from fivebar_control.ros.node_settings import WatchdogSettings
from fivebar_description.interface import ALL_WELL, CONTROL_QOS, DRIVES_STATE, FAULTS
from fivebar_description.ros.endpoints import is_own, publishers_of
from fivebar_description.ros.messages import qos_profile
from fivebar_description.ros.node import DELIVERY_TIME, GraphNode
from fivebar_description.ros.run import run_node

LOOKS = 4
"""Looks at the age of the command within the longest time for which it holds."""

COMMAND_DEPTH = 1


class CommandWatchdog(GraphNode):
    """Hears the controller's commands and whether the bridge drives it, and ends a torque that is not renewed."""

    def __init__(self) -> None:
        """Make the node."""
        super().__init__(WATCHDOG)
        file, link = load_joints(self.declare_settings(WatchdogSettings).drives)
        timeout = file.patience * file.watchdog_ms / 1e3
        self._topic, self._link = link.commands, link
        self._held = HeldCommand(timeout)
        self._ended = 0
        self._overdue = False
        self._faults = self.advertise(FAULTS)
        self._commands = self.create_publisher(Float64MultiArray, link.commands, COMMAND_DEPTH)
        # whoever waits until it is heard need not wait for the next report
        heard = SubscriptionEventCallbacks(matched=lambda _: self.report())
        self.create_subscription(
            Float64MultiArray, link.commands, self._on_command, COMMAND_DEPTH, event_callbacks=heard
        )
        self.create_subscription(String, DRIVES_STATE.name, self._on_state, qos_profile(CONTROL_QOS))
        self.every(timeout / LOOKS, self._look)

    def stop(self) -> None:
        """Command zero torque while the bridge is still to be watched: nobody does that any more."""
        if self._held.holds_torque:
            self._publish_zero()
            self._commands.wait_for_all_acked(Duration(seconds=DELIVERY_TIME))

    def health(self) -> tuple[bytes, str]:
        """Return a warning once a torque had to be ended."""
        if self._ended:
            return DiagnosticStatus.WARN, f"zero torque was commanded in the bridge's place, {self._ended} times"
        return super().health()

    def metrics(self) -> Mapping[str, object]:
        """Return how often a torque had to be ended, and whose commands are heard."""
        heard = (publisher.gid.hex() for publisher in publishers_of(self, self._topic) if not is_own(self, publisher))
        return {"torques_ended": self._ended, HEARS: SEPARATOR.join(sorted(heard))}

    def _on_command(self, message: Float64MultiArray) -> None:
        acting = self._link.acting(message.data)
        # what has another length is not taken by the controller either
        if acting is not None:
            self._held.take(acting, time.monotonic())

    def _on_state(self, message: String) -> None:
        self._held.follow(message.data == ALL_WELL)

    def _look(self) -> None:
        age = self._held.overdue(time.monotonic())
        # twice in a row: where this process stood still, the commands of that time are taken in between
        before, self._overdue = self._overdue, age is not None
        if age is None or not before:
            return
        self._publish_zero()
        self._ended += 1
        self.stop_robot(f"command_lost: {self._topic}: no command for {age * 1e3:.0f} ms, zero torque is commanded")

    def _publish_zero(self) -> None:
        self._commands.publish(Float64MultiArray(data=self._link.zero))
        self._held.take((0.0,), time.monotonic())


def main() -> None:
    """Run the node."""
    run_node(CommandWatchdog)


if __name__ == "__main__":
    main()
