# SPDX-License-Identifier: Apache-2.0
"""Joints under a controller manager: what the bridge's side finds, and what becomes of a torque that nobody renews."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from closed_posture import closed_posture
from controlled_robot import LINK, MOTORS, PERIOD_US, RATE_HZ, ControlledRobot, controlled_robot, drives_file
from graph_probe import Bench
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.signals import SignalHandlerOptions
from served_board import wait_for
from std_msgs.msg import Float64MultiArray

from fivebar_control.hardware.controlled_joints import FAULTS, WATCHDOG, load_joints
from fivebar_control.hardware.drive_interface import DriveInterface, Exchange
from fivebar_control.hardware.fault import DriveError
from fivebar_control.ros.controller_watch import ControllerWatch
from fivebar_control.ros.ros2_control import connect
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ALL_WELL,
    DRIVES_STATE,
    MOTOR_STATES,
    TORQUE_COMMAND,
    sample_stamp_ns,
)
from fivebar_description.interface import FAULTS as FAULTS_TOPIC
from fivebar_description.ros.messages import joint_state

PUSH = (0.4, -0.4)
SHAFTS = (-0.2, -0.4)
"""The same at the motors: one turns the other way, through a gear of 2."""

STRONG = 1.2
"""A torque (Nm) beyond friction, which the robot creeps under for `PUSH`."""


def long(*values: Any) -> Any:
    """A case of the long tests."""
    return pytest.param(*values, marks=pytest.mark.extra)


@pytest.fixture(scope="module")
def cell(shared_bench: Bench, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    """A domain with a watchdog, of which this process is a member."""
    path = drives_file(tmp_path_factory.mktemp("watchdog"))
    shared_bench.start("command_watchdog", drives=str(path))
    rclpy.init(domain_id=shared_bench.domain, signal_handler_options=SignalHandlerOptions.NO)
    yield shared_bench
    rclpy.try_shutdown()


@pytest.fixture
def robot(cell: Bench) -> Iterator[ControlledRobot]:
    with controlled_robot(cell.domain) as robot:
        yield robot


def opened(folder: Path, **changed: Any) -> DriveInterface:
    drives = connect(str(drives_file(folder, **changed))).open()
    drives.enable(10.0)
    return drives


def exchanged(drives: DriveInterface, wanted: Any) -> Exchange:
    """Exchange until an exchange is as wanted, and return it."""
    found: list[Exchange] = []

    def done() -> bool:
        found.append(drives.exchange())
        return bool(wanted(found[-1]))

    wait_for(done)
    return found[-1]


def test_joints_are_taken_by_name_and_torques_given_in_the_controller_s_order(
    robot: ControlledRobot, tmp_path: Path
) -> None:
    drives = opened(tmp_path)
    complete = exchanged(drives, lambda one: one.complete)
    q11, _, q21, _ = closed_posture()
    assert [one.position for one in complete.readings if one] == pytest.approx([q11, q21], abs=3.2e-4)
    drives.write((STRONG, -STRONG))
    wait_for(lambda: robot.torques == (-0.5 * STRONG, -STRONG))
    moved = exchanged(drives, lambda one: one.complete and abs(one.readings[0].velocity) > 0.1)
    assert moved.readings[0].velocity > 0.1
    assert moved.readings[1].velocity < -0.1
    # what the hardware does not measure is what was commanded
    assert [one.torque for one in moved.readings if one] == pytest.approx([STRONG, -STRONG])
    drives.disable(10.0)
    robot.wait_for_no_torque()
    drives.close()


@pytest.mark.parametrize(
    ("order", "fault"),
    [
        ("fault 1 BROADCASTER_STOPPED", "states_stale: /cell/joint_states: last state "),
        long("fault 1 CONTROLLER_UNLOADED", "controller_lost: /cell/effort_controller "),
        long("fault 1 CONTROLLER_DEACTIVATED", "controller_lost: /cell/effort_controller is inactive"),
        long("fault 2 STATE_NOT_FINITE", "states_invalid: /cell/joint_states: position of right is nan"),
        long("silent 1", "states_invalid: /cell/joint_states: no joint left"),
        ("fault 1 SECOND_COMMANDER", "second_publisher: /cell/effort_controller/commands is published by "),
    ],
)
def test_what_breaks_is_named_and_ends_the_torque_until_it_is_mended(
    robot: ControlledRobot, tmp_path: Path, order: str, fault: str
) -> None:
    drives = opened(tmp_path)
    drives.write(PUSH)
    wait_for(lambda: robot.torques == SHAFTS)
    robot.order(order)
    found = exchanged(drives, lambda one: one.fault is not None)
    assert str(found.fault).startswith(fault)
    assert found.fault is not None
    assert found.fault.name in FAULTS
    assert not drives.enabled
    robot.wait_for_no_torque()
    drives.write(PUSH)
    robot.order("mend")
    drives.reset(10.0)
    assert robot.torques == (0.0, 0.0)
    drives.enable(10.0)
    drives.write(PUSH)
    wait_for(lambda: robot.torques == SHAFTS)
    drives.close()
    robot.wait_for_no_torque()


@pytest.mark.extra
@pytest.mark.parametrize("samples", [0, 1, 2, 20, 60])
def test_a_controller_that_fails_at_any_moment_ends_the_torque(
    robot: ControlledRobot, tmp_path: Path, samples: int
) -> None:
    """As where a hardware component reports an error: under-voltage, a missing brake resistor, a drive's own fault."""
    drives = opened(tmp_path)
    drives.write(PUSH)
    for _ in range(samples):
        exchanged(drives, lambda one: one.complete)
    robot.order("fault 1 CONTROLLER_DEACTIVATED")
    fault = exchanged(drives, lambda one: one.fault is not None).fault
    assert fault is not None and fault.name == "controller_lost"
    assert not drives.enabled
    robot.wait_for_no_torque()
    drives.close()


