# SPDX-License-Identifier: Apache-2.0
"""The MOTKIN bench under its makers' ROS 2 stack, written from their public sources alone and in a process of its own.

Nothing of the project is imported: controller manager, broadcaster, forward controller, hardware plugin, board and
mechanism are this file's, the mechanism in MuJoCo with masses of the bench's public URDF. Their sources leave open, and
here it is chosen: the order of joints in a message (not that of the URDF), 4000 steps a second of the board, a velocity
from differences over 2 ms, friction (4 mNm, smooth), and that a late controller manager drops the cycles it missed.
"""

from __future__ import annotations

import argparse
import math
import signal
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, String

MOTORS = ("motor_1", "motor_2")
PASSIVE = ("passive_1", "passive_2")
PUBLISHED = ("passive_2", "motor_2", "passive_1", "motor_1")
"""The broadcaster's order is that of a hash table."""

AXES = np.array([[-0.0421006, 0.0302628], [0.0578994, 0.0302628]])
"""Of the motors, in the frame of the case (m)."""
CRANK, COUPLER = 0.06, 0.1
PHI, PSI = (math.pi / 2.0, math.pi / 2.0), (0.21205399999927563, 2.511306362956145)

TORQUE_CONSTANT = 0.062  # Nm/A
CURRENT_LIMIT = 3.0  # A
COUNTS = 16384
WATCHDOG_S = 0.02
PATIENCE_S = 1.0
FRICTION, FRICTION_WIDTH = 0.004, 0.1  # Nm, rad/s
LIMITS = np.repeat([0.9, 1.0, 1.0, 1000.0, 1000.0], 2).reshape(5, 2)
"""Of positions, velocities, efforts and gains in their URDF, which Jazzy's controller manager enforces where it is told
to: `enforce_command_limits` is false."""

POSITION, VELOCITY, EFFORT, KP, KD = range(5)
CONTROLLER = "motkin_forward_command_controller"
FAULTS = (
    "silent",  # the broadcaster publishes nothing
    "missing",  # no motor_1 in its messages
    "frozen",  # the encoder of motor_1 stands still
    "jump",  # it reads 0.5 rad more
    "nan",  # it reads nothing
    "hang",  # the controller manager stands still, so that the board hears nothing
    "cut",  # the network to the other computer is cut
    "deactivate",  # the controller is deactivated
    "unload",  # and gone
    "second_commander",  # another node commands, once
    "outside",  # something that others do
)
PLUGINS = {
    False: "motkin_dual_motor_testbed_hardware/FiveBarSystem",
    True: "motkin_gz_ros2_control/GazeboMotkinSimSystem",
}

MECHANISM = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{step}" gravity="0 {gravity} 0" integrator="implicitfast" iterations="50" tolerance="1e-14"/>
  <default><equality solref="{stiff} 1" solimp="0.9999 0.9999 0.001"/></default>
  <worldbody>
    <body name="rotor" pos="-0.0421006 0.0302628 0">
      <joint name="motor_1" axis="0 0 -1"/>
      <inertial pos="0 0.00341447 0" mass="0.0421552" diaginertia="1.4e-5 1.4e-5 1.35352e-5"/>
      <body name="arm_l2" pos="0 0.06 0" quat="{left}">
        <joint name="passive_1" axis="0 0 1"/>
        <inertial pos="0.0486799 0 0" mass="0.00836663" diaginertia="1.3e-5 1.3e-5 1.31626e-5"/>
        <site name="tip_l" pos="0.1 0 0"/>
      </body>
    </body>
    <body name="rotor_2" pos="0.0578994 0.0302628 0">
      <joint name="motor_2" axis="0 0 -1"/>
      <inertial pos="0 0.00413346 0" mass="0.0348226" diaginertia="1.3e-5 1.3e-5 1.24874e-5"/>
      <body name="arm_r2" pos="0 0.06 0" quat="{right}">
        <joint name="passive_2" axis="0 0 1"/>
        <inertial pos="0.0556871 0 0" mass="0.00968954" diaginertia="1.6e-5 1.6e-5 1.62905e-5"/>
        <site name="tip_r" pos="0.1 0 0"/>
      </body>
    </body>
  </worldbody>
  <equality><connect site1="tip_l" site2="tip_r"/></equality>
