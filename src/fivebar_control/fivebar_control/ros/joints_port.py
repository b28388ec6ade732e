"""The topics of a controller manager as the bridge sees them: joint states, commands, and who is there.

A node in a thread of its own, beside the bridge's, as others have a thread that receives from a bus: states arrive also
while the bridge waits for them.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import math
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from statistics import median
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.srv import GetParameters
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.topic_endpoint_info import TopicEndpointInfo
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from fivebar_control.fault import Fault
from fivebar_control.hardware.configuration import MICROSECONDS
from fivebar_control.hardware.controlled_joints import WATCHDOG, JointsLink
from fivebar_control.hardware.drive_connection import Bell
from fivebar_control.hardware.fault import DriveError
from fivebar_control.hardware.motors_file import MotorsFile
from fivebar_control.hardware.state_grid import SLOWEST, GridSample, JointStates, StateGrid
from fivebar_description.interface import DIAGNOSTICS, JOINT_STATES, NANOSECONDS, node_of_status
from fivebar_description.joint_sample import JointSample, MessageError, part_of
from fivebar_description.publishers import HALF, Living, PublisherOf, second_publisher
from fivebar_description.ros.messages import SampleReader, read_fields
from fivebar_description.ros.qos import best_effort
from fivebar_description.ros.run import NodeExecutor

try:
    from controller_manager_msgs.srv import ListControllers
except ImportError:
    # not installed: diagnostics of the controller manager tell the state of its controllers
    ListControllers = None

NODE = "controlled_joints"

DEPTH = 16
"""States that are kept while the thread gets no processor time."""

LOOK_PERIOD = 0.05
"""Period (s) of looking who publishes and who listens to the commands."""

SPIN_PERIOD = 0.1

MEASURED = 12
"""States by which their period is measured."""

FEWEST = 3
"""The same, where no more come in time."""

SERVICE_TIME = 1.0
"""Longest time (s) that a service of controller or controller manager is waited for."""

WATCHDOG_TIME = 3.5
"""Age (s) of the watchdog's last report, one of which comes each second, beyond which it counts as missing."""

DELIVERY_TIME = 0.5
"""Longest time (s) for which the last command is waited to be acknowledged."""

LATE_PART = 0.5
"""Part of a period by which a state may come later after its stamp than the quickest of the last ones."""

DRIFT = 1e-4
"""How much faster than the states' clock that of this machine may be."""

ACTIVE = "active"
EFFORT = "effort"
ACTIVITY = "Controllers Activity"
"""End of the name of the controller manager's status on /diagnostics, and what controllers are to be there."""


