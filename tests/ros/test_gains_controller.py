# SPDX-License-Identifier: Apache-2.0
"""Joints under a forward controller of five values each: units, gains, what is not taken, and how it ends."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest
import rclpy
from closed_posture import closed_posture
from controlled_robot import LINK, MOTORS, ControlledRobot, controlled_robot, drives_file
from graph_probe import Bench
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from served_board import wait_for
from std_msgs.msg import Float64MultiArray

from fivebar_control.hardware.controlled_joints import load_joints
from fivebar_control.hardware.drive_interface import DriveInterface, JointTarget
from fivebar_control.hardware.fault import DriveError
from fivebar_control.ros.joints_port import JointsPort
from fivebar_control.ros.ros2_control import connect

FORWARD = {**LINK, "takes": "gains", "unit": "A"}
CONSTANT = 0.5
"""Torque constant of both motors (Nm/A)."""

PUSH, SHAFTS = (0.4, -0.4), (-0.2, -0.4)
"""Torques (Nm) at the joints, under which friction holds the robot, and at the motors: one turns the other way, through
a gear of 2."""

STIFFNESS, DAMPING = 4.0, 0.1
"""Gains (A/rad, A/(rad/s)) at the shafts."""


def motors(**more: Any) -> dict[str, Any]:
    return {joint: {**facts, "torque_constant": CONSTANT, **more} for joint, facts in MOTORS.items()}


def file_of(folder: Path, **link: Any) -> Path:
    return drives_file(folder, link={**FORWARD, **link}, motors=motors(torque_limit_nm=5.0))


@pytest.fixture(scope="module")
def cell(shared_bench: Bench, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    """A domain with a watchdog, of which this process is a member."""
    shared_bench.start("command_watchdog", drives=str(file_of(tmp_path_factory.mktemp("watchdog"))))
    rclpy.init(domain_id=shared_bench.domain, signal_handler_options=SignalHandlerOptions.NO)
    yield shared_bench
    rclpy.try_shutdown()


@pytest.fixture
def robot(cell: Bench) -> Iterator[ControlledRobot]:
    with controlled_robot(cell.domain, motors=motors(), takes="gains", unit="A", passive=["p1", "p2"]) as robot:
        yield robot


class Listener:
    """Hears the commands, and can publish some."""

    def __init__(self) -> None:
        self.node = rclpy.create_node("listener", enable_rosout=False)
        self.got: list[list[float]] = []
        topic = f"{LINK['controller']}/commands"
        self.node.create_subscription(Float64MultiArray, topic, lambda one: self.got.append(list(one.data)), 10)
        self.topic = topic
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)

    def wait_for(self, wanted: Any) -> list[float]:
        def heard() -> bool:
            self.executor.spin_once(timeout_sec=0.05)
            return any(wanted(one) for one in self.got)

        wait_for(heard)
        return next(one for one in self.got if wanted(one))

    def join(self) -> None:
        """Be found as another commander, by the controller, the watchdog and this node itself."""
        self.publisher = self.node.create_publisher(Float64MultiArray, self.topic, 10)
        wait_for(lambda: self.publisher.get_subscription_count() >= 3)

    def publish(self, *values: float) -> None:
        self.publisher.publish(Float64MultiArray(data=values))

    def close(self) -> None:
        self.executor.shutdown()
        self.node.destroy_node()


@pytest.fixture
def listener(cell: Bench) -> Iterator[Listener]:
    listener = Listener()
    yield listener
    listener.close()


def opened(file: Path) -> DriveInterface:
    drives = connect(str(file)).open()
    drives.enable(10.0)
    return drives


def written_until(drives: DriveInterface, condition: Callable[[], Any], *command: Any) -> None:
    """Write a command again and again, as a bridge does, until a condition holds: the watchdog ends an old one."""

    def holds() -> bool:
        drives.write(*command)
        return bool(condition())

    wait_for(holds)


def test_efforts_are_currents_and_no_value_is_nan(robot: ControlledRobot, listener: Listener, tmp_path: Path) -> None:
    drives = opened(file_of(tmp_path))
    drives.write(PUSH)
    wait_for(lambda: robot.torques == SHAFTS)
    # the place of q21 in the controller's joints is the first
    command = listener.wait_for(lambda one: one[4] != 0.0)
    assert command[4:6] == [SHAFTS[1] / CONSTANT, SHAFTS[0] / CONSTANT]
    assert command[6:] == [0.0] * 4
    drives.close()
    robot.wait_for_no_torque()
    assert all(len(one) == 10 and all(map(math.isfinite, one)) for one in listener.got)
    assert listener.wait_for(lambda one: one is listener.got[-1])[4:] == [0.0] * 6


def test_gains_act_beside_the_torque_at_the_board_s_own_rate_and_end_with_it(
    robot: ControlledRobot, listener: Listener, tmp_path: Path
) -> None:
    drives = opened(file_of(tmp_path, inner_loop={"stiffness": STIFFNESS, "damping": DAMPING}))
    q11, _, q21, _ = closed_posture()
    # small enough for friction, and for a tenth of the limit
    half = PUSH, JointTarget(0.5, (q11 + 0.01, q21), (0.0, 0.0))
    drives.write(*half)
    command = listener.wait_for(lambda one: one[6] > 0.0)
    assert command[6:] == pytest.approx([0.5 * STIFFNESS] * 2 + [0.5 * DAMPING] * 2)
    # a shaft turns by twice the angle, the other way; half of the gain acts
    pulled = SHAFTS[0] - CONSTANT * 0.5 * STIFFNESS * 2.0 * 0.01
    written_until(drives, lambda: abs(robot.torques[0] - pulled) < 0.1 * abs(pulled - SHAFTS[0]), *half)
    assert robot.torques[1] == pytest.approx(SHAFTS[1], abs=2e-3)
    # on the locus there is no target, and so no gain
    written_until(drives, lambda: robot.torques == SHAFTS, PUSH)
    whole = PUSH, JointTarget(1.0, (q11 + 0.01, q21), (0.0, 0.0))
    written_until(drives, lambda: robot.torques != SHAFTS, *whole)
    drives.switch_off()
    robot.wait_for_no_torque()
    drives.close()
    assert all(len(one) == 10 and all(map(math.isfinite, one)) for one in listener.got)


def test_a_robot_that_waits_for_commands_waits_for_a_slow_machine_too(cell: Bench, tmp_path: Path) -> None:
    """States that come less often than every sample are refused where time does not wait."""
    quick = {"period_us": 2000, "gather_deadline_us": 1500, "pace": "commands"}
    file, link = load_joints(str(drives_file(tmp_path, link=FORWARD, motors=motors(torque_limit_nm=5.0), **quick)))
    for pace, expected in (
        ("clock", pytest.raises(DriveError, match="the run needs 500 Hz")),
        ("commands", nullcontext()),
    ):
        more = {"pace": pace, "lag": 0.01, "motors": motors(), "takes": "gains", "unit": "A"}
        with controlled_robot(cell.domain, 2000, **more), expected:
            port = JointsPort(file, link, None)
            try:
                port.begin(10.0)
            finally:
                port.close()


def test_a_command_of_another_length_is_not_taken_and_nan_keeps_a_value(
    robot: ControlledRobot, listener: Listener
) -> None:
    """The emulated controller by itself, which holds what it was told."""
    listener.join()
    kept = math.nan
    listener.publish(0.0, 0.0, 0.0, 0.0, 0.6, 0.8, 0.0, 0.0, 0.0, 0.0)
    wait_for(lambda: robot.torques == (0.8 * CONSTANT, 0.6 * CONSTANT))
    listener.publish(0.0, 0.0)
    listener.publish(kept, kept, kept, kept, kept, 0.2, kept, kept, kept, kept)
    wait_for(lambda: robot.torques == (0.2 * CONSTANT, 0.6 * CONSTANT))
    listener.publish(*[0.0] * 10)
    robot.wait_for_no_torque()


@pytest.mark.parametrize(
    ("order", "fault"),
    [
        ("fault 1 BROADCASTER_STOPPED", "states_stale"),
        ("fault 1 CONTROLLER_DEACTIVATED", "controller_lost"),
        pytest.param("fault 1 CONTROLLER_UNLOADED", "controller_lost", marks=pytest.mark.extra),
        pytest.param("fault 2 STATE_NOT_FINITE", "states_invalid", marks=pytest.mark.extra),
        pytest.param("silent 1", "states_invalid", marks=pytest.mark.extra),
        pytest.param("fault 1 SECOND_COMMANDER", "second_publisher", marks=pytest.mark.extra),
    ],
)
def test_what_breaks_ends_gains_and_torque(robot: ControlledRobot, tmp_path: Path, order: str, fault: str) -> None:
    drives = opened(file_of(tmp_path, inner_loop={"stiffness": STIFFNESS}))
    q11, _, q21, _ = closed_posture()
    pulled = PUSH, JointTarget(1.0, (q11 + 0.01, q21), (0.0, 0.0))
    written_until(drives, lambda: robot.torques[0] < SHAFTS[0] - 0.01, *pulled)
    robot.order(order)

    def found() -> bool:
        exchange = drives.exchange()
        return exchange.fault is not None and exchange.fault.name == fault

    wait_for(found)
    assert not drives.enabled
    robot.wait_for_no_torque()
    drives.close()