</mujoco>
"""


def description(simulation: bool) -> str:
    """Return the bench's URDF, whose rotors are turned upside down, without its shapes."""
    joints = (
        ("motor_1", "case", "rotor", "-0.0421006 0.0302628 0.00805311", "-3.14159265358979 0 0", "0 0 1"),
        ("motor_2", "case", "rotor_2", "0.0578994 0.0302628 0.00805311", "3.14159265358979 0 0", "0 0 1"),
        ("passive_1", "rotor", "arm_l2", "0 -0.06 -0.035", "0 0 -0.212054", "0 0 -1"),
        ("passive_2", "rotor_2", "arm_r2", "0 -0.06 -0.024", "0 0 -1.5708", "0 0 -1"),
    )
    tips = (
        ("closing_tip_2", "arm_l2", "0.1 0 0", "3.14159 0 -1.5708"),
        ("closing_tip_1", "arm_r2", "0.0589379 -0.0807857 -0.011", "-3.14159 0 -0.940506"),
    )
    parts = ['<link name="base_link"/><link name="case"/>']
    parts += [
        '<joint name="base_link_to_case" type="fixed"><parent link="base_link"/><child link="case"/></joint>',
        f'<ros2_control name="motkin" type="system"><hardware><plugin>{PLUGINS[simulation]}</plugin></hardware>',
        "</ros2_control>",
    ]
    for name, parent, child, xyz, rpy, axis in joints:
        parts.append(
            f'<link name="{child}"/><joint name="{name}" type="continuous"><origin xyz="{xyz}" rpy="{rpy}"/>'
            f'<parent link="{parent}"/><child link="{child}"/><axis xyz="{axis}"/>'
            f'<limit effort="10" velocity="10"/></joint>'
        )
    for child, parent, xyz, rpy in tips:
        parts.append(
            f'<link name="{child}"/><joint name="{child}_frame" type="fixed"><origin xyz="{xyz}" rpy="{rpy}"/>'
            f'<parent link="{parent}"/><child link="{child}"/></joint>'
        )
    return f'<?xml version="1.0"?><robot name="fivebar_2dof">{"".join(parts)}</robot>'


def cranks_at(x: float, y: float) -> tuple[float, float]:
    """Return both motors (rad) with elbows outwards and the platform at x, y (m) from the middle of their axes."""
    point = AXES.mean(axis=0) + np.array((x, y))
    angles = []
    for axis, phi, outward in zip(AXES, PHI, (1.0, -1.0), strict=True):
        dx, dy = point - axis
        distance = math.hypot(dx, dy)
        bend = math.acos((CRANK**2 + distance**2 - COUPLER**2) / (2.0 * CRANK * distance))
        angles.append(math.remainder(phi - (math.atan2(dy, dx) + outward * bend), 2.0 * math.pi))
    return angles[0], angles[1]


@dataclass(slots=True)
class Assembly:
    """Passive joints as the hardware component computes them: always the assembly above the elbows' line."""

    positions: list[float] = field(default_factory=lambda: [0.0, 0.0])
    velocities: list[float] = field(default_factory=lambda: [0.0, 0.0])

    def update(self, motors: Sequence[float], speeds: Sequence[float]) -> None:
        angles = np.array(PHI) - motors
        elbows = AXES + CRANK * np.column_stack([np.cos(angles), np.sin(angles)])
        moving = CRANK * np.column_stack([np.sin(angles), -np.cos(angles)]) * np.asarray(speeds)[:, None]
        line = elbows[1] - elbows[0]
        gap = float(np.hypot(*line))
        if not 1e-9 <= gap <= 2.0 * COUPLER:
            return  # the last ones are kept
        height = math.sqrt(COUPLER**2 - gap**2 / 4.0) / gap
        arms = elbows.mean(axis=0) + height * np.array([-line[1], line[0]]) - elbows
        self.positions = [math.atan2(arms[i, 1], arms[i, 0]) - PSI[i] + motors[i] for i in (0, 1)]
        self.velocities = [0.0, 0.0]
        if abs(arms[0, 0] * arms[1, 1] - arms[0, 1] * arms[1, 0]) >= 1e-9:
            slip = np.linalg.solve(arms, np.sum(arms * moving, axis=1)) - moving
            turning = (arms[:, 0] * slip[:, 1] - arms[:, 1] * slip[:, 0]) / COUPLER**2 + speeds
            self.velocities = turning.tolist()


