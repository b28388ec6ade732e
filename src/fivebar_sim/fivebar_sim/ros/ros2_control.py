# SPDX-License-Identifier: Apache-2.0
"""The side of a controller manager: joint states as a joint_state_broadcaster publishes them, commands as an effort
controller takes them, or a forward controller with the gains of motor boards.

Messages are put together here anew, and not taken from the bridge, so that each side checks the other.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from pydantic import Field
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from fivebar_description.ros.run import use_local_network_only
from fivebar_description.strict_yaml import StrictModel, validate
from fivebar_sim.motors.configuration import MotorsEmulationFile
from fivebar_sim.motors.emulation import emulating
from fivebar_sim.motors.motors import EmulatedMotors

OTHER_JOINTS = ("gripper", "wrist")
"""Joints of the robot's other components, of which nothing is known."""

DEPTH = 10

DIAGNOSTICS_PERIOD = 1.0

GAINS = "gains"
"""The kind of commands that a forward controller takes with the gains of motor boards."""

STOPPED, NOT_FINITE, DEACTIVATED, UNLOADED, INTRUDED = (
    "BROADCASTER_STOPPED",
    "STATE_NOT_FINITE",
    "CONTROLLER_DEACTIVATED",
    "CONTROLLER_UNLOADED",
    "SECOND_COMMANDER",
)
ERRORS = (STOPPED, NOT_FINITE, DEACTIVATED, UNLOADED, INTRUDED)
"""Faults that `fault MOTOR NAME` injects; all but the state of a joint is about both motors."""


class ControlledLinkFile(StrictModel):
    """Section `link`: the names, and what the states are like.

    Attributes:
        controller, states, manager: full names of the controller, of the topic of states, and of the controller
            manager.
        joints: joints of the controller, in its order; the `id` of a motor is the place of its joint there.
        commands: topic of the controller's commands, by default its own topic `commands`.
        takes: what a command has: `effort` of each joint, or with `gains` the positions of all joints, their
            velocities, efforts, kp and kd. Boards close iq = effort + kp (position - q) + kd (velocity - dq).
        unit: of efforts and gains, Nm or A.
        inner_loop: what the bridge makes of the gains, of which the boards know nothing.
        passive: names under which the passive joints are published, whose angles come from the simulated robot.
        interface: what the controller commands.
        updates: updates of the controller manager per sampling period, each of which publishes states.
        velocities, efforts: whether the hardware measures them; what it does not measure is NaN.
        clock_offset_s: how far the stamps are from this machine's clock.
    """

    controller: str
    states: str
    manager: str
    joints: Annotated[tuple[str, str], Field(strict=False)]
    commands: str = ""
    takes: Literal["effort", "gains"] = "effort"
    unit: Literal["Nm", "A"] = "Nm"
    passive: Annotated[tuple[str, ...], Field(strict=False)] = ()
    inner_loop: Mapping[str, Any] = Field(default_factory=dict)
    interface: str = "effort"
    updates: Annotated[int, Field(ge=1, le=10)] = 1
    velocities: bool = False
    efforts: bool = False
    clock_offset_s: float = -3.5