@pytest.mark.extra
def test_a_joint_without_an_angle_is_refused_before_anything_has_torque(robot: ControlledRobot, tmp_path: Path) -> None:
    """As of an encoder that is not calibrated."""
    robot.order("fault 2 STATE_NOT_FINITE")
    with pytest.raises(DriveError, match="states_missing: /cell/joint_states: position of right is nan"):
        connect(str(drives_file(tmp_path, set_up_timeout_ms=2000))).open()
    assert robot.torques == (0.0, 0.0)


@pytest.mark.extra
def test_a_controller_that_commands_no_effort_is_refused(cell: Bench, tmp_path: Path) -> None:
    with controlled_robot(cell.domain, interface="velocity") as robot:
        with pytest.raises(DriveError, match=r"controller_differs: .* commands velocity, expected effort"):
            connect(str(drives_file(tmp_path))).open()
        assert robot.torques == (0.0, 0.0)


@pytest.mark.parametrize(
    ("changed", "fault"),
    [
        ({"link": {**LINK, "joints": ["left", "right"]}}, "controller_differs: .* right, left, expected left, right"),
        (
            {"link": {**LINK, "joints": ["q11", "q21"], "states": "/joint_states"}},
            "states_shared: /joint_states is also where this graph publishes q11 and q21",
        ),
        ({"period_us": PERIOD_US // 2, "gather_deadline_us": 5000}, "states_slow: .* has 50 Hz, the run needs 100 Hz"),
        long({"link": {**LINK, "joints": ["right", "lift"]}}, "states_missing: .*no joint lift: gripper, left, "),
        long({"link": {**LINK, "joints": ["roll", "lift"]}}, "states_missing: .* other joints: gripper, left, right, "),
        long({"link": {**LINK, "controller": "/cell/efort"}}, "controller_missing: /cell/efort/commands "),
        long({"link": {**LINK, "states": "/cell/states"}}, "states_missing: /cell/states: 0 states with "),
    ],
)
def test_what_cannot_work_is_refused_before_anything_has_torque(
    robot: ControlledRobot, tmp_path: Path, changed: dict[str, Any], fault: str
) -> None:
    with pytest.raises(DriveError, match=fault):
        connect(str(drives_file(tmp_path, set_up_timeout_ms=2000, **changed))).open()


@pytest.mark.extra
@pytest.mark.parametrize(
    "wrong",
    [
        pytest.param({"q11": {**MOTORS["q21"], "id": 1}, "q21": {**MOTORS["q11"], "id": 0}}, id="swapped"),
        pytest.param({"q11": {**MOTORS["q11"], "sign": 1}}, id="sign"),
        pytest.param({"q11": {**MOTORS["q11"], "gear_ratio": 3.0}}, id="gear"),
    ],
)
def test_wrong_motors_are_refused_by_the_posture(robot: ControlledRobot, tmp_path: Path, wrong: dict[str, Any]) -> None:
    q11, _, q21, _ = closed_posture()
    motors = {joint: {**facts, "torque_limit_nm": 5.0} for joint, facts in {**MOTORS, **wrong}.items()}
    file = drives_file(tmp_path, motors=motors, posture={"q11": q11, "q21": q21})
    drives = connect(str(file)).open()
    with pytest.raises(DriveError, match=r"posture_unconfirmed: q[12]1 reads .* declared "):
        drives.confirm_start(10.0)
    drives.close()


@pytest.mark.extra
def test_states_that_are_more_frequent_are_thinned_out(cell: Bench, tmp_path: Path) -> None:
    with controlled_robot(cell.domain, PERIOD_US // 4, velocities=True, efforts=True):
        drives = opened(tmp_path)
        counted = sum(exchanged(drives, lambda one: one.complete).periods for _ in range(20))
        # whoever waits for every fourth state gets a sample from each; a busy machine may lose some, which are counted
        assert counted >= 20
        lost = dict(drives.unused)["lost_states"]
        assert counted <= 20 + lost
        drives.close()


def test_a_torque_that_is_measured_has_acted(cell: Bench, tmp_path: Path) -> None:
    with controlled_robot(cell.domain, velocities=True, efforts=True):
        drives = opened(tmp_path)
        drives.write((STRONG, -STRONG))
        pushed = exchanged(drives, lambda one: one.complete and one.readings[0].torque > 0.0)
        assert pushed.readings[0].velocity > 0.0 > pushed.readings[1].velocity
        drives.close()


def test_a_watchdog_that_does_not_hear_the_commands_counts_as_missing(robot: ControlledRobot, tmp_path: Path) -> None:
    """One that is there and publishes, but has not found the bridge yet, would not notice that its torque ends."""
    _, link = load_joints(str(drives_file(tmp_path)))
    bridge, watchdog = (
        rclpy.create_node(name, namespace="/deaf", enable_rosout=False) for name in ("controlled_joints", WATCHDOG)
    )
    try:
        for node in (bridge, watchdog):
            node.create_publisher(Float64MultiArray, link.commands, 1)
        deaf = f"watchdog_missing: /deaf/{WATCHDOG}: it does not hear what this bridge publishes on {link.commands}"
        with pytest.raises(DriveError, match=deaf):
            ControllerWatch(bridge, link).find(time.monotonic() + 10.0)
    finally:
        bridge.destroy_node()
        watchdog.destroy_node()


@pytest.mark.parametrize("link", [{}, {"takes": "gains", "unit": "A"}], ids=["effort", "gains"])
def test_a_bridge_that_hangs_or_dies_leaves_no_torque(bench: Bench, tmp_path: Path, link: dict[str, str]) -> None:
    path = drives_file(tmp_path, link={**LINK, **link})
    with controlled_robot(bench.domain, **link) as robot:
        probe = bench.probe()
        bench.start("command_watchdog", drives=str(path))
        stop = {"safety.stop_cycles": 3}
        bridge = bench.start("drive_bridge", drives=str(path), rate_hz=RATE_HZ, command_timeout_ms=10_000.0, **stop)

        def answer(message: Any) -> None:
            sample = probe.sample(message, RATE_HZ)
            if sample is not None:
                stamp = sample_stamp_ns(sample, RATE_HZ, probe.epoch_ns)
                probe.publish(TORQUE_COMMAND, joint_state(stamp, ACTIVE_JOINTS, effort=PUSH))

        def change(transition: int) -> bool:
            request = ChangeState.Request(transition=Transition(id=transition))
            return bool(probe.call(ChangeState, "/drive_bridge/change_state", request).success)

        def faults() -> list[str]:
            return [one.data.partition(":")[0] for one in probe.got(FAULTS_TOPIC)]

        probe.listen(MOTOR_STATES, callback=answer)
        probe.join("drive_bridge", [TORQUE_COMMAND, FAULTS_TOPIC], [FAULTS_TOPIC, DRIVES_STATE])
        assert change(Transition.TRANSITION_CONFIGURE)
        assert change(Transition.TRANSITION_ACTIVATE)
        probe.wait_for(lambda: robot.torques == SHAFTS, "the torque")
        bridge.send(signal.SIGSTOP)
        probe.wait_for(lambda: robot.torques == (0.0, 0.0), "no torque while the bridge hangs")
        probe.wait_for(lambda: "command_lost" in faults(), "the fault")
        bridge.send(signal.SIGCONT)
        probe.wait_for(lambda: probe.got(DRIVES_STATE)[-1].data.startswith("command_lost"), "a bridge that has stopped")
        # on waking, the bridge renews its torque until it hears of the fault: its zero may still be on its way
        robot.wait_for_no_torque()
        assert probe.reset("/drive_bridge").success
        assert robot.torques == (0.0, 0.0)
        assert change(Transition.TRANSITION_DEACTIVATE)
        assert change(Transition.TRANSITION_ACTIVATE)
        probe.wait_for(lambda: probe.got(DRIVES_STATE)[-1].data == ALL_WELL, "drives that follow")
        probe.wait_for(lambda: robot.torques == SHAFTS, "the torque again")
        bridge.send(signal.SIGKILL)
        probe.wait_for(lambda: robot.torques == (0.0, 0.0), "no torque once the bridge is dead")
