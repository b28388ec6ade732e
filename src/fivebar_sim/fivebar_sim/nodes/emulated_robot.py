# SPDX-License-Identifier: Apache-2.0
"""The emulated drives and the robot that they move, with the topics that a rehearsal needs.

They talk to the bridge over their bus or port alone. This node besides publishes the exact state for judging, the
progress of the run, and injects faults at given moments.
"""

from __future__ import annotations

import queue
import threading
import time

from std_msgs.msg import String

from fivebar_description.interface import (
    ACTIVE_JOINTS,
    FAULTS,
    GROUND_TRUTH,
    JOINTS,
    MOTOR_STATES,
    RUN_READY,
    TORQUE_COMMAND,
)
from fivebar_description.joint_sample import JointSample
from fivebar_description.robot_file import load_robot
from fivebar_description.ros.file_parameters import FileParameters
from fivebar_description.ros.messages import qos_profile
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.run import run_node
from fivebar_description.ros.run_agreement import RunAgreement
from fivebar_description.strict_yaml import InputError
from fivebar_sim.emulated_hardware import Emulator, MeasuredRecord
from fivebar_sim.emulators.hardware_kinds import open_hardware, timed_order
from fivebar_sim.ros.late_sensors import LateSensors
from fivebar_sim.ros.node_settings import EmulatedRobotSettings
from fivebar_sim.ros.run_progress import RunProgress
from fivebar_sim.scalar_sensors import scalar_sensors
from fivebar_sim.scenario import SimulatedRobot
from fivebar_sim.sensors import Gyroscope

STATUS_PERIOD = 0.1
LATE_PERIODS = 1.5
"""Where time waits for the torque, a sample is late that comes more than so many periods after the one before."""

GRACE = 2.0
"""Time (s) after the planned end at which a run is over even if its last sample is missing."""

FITTING_COUNTS = 1.5
"""Tolerance (counts) between an encoder reading and the angle that the bridge publishes."""


