# SPDX-License-Identifier: Apache-2.0
"""Publishes the one time of a cell with several robots on /clock.

In lockstep that is the time of the robot which has come least far: each plant says on its own clock which sample is
next, and measures it once /clock has come to it. In real time it is the system's.
"""

from __future__ import annotations

from collections.abc import Callable

from rosgraph_msgs.msg import Clock

from fivebar_description.interface import CELL_CLOCK, CLOCK, NANOSECONDS, of_robot
from fivebar_description.ros.messages import to_stamp
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.run import run_node
from fivebar_sim.ros.node_settings import CellClockSettings

REPEAT_PERIOD = 0.1
"""Period (s) of publishing the time again, for who has missed it, and of looking for robots that have ended."""

TICK = 0.01
"""Period (s) of the time in real time."""


class CellClock(GraphNode):
    """The clock that the robots of a cell share."""

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("cell_clock")
        self._times = dict.fromkeys(self.declare_settings(CellClockSettings).robots, 0)
        """The time (ns) of each robot that has not ended."""
        self._clocks = {robot: of_robot(CLOCK, robot) for robot in self._times}
        self._now = 0
        self._time = self.advertise(CELL_CLOCK)
        for robot, topic in self._clocks.items():
            self.listen(topic, self._taking(robot), awaited=False)
        if self._times:
            self.every(REPEAT_PERIOD, self._repeat)
        else:
            self.every(TICK, self._tick)

    def _taking(self, robot: str) -> Callable[[Clock], None]:
        def take(message: Clock) -> None:
            if robot in self._times:
                self._times[robot] = message.clock.sec * NANOSECONDS + message.clock.nanosec
                self._advance()

        return take

    def _advance(self) -> None:
        """Go on to the time of the robot that has come least far, once all have begun."""
        least = min(self._times.values(), default=self._now)
        if least > self._now:
            self._now = least
            self._publish()

    def _repeat(self) -> None:
        begun = [robot for robot, at in self._times.items() if at]
        for robot in [name for name in begun if not self.count_publishers(self._clocks[name].name)]:
            del self._times[robot]
            self.get_logger().info(f"{robot} has ended")
        self._advance()
        if self._now:
            self._publish()

    def _tick(self) -> None:
        self._now = self.get_clock().now().nanoseconds
        self._publish()

    def _publish(self) -> None:
        self._time.publish(Clock(clock=to_stamp(self._now)))
        self.note_answer()


def main() -> None:
    """Run the node."""
    run_node(CellClock)


if __name__ == "__main__":
    main()