class ControllerManager:
    """The `MotorLink` of two joints under a controller manager."""

    def __init__(self, file: MotorsEmulationFile) -> None:
        """Join the graph with broadcaster and active controller.

        Raises:
            InputError: the section `link` is wrong.
        """
        self._link = link = validate(dict(file.link), ControlledLinkFile, f"{file.name}: link")
        self._file = file
        use_local_network_only()
        self._context = Context()
        rclpy.init(context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._nodes = [
            self._node(name)
            for name in (link.manager, f"{link.manager.rpartition('/')[0]}/joint_state_broadcaster", link.controller)
        ]
        manager, broadcaster, self._controller = self._nodes
        self._controller.declare_parameter("joints", list(link.joints))
        self._controller.declare_parameter("interface_name", link.interface)
        self._states = broadcaster.create_publisher(JointState, link.states, DEPTH)
        self._diagnostics = manager.create_publisher(DiagnosticArray, "/diagnostics", DEPTH)
        self._reported = 0.0
        self._subscription: Subscription[Float64MultiArray] | None = None
        self._intruder: Publisher[Float64MultiArray] | None = None
        self._taken: list[tuple[float, ...]] = []
        count = len(link.joints) * (5 if link.takes == GAINS else 1)
        self._off = (0.0,) * count
        self._values = self._off
        """The command that the controller holds, in the order of its joints."""
        self._faults: set[str] = set()
        self._published = self._skipped = 0
        self._began = time.time_ns() + round(link.clock_offset_s * 1e9)
        self._load()
        self.place = f"{link.controller}, {link.states}"

    def serve(self, motors: EmulatedMotors, timeout: float) -> None:
        """Wait for a command for a time (s), and update: read and publish states, apply the command that is held."""
        self._watch(motors)
        self._publish(motors)
        self._executor.spin_once(timeout_sec=timeout)
        taken, self._taken = self._taken, []
        for values in taken:
            self._update(motors, values)
        if self._link.takes == GAINS and self._file.pace != "commands":
            # boards act at a rate of their own, not that of the updates
            self._apply(motors)
        self._report()

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        for node in self._nodes:
            node.destroy_node()
        self._context.try_shutdown()

    def _node(self, name: str) -> Node:
        namespace, _, short = name.rpartition("/")
        node = Node(
            short, namespace=namespace or "/", context=self._context, use_global_arguments=False, enable_rosout=False
        )
        self._executor.add_node(node)
        return node

    @property
    def _active(self) -> bool:
        """Whether the controller applies commands."""
        return not self._faults & {DEACTIVATED, UNLOADED}

    def _load(self) -> None:
        """Have the controller listen to commands."""
        self._subscription = self._controller.create_subscription(
            Float64MultiArray, self._topic, self._on_command, DEPTH
        )

    @property
    def _topic(self) -> str:
        """The topic of the controller's commands."""
        return self._link.commands or f"{self._link.controller}/commands"

    def _on_command(self, message: Float64MultiArray) -> None:
        """Take a command as the forward controllers do: one that is not finite or of another length is left out.

        NaN leaves a value of the five as it is.
        """
        values = tuple(message.data)
        if len(values) != len(self._off):
            return
        if self._link.takes == GAINS or all(map(math.isfinite, values)):
            self._taken.append(values)

    def _update(self, motors: EmulatedMotors, values: tuple[float, ...]) -> None:
        """Move the robot on by a sampling period under the command that was held, and hold another from then on."""
        for _ in range(self._link.updates if self._file.pace == "commands" else 0):
            for _ in range(motors.parts):
                self._apply(motors)
            self._publish(motors)
        kept = zip(values, self._values, strict=True)
        self._values = tuple(old if math.isnan(new) else new for new, old in kept) if self._active else self._off

    def _apply(self, motors: EmulatedMotors) -> None:
        """Command both motors what is held, which moves the robot on where time waits for commands."""
        powered = any(self._values) or any(motor.powered for motor in motors.motors)
        torques = [self._torque(motors, number) for number in range(2)]
        for number, torque in enumerate(torques):
            motors.command(number, powered, torque, time.monotonic())

    def _torque(self, motors: EmulatedMotors, number: int) -> float:
        """Return the torque (Nm) at the shaft of a motor under the command that is held."""
        facts = motors.motors[number].facts
        per_effort = facts.torque_constant if self._link.unit == "A" else 1.0
        if self._link.takes != GAINS:
            return per_effort * self._values[facts.id]
        position, velocity, effort, kp, kd = self._values[facts.id :: len(self._link.joints)]
        angles, speeds = motors.plant.seen()
        q = facts.sign * facts.gear_ratio * (angles[2 * number] - facts.zero_rad)
        dq = facts.sign * facts.gear_ratio * speeds[2 * number]
        return per_effort * (effort + kp * (position - q) + kd * (velocity - dq))

    def _publish(self, motors: EmulatedMotors) -> None:
        """Publish the present state, unless that has been done."""
        record = motors.measure()
        if record.number == self._published:
            return
        if self._file.pace == "commands" and not any(self._values):
            # a robot that waits for its first torque waits for a slow machine too
            self._skipped += record.number - self._published - 1
        self._published = record.number
        # an update first reads, then writes what has come by then
        states = [motor.state for motor in motors.motors]
        if self._file.pace != "commands":
            self._apply(motors)
        if STOPPED in self._faults:
            return
        message = JointState()
        stamp = self._began + (record.number - self._skipped) * self._file.period_us * 1000
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
        values = {name: (math.nan, math.nan, math.nan) for name in OTHER_JOINTS}
        for motor, state in zip(motors.motors, states, strict=True):
            values[self._link.joints[motor.facts.id]] = (
                math.nan if motor.fault == NOT_FINITE else state.position,
                state.velocity if self._link.velocities else math.nan,
                state.torque if self._link.efforts else math.nan,
            )
        for name, index in zip(self._link.passive, (1, 3), strict=False):
            angles, speeds = motors.plant.seen()
            values[name] = (angles[index], speeds[index], math.nan)
        # by name, as a map of the broadcaster has them
        for name in sorted(values):
            if any(motor.silent and name == self._link.joints[motor.facts.id] for motor in motors.motors):
                continue
            message.name.append(name)
            for field, value in zip((message.position, message.velocity, message.effort), values[name], strict=True):
                field.append(value)
        self._states.publish(message)

    def _watch(self, motors: EmulatedMotors) -> None:
        """Do what injected faults ask for, and undo it where they have been mended."""
        for motor in motors.motors:
            if motor.faulty:
                # the joint itself keeps its torque
                motor.faulty, motor.fault = False, motor.fault or NOT_FINITE
        faults = {motor.fault for motor in motors.motors}
        if faults == self._faults:
            return
        self._faults = faults
        if not self._active:
            self._values = self._off
        self._apply_held(motors)
        if UNLOADED in faults and self._subscription is not None:
            self._controller.destroy_subscription(self._subscription)
            self._subscription = None
        elif UNLOADED not in faults and self._subscription is None:
            self._load()
        if INTRUDED in faults and self._intruder is None:
            self._intruder = self._nodes[0].create_publisher(Float64MultiArray, self._topic, DEPTH)
        elif INTRUDED not in faults and self._intruder is not None:
            self._nodes[0].destroy_publisher(self._intruder)
            self._intruder = None

    def _apply_held(self, motors: EmulatedMotors) -> None:
        """Give the motors the torque that is held, without moving the robot on."""
        for number, motor in enumerate(motors.motors):
            motor.command(motor.powered or any(self._values), self._torque(motors, number))

    def _report(self) -> None:
        """Publish the state of the controllers."""
        now = time.monotonic()
        if now < self._reported + DIAGNOSTICS_PERIOD:
            return
        self._reported = now
        state = "active" if self._active else "inactive"
        name = self._link.controller.rpartition("/")[2]
        manager = self._link.manager.rpartition("/")[2]
        status = DiagnosticStatus(name=f"{manager}: Controllers Activity", hardware_id="ros2_control")
        status.values = [KeyValue(key=f"{name}.state", value=state)]
        self._diagnostics.publish(DiagnosticArray(status=[status]))


EMULATOR = emulating(ControllerManager, ERRORS, holds=True)
"""The emulation of the interface."""