class JointsPort:
    """Receives states and publishes commands, and knows what is wrong with either."""

    def __init__(self, file: MotorsFile, link: JointsLink, bell: Bell | None) -> None:
        """Join the graph; `bell` is rung for each sample."""
        self._link = link
        self._file = file
        self._period = file.period_us / MICROSECONDS
        self._names = tuple(link.joints[motor.id] for motor in file.pair)
        self._bell = bell
        self._received = threading.Condition()
        self._reader = SampleReader()
        self._grid: StateGrid | None = None
        self._stamps: deque[int] = deque(maxlen=MEASURED)
        self._sample: GridSample | None = None
        self._kept: Float64MultiArray | None = None
        self._untaken = self._invalid = self._late = 0
        self._reason = self._others = ""
        self._quickest = math.inf
        self._arrived = time.monotonic()
        self._living = Living(time.monotonic)
        self._commander: Fault | None = None
        self._controller: Fault | None = None
        self._reported: float | None = None
        self._states_known: dict[str, str] = {}
        self._node = Node(NODE, cli_args=["--ros-args", "-r", f"__node:={NODE}"], enable_rosout=False)
        self._watchdog = f"{self._node.get_namespace().rstrip('/')}/{WATCHDOG}"
        self._commands = self._node.create_publisher(Float64MultiArray, link.commands, 1)
        self._node.create_subscription(JointState, link.states, self._on_states, best_effort(DEPTH), raw=True)
        self._node.create_subscription(DiagnosticArray, DIAGNOSTICS.name, self._on_diagnostics, DIAGNOSTICS.qos.depth)
        self._node.create_timer(LOOK_PERIOD, self._look)
        self._ending = threading.Event()
        self._executor = NodeExecutor()
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._spin, name=NODE, daemon=True)
        self._thread.start()

    @property
    def unused(self) -> tuple[tuple[str, int], ...]:
        """States and samples that were lost, late or not used so far: why, and how many."""
        grid = self._grid
        lost = self._untaken + (0 if grid is None else grid.lost)
        old = 0 if grid is None else grid.old
        return (
            ("lost_states", lost),
            ("late_states", self._late),
            ("invalid_states", self._invalid),
            ("old_states", old),
        )

    @property
    def fault(self) -> Fault | None:
        """A fault of controller, commands or watchdog; None while nothing is wrong with them."""
        reported = self._reported
        if reported is not None and time.monotonic() - reported > WATCHDOG_TIME:
            return Fault("watchdog_missing", f"{self._watchdog}: nothing heard for {WATCHDOG_TIME:g} s")
        return self._commander or self._controller

    def staleness(self) -> Fault:
        """Return the fault that states which no longer arrive are."""
        age = f"last state {(time.monotonic() - self._arrived) * 1e3:.0f} ms ago"
        if self._reason:
            return Fault("states_invalid", f"{self._link.states}: {self._reason}; {age}")
        return Fault("states_stale", f"{self._link.states}: {age}")

    def begin(self, timeout: float) -> None:
        """Find states that are frequent enough, the controller as it is described, and the watchdog.

        Raises:
            DriveError: something is missing, or differs, in `timeout` (s).
        """
        if self._node.resolve_topic_name(JOINT_STATES.name) == self._link.states:
            raise DriveError(Fault("states_shared", f"{self._link.states} is also where this graph publishes"))
        end = time.monotonic() + timeout
        period = self._states_period(end)
        if period > SLOWEST * self._period:
            raise DriveError(
                Fault(
                    "states_slow",
                    f"{self._link.states} has {1.0 / period:.0f} Hz, the run needs {1.0 / self._period:.0f} Hz or more",
                )
            )
        with self._received:
            self._grid = StateGrid(self._period, period)
        self._find_controller(end)
        self._find_watchdog(end)

    def publish(self, torques: Sequence[float], at_once: bool) -> None:
        """Publish torques (Nm, at the shafts) of both motors, at once or for the next sample.

        Where the controller is updated several times in a sampling period, a torque is kept until the last update
        before the next sample, so that it acts from that sample on, as the estimator assumes.
        """
        values = [0.0, 0.0]
        for motor, torque in zip(self._file.pair, torques, strict=True):
            values[motor.id] = torque
        command = Float64MultiArray(data=values)
        with self._received:
            waits = not (at_once or self._grid is None or self._file.paced_by_commands or self._grid.is_last)
            self._kept = command if waits else None
            if not waits:
                self._commands.publish(command)

    def take(self, timeout: float) -> GridSample | None:
        """Return the newest sample that nobody has taken, and wait for one for a time (s)."""
        with self._received:
            self._received.wait_for(lambda: self._sample is not None, timeout)
            sample, self._sample = self._sample, None
        return sample

    def close(self) -> None:
        """Wait for a limited time until the last command has arrived, and leave the graph."""
        self._commands.wait_for_all_acked(Duration(seconds=DELIVERY_TIME))
        self._ending.set()
        self._thread.join()
        self._executor.shutdown()
        self._node.destroy_node()

    def _spin(self) -> None:
        with contextlib.suppress(ExternalShutdownException):
            while not self._ending.is_set():
                self._executor.spin_once(timeout_sec=SPIN_PERIOD)

    def _on_states(self, data: bytes) -> None:
        now = time.monotonic()
        try:
            message = self._reader(data)
            part = part_of(message, self._names)
            if part is None:
                # of other joints, which others may publish on the same topic
                self._others = ", ".join(message.name)
                return
            stamp, states = self._read(part)
        except MessageError as error:
            self._invalid += 1
            self._reason = str(error)
            return
        self._arrived, self._reason = now, ""
        with self._received:
            if self._grid is None:
                self._stamps.append(stamp)
                self._received.notify_all()
                return
            self._note_delay(now - stamp / NANOSECONDS)
            sample = self._grid.take(stamp, states)
            if self._kept is not None and (sample is not None or self._grid.is_last):
                self._commands.publish(self._kept)
                self._kept = None
            if sample is None:
                return
            if self._sample is not None:
                self._untaken += 1
                sample = sample._replace(periods=sample.periods + self._sample.periods)
            self._sample = sample
            self._received.notify_all()
        if self._bell is not None:
            self._bell.ring()

    def _read(self, part: JointSample) -> tuple[int, JointStates]:
        """Return stamp and states of both motors.

        Raises:
            MessageError: a joint is missing, or its angle is not finite.
        """
        missing = [name for name in self._names if name not in part.name]
        if missing:
            raise MessageError(f"no joint {' and '.join(missing)}: {', '.join(part.name)}")
        (positions,) = read_fields(part, self._names, ("position",))
        velocities, efforts = (_where_finite(part, self._names, field) for field in ("velocity", "effort"))
        return part.stamp_ns, JointStates((positions[0], positions[1]), velocities, efforts)

    def _note_delay(self, delay: float) -> None:
        """Count a state as late that has come later after its stamp than others."""
        if self._file.paced_by_commands:
            return
        self._quickest = min(self._quickest + DRIFT * self._period, delay)
        self._late += delay - self._quickest > LATE_PART * self._period

    def _states_period(self, end: float) -> float:
        """Wait for states and return the time (s) between two.

        Raises:
            DriveError: there are none in time.
        """
        with self._received:
            self._received.wait_for(lambda: len(self._stamps) == MEASURED, max(0.0, end - time.monotonic()))
            stamps = list(self._stamps)
        between = [later - sooner for sooner, later in itertools.pairwise(stamps) if later > sooner]
        if len(between) < FEWEST - 1:
            grown = f"{len(set(stamps))} states with a stamp of their own have come"
            reason = self._reason or grown + (f", and some of other joints: {self._others}" if self._others else "")
            raise DriveError(Fault("states_missing", f"{self._link.states}: {reason}"))
        return median(between) / NANOSECONDS

    def _find_controller(self, end: float) -> None:
        """Find the controller as it is described.

        Raises:
            DriveError: it is missing, differs, or is not active.
        """
        self._wait_until(self._has_controller, end)
        if not self._has_controller():
            raise DriveError(Fault("controller_missing", f"{self._link.commands} has no subscription of it"))
        parameters = self._ask(
            GetParameters,
            f"{self._link.controller}/get_parameters",
            GetParameters.Request(names=["joints", "interface_name"]),
        )
        if parameters is not None:
            # empty where the controller has none of these parameters
            joints, interface, *_ = (*map(parameter_value_to_python, parameters.values), None, None)
            if joints and tuple(joints) != self._link.joints:
                found, expected = (", ".join(names) for names in (joints, self._link.joints))
                raise DriveError(
                    Fault("controller_differs", f"{self._link.controller} has the joints {found}, expected {expected}")
                )
            if interface and interface != EFFORT:
                raise DriveError(
                    Fault("controller_differs", f"{self._link.controller} commands {interface}, expected {EFFORT}")
                )
        self._ask_manager()
        if self._controller is not None:
            raise DriveError(self._controller)

    def _ask_manager(self) -> None:
        """Ask the controller manager for the state of the controller, where its messages are installed."""
        if ListControllers is None:
            return
        answer = self._ask(ListControllers, f"{self._link.manager}/list_controllers", ListControllers.Request())
        for one in () if answer is None else answer.controller:
            if one.name == self._short_name:
                self._take_state(one.state)

    def _find_watchdog(self, end: float) -> None:
        """Find the watchdog.

        Raises:
            DriveError: it is missing.
        """
        self._wait_until(self._has_watchdog, end)
        if not self._has_watchdog():
            raise DriveError(Fault("watchdog_missing", f"{self._watchdog}: it does not publish {self._link.commands}"))
        self._reported = time.monotonic()

    def _wait_until(self, condition: Callable[[], bool], end: float) -> None:
        while not condition() and time.monotonic() < end:
            self._ending.wait(LOOK_PERIOD)

    def _ask(self, kind: Any, name: str, request: Any) -> Any:
        """Return the answer of a service, None where it does not answer."""
        client = self._node.create_client(kind, name)
        try:
            if not client.wait_for_service(SERVICE_TIME):
                return None
            answered = threading.Event()
            future = client.call_async(request)
            future.add_done_callback(lambda _: answered.set())
            return future.result() if answered.wait(SERVICE_TIME) else None
        finally:
            self._node.destroy_client(client)

    @functools.cached_property
    def _short_name(self) -> str:
        return self._link.controller.rpartition("/")[2]

    def _has_controller(self) -> bool:
        listeners = self._node.get_subscriptions_info_by_topic(self._link.commands)
        return any(_full_name(one) == self._link.controller for one in listeners)

    def _has_watchdog(self) -> bool:
        return any(one.node == self._watchdog for one in self._publishers())

    def _publishers(self) -> list[PublisherOf]:
        found = self._node.get_publishers_info_by_topic(self._link.commands)
        return [PublisherOf(_full_name(one), bytes(one.endpoint_gid)) for one in found]

    def _look(self) -> None:
        """Look who publishes the commands, and whether the controller listens."""
        publishers = self._publishers()
        own = next((one for one in publishers if self._is_own(one)), None)
        machine = b"" if own is None else own.machine
        others = [
            one
            for one in publishers
            if one.node != self._watchdog and not self._is_own(one) and not self._living.is_gone(one, machine)
        ]
        self._commander = None
        if others and own is not None:
            self._commander = Fault.from_text(second_publisher(self._link.commands, [own, *others], machine))
        if self._states_known.get(self._short_name, ACTIVE) != ACTIVE:
            return
        found = self._has_controller()
        self._controller = None if found else Fault("controller_lost", f"{self._link.controller} no longer listens")

    def _is_own(self, one: PublisherOf) -> bool:
        return one.node == self._node.get_fully_qualified_name() and one.process == os.getpid() % HALF

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if self._reported is not None and node_of_status(status.name) == self._watchdog:
                self._reported = time.monotonic()
            elif status.name.endswith(ACTIVITY):
                for value in status.values:
                    if value.key == f"{self._short_name}.state":
                        self._take_state(value.value)

    def _take_state(self, state: str) -> None:
        """Take the state of the controller, as the controller manager has it."""
        self._states_known[self._short_name] = state
        if state != ACTIVE:
            self._controller = Fault("controller_lost", f"{self._link.controller} is {state}")


def _full_name(one: TopicEndpointInfo) -> str:
    return f"{one.node_namespace.rstrip('/')}/{one.node_name}"


def _where_finite(message: JointSample, names: tuple[str, ...], field: str) -> tuple[float, float]:
    """Return a field of both joints, with NaN where it has no finite value."""
    given = getattr(message, field)
    if len(given) != len(message.name):
        return math.nan, math.nan
    first, second = (given[message.name.index(name)] for name in names)
    return first if math.isfinite(first) else math.nan, second if math.isfinite(second) else math.nan
