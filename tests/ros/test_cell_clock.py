# SPDX-License-Identifier: Apache-2.0
"""The time that robots of a cell share: that of the one which has come least far and has not ended."""

from __future__ import annotations

from graph_probe import Bench, Probe
from rosgraph_msgs.msg import Clock

from fivebar_description.interface import CELL_CLOCK, CLOCK, JOINT_STATES, TORQUE_COMMAND, of_robot
from fivebar_description.ros.messages import to_stamp

LEFT, RIGHT = (of_robot(CLOCK, robot) for robot in ("left", "right"))


def seconds(probe: Probe) -> list[int]:
    return [message.clock.sec for message in probe.got(CELL_CLOCK)]


def test_the_time_is_that_of_the_robot_which_has_come_least_far(bench: Bench) -> None:
    probe = bench.probe()
    probe.listen(CELL_CLOCK)
    probe.advertise(LEFT, RIGHT)
    bench.start("cell_clock", robots=["left", "right"])
    probe.wait_for(lambda: probe.listeners(LEFT) and probe.listeners(RIGHT), "the clock")

    def tell(topic: object, at: int) -> None:
        probe.publish(topic, Clock(clock=to_stamp(at * 10**9)))

    tell(LEFT, 5)
    tell(RIGHT, 2)
    probe.wait_for(lambda: 2 in seconds(probe), "the lesser time")
    tell(RIGHT, 4)
    probe.wait_for(lambda: 4 in seconds(probe), "the next one")
    # nobody waits for a robot that has ended
    probe.withdraw(RIGHT)
    probe.wait_for(lambda: 5 in seconds(probe), "the other robot's time")
    assert seconds(probe) == sorted(seconds(probe))
    assert set(seconds(probe)) == {2, 4, 5}


def test_a_plant_measures_no_sample_before_its_cell_has_come_to_it(bench: Bench) -> None:
    probe = bench.probe("/left")
    probe.listen(CLOCK)
    probe.advertise(CELL_CLOCK)
    bench.start("plant", "/left", follows_clock=True, samples=10)
    probe.join("plant", [TORQUE_COMMAND], [JOINT_STATES])
    own = probe.wait_for(lambda: probe.got(CLOCK)[3:], "its own time")
    assert {message.clock.sec for message in own} == {1}
    assert not probe.got(JOINT_STATES)
    probe.publish(CELL_CLOCK, Clock(clock=to_stamp(10**9)))
    probe.wait_for(lambda: probe.got(JOINT_STATES), "the first sample")