class Mechanism:
    """The five-bar in MuJoCo, in the frame of its case."""

    def __init__(self, step: float, gravity: float, start: Sequence[float]) -> None:
        # a body's x axis is to lie at psi where its motor is at 0
        quats = [f"{math.cos(psi / 2.0)} 0 0 {math.sin(psi / 2.0)}" for psi in PSI]
        text = MECHANISM.format(step=step, stiff=2.0 * step, gravity=gravity, left=quats[0], right=quats[1])
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        self.order = [self.model.joint(name).qposadr[0] for name in (*MOTORS, *PASSIVE)]
        assembly = Assembly()
        assembly.update(start, (0.0, 0.0))
        self.data.qpos[self.order] = [*start, *assembly.positions]
        mujoco.mj_forward(self.model, self.data)

    def positions(self) -> list[float]:
        return self.data.qpos[self.order].tolist()

    def velocities(self) -> list[float]:
        return self.data.qvel[self.order].tolist()

    def step(self, torques: Sequence[float]) -> None:
        """Advance by a step under torques (Nm) at the motors."""
        speeds = self.velocities()
        applied = self.data.qfrc_applied
        for i in (0, 1):
            applied[self.order[i]] = torques[i] - FRICTION * math.tanh(speeds[i] / FRICTION_WIDTH)
        mujoco.mj_step(self.model, self.data)

    def platform(self) -> tuple[float, float, float]:
        """Return x and y from the middle of the motors (m) and the sine between the couplers, negative once crossed."""
        tip = (self.data.site("tip_l").xpos[:2] + self.data.site("tip_r").xpos[:2]) / 2.0
        q1, q2, p1, p2 = self.positions()
        turned = (PSI[1] - q2 + p2) - (PSI[0] - q1 + p1)
        x, y = tip - AXES.mean(axis=0)
        return float(x), float(y), math.sin(turned)


@dataclass(slots=True)
class Command:
    """The board's last command: five rows of two values, live motors, and when (s, its own time)."""

    values: np.ndarray = field(default_factory=lambda: np.zeros((5, 2)))
    live: bool = False
    at: float = -math.inf


class Board:
    """Runs the law at its own rate and lets both currents go where no command comes."""

    def __init__(self, mechanism: Mechanism, simulation: bool, hold: bool) -> None:
        self.mechanism = mechanism
        self.simulation = simulation
        self.held = hold
        self.time = 0.0
        self.command = Command()
        self.torques = (0.0, 0.0)
        self.truth: list[tuple[float, ...]] = []
        angles = self.angles()
        self.recent = [angles] * max(1, round(0.002 / mechanism.model.opt.timestep))

    def angles(self) -> tuple[float, float]:
        first, second = self.mechanism.positions()[:2]
        if self.simulation:
            return first, second
        count = 2.0 * math.pi / COUNTS
        return round(first / count) * count, round(second / count) * count

    def speeds(self) -> tuple[float, float]:
        if self.simulation:
            first, second = self.mechanism.velocities()[:2]
            return first, second
        span = len(self.recent) * self.mechanism.model.opt.timestep
        now = self.angles()
        return (now[0] - self.recent[0][0]) / span, (now[1] - self.recent[0][1]) / span

    def law(self) -> tuple[float, float]:
        """Return what the motors get (Nm)."""
        if not self.command.live or (not self.simulation and self.time - self.command.at > WATCHDOG_S):
            return 0.0, 0.0
        angles, speeds = self.angles(), self.speeds()
        position, velocity, effort, kp, kd = self.command.values
        if self.simulation:  # damped implicitly, by the inertia of the rotor about its axis
            inertia = np.array([1.35352e-5 + 0.0421552 * 0.00341447**2, 1.24874e-5 + 0.0348226 * 0.00413346**2])
            kd = kd / (1.0 + kd * self.mechanism.model.opt.timestep / inertia)
        wanted = effort + kp * (position - angles) + kd * (velocity - speeds)
        if not self.simulation:
            wanted = TORQUE_CONSTANT * np.clip(wanted, -CURRENT_LIMIT, CURRENT_LIMIT)
        return float(wanted[0]), float(wanted[1])

    def advance(self, until: float, wall_ns: int) -> None:
        """Advance to a time (s) that is wall_ns on the clock of the machine."""
        step = self.mechanism.model.opt.timestep
        while self.time + step <= until + 1e-9:
            self.torques = self.law()
            self.held = self.held and self.torques == (0.0, 0.0)
            if not self.held:
                self.mechanism.step(self.torques)
            self.time += step
            self.recent = [*self.recent[1:], self.angles()]
            x, y, side = self.mechanism.platform()
            self.truth.append((self.time, wall_ns * 1e-9 - (until - self.time), x, y, side, *self.torques))

    def near(self, sine: float) -> bool:
        """Return whether the couplers have come as close to a line as this sine."""
        return bool(self.truth) and self.truth[-1][4] < sine


