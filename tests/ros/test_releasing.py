# SPDX-License-Identifier: Apache-2.0
"""The service `blender/release`: a robot that a fault has stopped on the Type 2 locus gets off it by its motors."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from graph_probe import Bench, Probe
from sensor_msgs.msg import Imu
from std_msgs.msg import String
from std_srvs.srv import Trigger

from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import assembly_mode, state_from_joints
from fivebar_control.model.singularity import inverse_condition
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    DRIVES_STATE,
    FAULTS,
    IMU_DATA,
    JOINT_STATES,
    MOTOR_STATES,
    REFERENCE,
    RELEASE_STATUS,
    SAFETY_STATE,
    TORQUE_COMMAND,
    sample_stamp_ns,
)
from fivebar_description.ros.messages import joint_state, to_stamp
from fivebar_mujoco.mujoco_motion import MujocoMotion
from fivebar_sim.effects.settings import PlantSettings

RATE = 100
LOCUS_Y = math.sqrt(0.09**2 - 0.031**2)
SCENARIO = "gyro_middle"
ENCODERS = """
name: encoders
controller: unified
waypoints: [[0.0, 0.15], [0.0, 0.02]]
segment_duration: 1.0
plant: {encoder_counts: 200000}
estimator: ekf
force: true
"""
"""The same without a gyroscope."""


class Stopped:
    """A blender whose robot a fault has stopped, and that robot, in MuJoCo."""

    def __init__(self, bench: Bench, name: str = SCENARIO) -> None:
        scenario = load_scenario(name)
        self.robot = scenario.five_bar()
        self._imu, self._gyro = scenario.imu, scenario.gyro
        bench.start("blender", scenario=name, rate_hz=RATE)
        self.probe: Probe = bench.probe()
        torques = [law.topic for law in scenario.scheme().laws]
        self.probe.join(
            "blender", [JOINT_STATES, REFERENCE, *torques, FAULTS, DRIVES_STATE], [TORQUE_COMMAND, SAFETY_STATE]
        )
        self.probe.listen(RELEASE_STATUS)
        self.motion = MujocoMotion(
            self.robot, PlantSettings(), RATE, list(inverse_geometry(self.robot, (1, -1), 0.0, LOCUS_Y + 1e-4))
        )
        self.sample = 0

    def fault(self) -> None:
        self.probe.publish(FAULTS, String(data="estimate_ambiguous: turned back"))
        self.probe.wait_for(
            lambda: self.probe.got(SAFETY_STATE) and self.probe.got(SAFETY_STATE)[-1].data != "ok", "a latched fault"
        )

    def release(self) -> Trigger.Response:
        return self.probe.call(Trigger, "/blender/release", Trigger.Request())

    def status(self) -> str:
        return self.probe.got(RELEASE_STATUS)[-1].data if self.probe.got(RELEASE_STATUS) else ""

    def heard(self) -> None:
        self.probe.advertise(MOTOR_STATES, IMU_DATA)
        for topic in (MOTOR_STATES, IMU_DATA):
            self.probe.wait_for(lambda topic=topic: self.probe.listeners(topic) > 0, f"a listener of {topic.name}")

    @property
    def over(self) -> bool:
        """Whether the release has come to an end."""
        return self.status().startswith(("released", "ended", "refused"))

    def measure(self) -> tuple[float, float]:
        """Publish the readings of the next sample, and return the torque that answers it, 0 once it is over."""
        self.sample += 1
        stamp = sample_stamp_ns(self.sample, RATE)
        (q11, _, q21, _), (_, _, dq21, dq22) = (values.tolist() for values in self.motion.joints)
        reading = Imu()
        reading.header.stamp = to_stamp(stamp)
        axis = self._imu.rotation()[2]
        turning = reading.angular_velocity
        turning.x, turning.y, turning.z = (one * (dq21 + dq22) for one in axis)
        if self._gyro:
            self.probe.publish(IMU_DATA, reading)
        self.probe.publish(MOTOR_STATES, joint_state(stamp, ACTIVE_JOINTS, (q11, q21), (0.0, 0.0), (0.0, 0.0)))

        def answered() -> bool:
            commands = self.probe.got(TORQUE_COMMAND)
            return self.over or bool(commands and self.probe.sample(commands[-1], RATE) == self.sample)

        self.probe.wait_for(answered, f"an answer to sample {self.sample}")
        if self.over:
            return 0.0, 0.0
        tau1, tau2 = self.probe.got(TORQUE_COMMAND)[-1].effort
        return tau1, tau2


@pytest.mark.extra
def test_it_moves_a_stopped_robot_off_the_locus_and_says_where_it_is(bench: Bench) -> None:
    stopped = Stopped(bench)
    answer = stopped.release()
    assert not answer.success
    assert answer.message == "not released: no fault is latched: expected a robot that one has stopped"
    stopped.fault()
    answer = stopped.release()
    assert answer.success, answer.message
    stopped.heard()
    assert stopped.release().message == "not released: a release is under way"
    largest = 0.0
    for _ in range(5 * RATE):
        torque = stopped.measure()
        largest = max(largest, *map(abs, torque))
        if stopped.over:
            break
        assert math.isfinite(stopped.motion.advance(torque))
    assert 0.4 < largest < 1.31
    position, velocity = stopped.motion.joints
    state = state_from_joints(stopped.robot, *position.tolist(), *velocity.tolist())
    mode = "+" if assembly_mode(state) > 0 else "-"
    assert stopped.status().startswith(f"released: in assembly mode {mode}, the platform at (")
    assert inverse_condition(state) > 0.15
    # the fault stays latched, and the robot without torque
    assert stopped.probe.got(SAFETY_STATE)[-1].data.startswith("estimate_ambiguous")
    assert tuple(stopped.probe.got(TORQUE_COMMAND)[-1].effort) == (0.0, 0.0)


@pytest.mark.extra
def test_without_a_gyroscope_it_drives_the_platform_to_a_side_first(bench: Bench, tmp_path: Path) -> None:
    file = tmp_path / "encoders.yaml"
    file.write_text(ENCODERS, encoding="utf-8")
    stopped = Stopped(bench, str(file))
    stopped.fault()
    assert stopped.release().success
    stopped.heard()
    torques = []
    for _ in range(5 * RATE):
        torques.append(stopped.measure())
        if stopped.over:
            break
        assert math.isfinite(stopped.motion.advance(torques[-1]))
    # no torque while it is planned, which takes samples, then the rest, in which only friction is held
    assert torques[0] == (0.0, 0.0)
    assert max(max(map(abs, one)) for one in torques[:30]) < 0.2
    assert max(max(map(abs, one)) for one in torques) > 0.8
    position, velocity = stopped.motion.joints
    state = state_from_joints(stopped.robot, *position.tolist(), *velocity.tolist())
    assert stopped.status().startswith("released: in assembly mode +, the platform at (")
    assert assembly_mode(state) == 1
    assert inverse_condition(state) > 0.15


@pytest.mark.parametrize("by", ["emergency stop", "drives", "another fault"])
def test_whatever_goes_wrong_ends_it(bench: Bench, by: str) -> None:
    stopped = Stopped(bench)
    stopped.fault()
    assert stopped.release().success
    stopped.heard()
    assert stopped.measure() != (0.0, 0.0)
    if by == "emergency stop":
        stopped.probe.call(Trigger, "/blender/emergency_stop", Trigger.Request())
    elif by == "drives":
        stopped.probe.publish(DRIVES_STATE, String(data="drive_fault: q11 is hot"))
    else:
        stopped.probe.publish(FAULTS, String(data="command_stale: no torque"))
    stopped.probe.wait_for(lambda: stopped.status().startswith("ended: "), "the end of the release")