class EmulatedRobot(GraphNode):
    """The emulated drives of a file, on their bus or port."""

    def __init__(self) -> None:
        """Boot the drives and serve them in a thread."""
        super().__init__("emulated_robot")
        settings = self.declare_settings(EmulatedRobotSettings)
        file = FileParameters(self, SimulatedRobot, ("rate_hz", "imu", "sensors", "plant.seed", "plant.gyroscope")).file
        self._rate_hz = file.rate_hz
        self._run = RunAgreement(self, self._rate_hz, {})
        self._samples = settings.samples
        self._ready_timeout = settings.ready_timeout_s
        self._emulation, emulator = open_hardware(settings.emulation)
        self._injections = sorted(_injection(text, emulator) for text in settings.inject)
        self._tolerance = FITTING_COUNTS * self._emulation.resolution
        self._ahead = 0
        self._orders: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._payloads: queue.SimpleQueue[float] = queue.SimpleQueue()
        self._replies: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._ending = threading.Event()
        self._faulty = False
        self._state = "running"
        self._made = self._heard = time.monotonic()
        self._began: float | None = None
        self._truth = self.advertise(GROUND_TRUTH)
        self._imu, self._seed, self._gyro_faults = file.imu, file.plant.seed, file.plant.gyroscope
        robot = load_robot(file.robot)
        self._late = LateSensors(
            self,
            self._run,
            self._rate_hz,
            self._imu,
            self._seed,
            self._gyro_faults,
            lambda: scalar_sensors(file.passive, file.extra(), robot, self._rate_hz, self._seed),
        )
        self._begin_run()
        self._faults = self.advertise(FAULTS)
        self._progress = RunProgress(self, settings.samples, settings.wait_for_nodes)
        self.listen(MOTOR_STATES, self._on_states)
        self.listen(TORQUE_COMMAND, self._on_command)
        self.listen_to_payload(self._payloads.put)
        self.create_subscription(String, FAULTS.name, self._on_fault, qos_profile(FAULTS.qos))
        self.create_subscription(String, RUN_READY.name, self._progress.on_ready, qos_profile(RUN_READY.qos))
        self.every(STATUS_PERIOD, self._check_clock)
        self._thread = threading.Thread(
            target=self._emulation.run, args=(self._ending, self._execute_orders), daemon=True
        )
        self._thread.start()

    def _begin_run(self) -> None:
        """Count samples and make the late sensors' readings from sample 0 on."""
        self._sample, self._commanded, self._last_reading = 0, -1, -1
        self._gyroscope = Gyroscope(self._imu, self._rate_hz, self._seed, self._gyro_faults)
        self._late.restart()

    def stop(self) -> None:
        """Leave the bus or the port."""
        self._ending.set()
        self._thread.join()
        self._emulation.close()

    def _execute_orders(self) -> None:
        # in the thread of the drives, which must not spend time on logging
        while not self._payloads.empty():
            self._emulation.carry(self._payloads.get())
        while not self._orders.empty():
            self._replies.put(self._emulation.obey(self._orders.get()))

    def _on_fault(self, message: String) -> None:
        self._faulty = True

    def _on_states(self, message: JointSample) -> None:
        """Publish the exact state of the SYNC that a sample was measured at, and count what was late."""
        if not self._run.holds:
            return
        now = time.monotonic()
        read = self._run.read(MOTOR_STATES, message, ACTIVE_JOINTS, ("position",))
        if read is None:
            return
        sample, ((q11, q21),) = read
        if sample == 0 and self._sample > 0:
            # the bridge was activated again
            self._begin_run()
        if sample > self._sample:
            self._began = self._began if self._began is not None else now
            late = max(0, sample - 1 - max(self._commanded, self._sample - 1))
            if self._emulation.waits and self._sample > 0:
                # such a robot stands still until the torque comes
                late = max(late, int(now - self._heard > LATE_PERIODS / self._rate_hz))
            self._progress.overruns += late
            self._sample, self._heard = sample, now
        if sample <= self._samples or not self._samples:
            self._publish_truth(sample, q11, q21)
        while self._injections and sample >= self._injections[0][0] * self._rate_hz:
            self._orders.put(self._injections.pop(0)[1])
        if 0 < self._samples <= sample and self._state == "running":
            self._end(self._faulty)

    def _publish_truth(self, sample: int, q11: float, q21: float) -> None:
        record = self._sync_of(sample, q11, q21)
        if record is None:
            return
        stamp = self._run.stamp(sample)
        position, velocity, effort = record.truth
        self._truth.publish(JointSample(stamp, JOINTS, position, velocity, effort))
        if sample > self._last_reading:
            since, self._last_reading = sample - self._last_reading, sample
            rate = self._gyroscope.read(position[2] + position[3], velocity[2] + velocity[3], since)
            # it has no accelerometer
            message = self._late.imu_message(sample, self._imu.gyro_axes(rate))
            self._late.publish(self._late.arrived(sample, message, position))
        self.note_answer()

    def _sync_of(self, sample: int, q11: float, q21: float) -> MeasuredRecord | None:
        """Return the SYNC that a sample was measured at.

        A SYNC has no number on the bus, but samples are numbered in step with it; where the readings contradict that
        (SYNCs without samples while the drives were being enabled), the newest SYNC with these readings is taken.
        """

        def fits(record: MeasuredRecord) -> bool:
            return max(abs(record.angles[0] - q11), abs(record.angles[1] - q21)) < self._tolerance

        records = list(self._emulation.history)
        counted = next((record for record in records if record.number == sample + self._ahead), None)
        if counted is not None and sample > 1 and fits(counted):
            return counted
        latest = next((record for record in reversed(records) if fits(record)), None)
        if latest is not None:
            self._ahead = latest.number - sample
        return latest

    def _on_command(self, message: JointSample) -> None:
        sample = self._run.sample(message.stamp_ns)
        # that of the next sample, where a bridge in the controllers' process publishes the torque before the states
        if sample is not None and self._commanded < sample <= self._sample + 1:
            self._commanded = sample

    def _check_clock(self) -> None:
        """Publish the progress of the run; end it if it does not start or the bridge has stopped publishing."""
        now = time.monotonic()
        while not self._replies.empty():
            self.get_logger().info(self._replies.get())
        if self._began is None and self._progress.missing:
            self._progress.tell(self._progress.missing)
        if self._samples and self._state == "running":
            if self._began is None and self._faulty:
                # drives that could not be enabled, say
                self._end(failed=True)
                return
            if self._began is None and now - self._made > self._ready_timeout:
                missing = self._progress.missing or "the bridge"
                fault = f"nodes_missing: no sample within {self._ready_timeout:g} s, not ready: {missing}"
                self._faults.publish(String(data=fault))
                self._end(failed=True)
                return
            if self._began is not None and now > self._began + self._samples / self._rate_hz + GRACE:
                self._end(failed=True)
                return
        self._publish_status()

    def _end(self, failed: bool) -> None:
        """Announce the end of the run; the drives keep running, so that the bridge can switch them off in order."""
        self._state = "failed" if failed else "completed"
        self._publish_status()

    def _publish_status(self) -> None:
        self._progress.publish(self._state, self._sample)


def _injection(text: str, emulator: Emulator) -> tuple[float, str]:
    """Return moment (s) and order of an injection.

    Raises:
        InputError: it is not a number and an order.
    """
    timed = timed_order(text)
    if timed is None or not emulator.understands(timed[1]):
        expected = f"expected seconds and an order: {emulator.usage}"
        raise InputError(f"emulated_robot: parameter inject: {text!r}: {expected}")
    return timed


def main() -> None:
    """Run the node."""
    run_node(EmulatedRobot)


if __name__ == "__main__":
    main()