class Stack:
    """Controller manager with broadcaster, controller and hardware."""

    def __init__(self, options: argparse.Namespace) -> None:
        self.options = options
        self.simulation = options.simulation
        step = 0.001 if self.simulation else 0.00025
        start = options.motors or cranks_at(*options.start)
        mechanism = Mechanism(step, -9.81 if options.upright else 0.0, start)
        self.board = Board(mechanism, self.simulation, options.upright)
        self.interfaces = np.zeros((5, 2))
        self.buffer: Sequence[float] = [0.0] * 10  # initial_command
        self.heard = threading.Event()
        self.asked = False
        self.epoch_ns = 0 if options.simulation else time.time_ns()
        self.active = True
        self.faults: set[str] = set()
        self.assembly = Assembly()
        self.frozen: float | None = None
        self.manager = Node("controller_manager")
        self.manager.declare_parameter("update_rate", options.rate)
        self.broadcaster = Node("joint_state_broadcaster")
        self.states = self.broadcaster.create_publisher(JointState, "/joint_states", 10)
        self.controller = Node(CONTROLLER)
        self.controller.declare_parameter("joints", list(MOTORS))
        self.controller.create_subscription(Float64MultiArray, "~/commands", self.hear, 10)
        self.others: list[Node] = []
        self.clock = self.manager.create_publisher(Clock, "/clock", 10) if self.simulation else None
        self.describer = Node("robot_state_publisher")
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.described = self.describer.create_publisher(String, "/robot_description", latched)
        self.described.publish(String(data=description(self.simulation)))
        self.executor = SingleThreadedExecutor()
        for node in (self.manager, self.broadcaster, self.controller, self.describer):
            self.executor.add_node(node)

    def hear(self, message: Float64MultiArray) -> None:
        """Keep the newest message; its length is asked for when it is to be applied."""
        if "cut" not in self.faults:
            self.buffer = list(message.data)
            self.asked = True
            self.heard.set()

    def publish(self) -> None:
        positions, speeds = list(self.board.angles()), list(self.board.speeds())
        if self.simulation:
            passive, turning = self.board.mechanism.positions()[2:], self.board.mechanism.velocities()[2:]
        else:
            self.assembly.update(positions, speeds)
            passive, turning = self.assembly.positions, self.assembly.velocities
        if "frozen" in self.faults:
            self.frozen = positions[0] if self.frozen is None else self.frozen
            positions[0] = self.frozen
        if "jump" in self.faults:
            positions[0] += 0.5
        if "nan" in self.faults:
            positions[0] = math.nan
        efforts = [torque / (1.0 if self.simulation else TORQUE_CONSTANT) for torque in self.board.torques]
        values = dict(zip(MOTORS, zip(positions, speeds, efforts, strict=True), strict=True))
        values |= dict(zip(PASSIVE, zip(passive, turning, (math.nan, math.nan), strict=True), strict=True))
        message = JointState()
        nanoseconds = self.epoch_ns + round(self.board.time * 1e9)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(nanoseconds, 10**9)
        if self.clock is not None:
            self.clock.publish(Clock(clock=message.header.stamp))
        names = [name for name in PUBLISHED if not ("missing" in self.faults and name == MOTORS[0])]
        message.name = names
        message.position, message.velocity, message.effort = (
            [float(values[name][i]) for name in names] for i in (0, 1, 2)
        )
        if not {"silent", "cut"} & self.faults:
            self.states.publish(message)

    def cycle(self) -> None:
        """Read, update and write once."""
        self.publish()
        if not self.active:
            self.board.command = Command(live=False, at=self.board.time)
            return
        newest = self.buffer
        if len(newest) == self.interfaces.size:
            values = np.reshape(newest, (5, 2))
            self.interfaces = np.where(np.isfinite(values), values, self.interfaces)
        sent = np.clip(self.interfaces, -LIMITS, LIMITS) if self.options.limits else self.interfaces
        self.board.command = Command(np.array(sent), True, self.board.time)

    def deactivate(self) -> None:
        self.active = False
        self.interfaces[VELOCITY : EFFORT + 1] = 0.0

    def unload(self) -> None:
        self.deactivate()
        self.executor.remove_node(self.controller)
        self.controller.destroy_node()

    def second_commander(self) -> None:
        """Another node takes over with a command of its own, once."""
        other = Node("second_commander")
        self.others.append(other)
        publisher = other.create_publisher(Float64MultiArray, f"/{CONTROLLER}/commands", 10)
        effort = 0.005 if self.simulation else 0.005 / TORQUE_CONSTANT
        publisher.publish(Float64MultiArray(data=[0.0] * 4 + [effort, -effort] + [0.0] * 4))

    def happen(self, fault: str) -> None:
        acts: dict[str, Callable[[], Any]] = {
            "deactivate": self.deactivate,
            "unload": self.unload,
            "second_commander": self.second_commander,
        }
        self.faults.add(fault)
        acts.get(fault, lambda: None)()

    def passed(self, period: float) -> float:
        """Wait for the next cycle; return by how much the bench has moved on (s)."""
        if self.options.patient and self.asked:
            self.asked = self.heard.wait(PATIENCE_S)
            self.heard.clear()
            self.due = time.monotonic()
        else:
            self.due += period
            time.sleep(max(0.0, self.due - time.monotonic()))
        now = time.monotonic()
        elapsed, self.last = now - self.last, now
        if self.simulation or self.options.patient:
            return period
        self.due += math.floor((now - self.due) / period) * period
        return elapsed

    def run(self, stop: threading.Event) -> None:
        """Advance by cycles; say when the couplers come near to a line, at which a fault happens."""
        period = 1.0 / self.options.rate
        self.last = self.due = time.monotonic()
        until = 0.0
        told = False
        while not stop.is_set():
            until += self.passed(period)
            now_ns = time.monotonic_ns()
            self.board.advance(until, now_ns)
            if not told and self.board.near(self.options.near):
                told = True
                if self.options.fault:
                    self.options.patient = False
                    self.happen(self.options.fault)
                print(f"near {now_ns}", flush=True)
            if "hang" not in self.faults:
                self.cycle()


def arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("truth", type=Path, help="file for what really happened, .npy, written at the end")
    parser.add_argument("--rate", type=int, default=500, help="update_rate of the controller manager (Hz)")
    parser.add_argument(
        "--start", type=float, nargs=2, default=(0.0, 0.12), help="platform from the middle of the motors (m)"
    )
    parser.add_argument("--motors", type=float, nargs=2, help="where the motors stand instead (rad), 0 0 in Gazebo")
    parser.add_argument("--simulation", action="store_true", help="as in Gazebo: torques, exact states, its own time")
    parser.add_argument("--upright", action="store_true", help="gravity along -y; held until the motors have torque")
    parser.add_argument("--limits", action="store_true", help="enforce_command_limits")
    parser.add_argument(
        "--patient", action="store_true", help="no time passes while a command is awaited, until a fault"
    )
    parser.add_argument("--near", type=float, default=0.25, help="sine between the couplers at which it is near")
    parser.add_argument("--fault", choices=FAULTS, help="what happens there, from where on time passes")
    return parser


def main() -> None:
    options = arguments().parse_args()
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    stack = Stack(options)

    def spin() -> None:
        try:
            while not stop.is_set():
                stack.executor.spin_once(timeout_sec=0.1)
        except ExternalShutdownException:
            pass

    listening = threading.Thread(target=spin)
    listening.start()
    print("ready", flush=True)
    stack.run(stop)
    listening.join()
    truth = np.array(stack.board.truth)
    truth[:, 0] += stack.epoch_ns * 1e-9
    np.save(options.truth, truth)
    rclpy.shutdown()


if __name__ == "__main__":
    sys.exit(main())
