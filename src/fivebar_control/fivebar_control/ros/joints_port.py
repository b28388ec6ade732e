# SPDX-License-Identifier: Apache-2.0
"""The topics of a controller manager as the bridge sees them: joint states and commands.

A node in a thread of its own, beside the bridge's, as others have a thread that receives from a bus: states arrive also
while the bridge waits for them.
"""

from __future__ import annotations

import contextlib
import itertools
import math
import threading
import time
from collections import deque
from collections.abc import Sequence
from statistics import median

from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from fivebar_control.fault import Fault
from fivebar_control.hardware.configuration import MICROSECONDS
from fivebar_control.hardware.controlled_joints import JointsLink
from fivebar_control.hardware.drive_connection import Bell
from fivebar_control.hardware.fault import DriveError
from fivebar_control.hardware.motors_file import MotorsFile
from fivebar_control.hardware.state_grid import SLOWEST, GridSample, JointStates, StateGrid
from fivebar_control.ros.controller_watch import ControllerWatch
from fivebar_description.interface import JOINT_STATES, NANOSECONDS
from fivebar_description.joint_sample import JointSample, MessageError, part_of
from fivebar_description.ros.messages import SampleReader, best_effort
from fivebar_description.ros.run import NodeExecutor

NODE = "controlled_joints"

DEPTH = 16
"""States that are kept while the thread gets no processor time."""

SPIN_PERIOD = 0.1

MEASURED = 12
"""States by which their period is measured."""

FEWEST = 3
"""The same, where no more come in time."""

DELIVERY_TIME = 0.5
"""Longest time (s) for which the last command is waited to be acknowledged."""

LATE_PART = 0.5
"""Part of a period by which a state may come later after its stamp than the quickest of the last ones."""

DRIFT = 1e-4
"""How much faster than the states' clock that of this machine may be."""


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
        self._node = Node(NODE, cli_args=["--ros-args", "-r", f"__node:={NODE}"], enable_rosout=False)
        self._commands = self._node.create_publisher(Float64MultiArray, link.commands, 1)
        self._node.create_subscription(JointState, link.states, self._on_states, best_effort(DEPTH), raw=True)
        self._watch = ControllerWatch(self._node, link)
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
        return self._watch.fault

    def silence(self) -> Fault:
        """Return the fault that states which no longer arrive are, after another look at the controller."""
        self._watch.look()
        if self._watch.fault is not None:
            return self._watch.fault
        age = f"last state {(time.monotonic() - self._arrived) * 1e3:.0f} ms ago"
        if self._reason:
            return Fault("states_invalid", f"{self._link.states}: {self._reason}; {age}")
        return Fault("states_stale", f"{self._link.states}: {age}")

    def begin(self, timeout: float) -> None:
        """Find states that are frequent enough, the controller as it is described, and the watchdog.

        Raises:
            DriveError: something is missing, or differs, in `timeout` (s).
        """
        shared = [joint for joint in self._link.joints if joint in JOINT_STATES.of_joints]
        if shared and self._node.resolve_topic_name(JOINT_STATES.name) == self._link.states:
            text = f"{self._link.states} is also where this graph publishes {' and '.join(shared)}"
            raise DriveError(Fault("states_shared", text))
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
        self._watch.find(end)

    def publish(self, values: Sequence[float], at_once: bool) -> None:
        """Publish a command of the controller, at once or for the next sample.

        Where the controller is updated several times in a sampling period, a torque is kept until the last update
        before the next sample, so that it acts from that sample on, as the estimator assumes.
        """
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
        (positions,) = part.read(self._names, ("position",))
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


def _where_finite(message: JointSample, names: tuple[str, ...], field: str) -> tuple[float, float]:
    """Return a field of both joints, with NaN where it has no finite value."""
    values = getattr(message, field)
    if len(values) != len(message.name):
        return math.nan, math.nan
    first, second = (values[message.name.index(name)] for name in names)
    return first if math.isfinite(first) else math.nan, second if math.isfinite(second) else math.nan
