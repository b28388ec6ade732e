# SPDX-License-Identifier: Apache-2.0
"""The simulated IMU against a frame that Pinocchio carries on the distal link, and its imperfections one by one."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

from fivebar_control.model.state import State
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.imu import ImuSettings
from fivebar_description.parameters import FiveBar
from fivebar_description.urdf import urdf_text
from fivebar_sim.effects.settings import PlantSettings
from fivebar_sim.plant import Plant
from fivebar_sim.sensors import Imu

Vector = NDArray[np.float64]
States = Callable[[int, int], list[State]]
Vectors = Callable[[State], tuple[Vector, Vector]]

TILTED = ImuSettings(gravity=9.81, mount_x=-0.02, mount_y=0.015, roll=0.3, pitch=-0.4, yaw=1.2)


def test_a_mounted_imu_reads_what_a_frame_fixed_there_experiences(
    robot: FiveBar, loop: ClosedLoop, regular_states: States, joint_vectors: Vectors
) -> None:
    model = pin.buildModelFromXML(urdf_text(robot, "robot"))
    rotation = pin.rpy.rpyToMatrix(TILTED.roll, TILTED.pitch, TILTED.yaw)
    place = pin.SE3(rotation, np.array([robot.leg2.distal + TILTED.mount_x, TILTED.mount_y, 0.0]))
    frame = model.addFrame(pin.Frame("mounted", 4, 0, place, pin.FrameType.OP_FRAME))
    data = model.createData()
    for state in regular_states(40, 100):
        q, v = joint_vectors(state)
        a = loop.acceleration(q, v, np.zeros(4))
        pin.forwardKinematics(model, data, q, v, a)
        local = pin.ReferenceFrame.LOCAL
        felt = pin.getFrameClassicalAcceleration(model, data, frame, local).linear + rotation.T @ (0.0, 0.0, 9.81)
        turning = pin.getFrameVelocity(model, data, frame, local).angular
        free = PlantSettings(friction_scale=0.0)
        reading = Plant(robot, q.tolist(), 500, free, TILTED, v.tolist()).measure_imu()
        scale = 1.0 + float(np.abs(felt).max())
        np.testing.assert_allclose(reading.acceleration, np.clip(felt, -TILTED.range, TILTED.range), atol=1e-9 * scale)
        np.testing.assert_allclose(reading.angular_velocity, turning, atol=1e-10 * (1.0 + np.abs(v).max()))


def test_the_low_pass_approaches_a_step_by_its_time_constant() -> None:
    """First order: after the time 1 / (2 pi f_c), 1 - 1/e of a step are through."""
    description = ImuSettings(bandwidth_hz=50.0 / (2.0 * math.pi))
    imu = Imu(description, 500, seed=0)
    imu.read((0.0, 0.0), 0.0, 0.0, 0.0)
    readings = [imu.read((1.0, 0.0), 0.0, 0.0, 0.0).acceleration[0] for _ in range(10)]
    assert readings[9] == pytest.approx(1.0 - math.exp(-1.0), abs=1e-12)
    assert readings == sorted(readings)


def test_the_first_reading_is_already_settled() -> None:
    imu = Imu(ImuSettings(bandwidth_hz=5.0), 500, seed=0)
    assert imu.read((2.0, -1.0), 0.0, 0.0, 0.0).acceleration == pytest.approx((2.0, -1.0, 9.80665), abs=1e-15)


def test_bias_and_range() -> None:
    imu = Imu(ImuSettings(bias=(0.1, -0.2, 0.3), range=20.0), 500, seed=0)
    assert imu.read((1.0, 2.0), 0.0, 0.0, 0.0).acceleration == pytest.approx((1.1, 1.8, 10.10665), abs=1e-14)
    assert imu.read((100.0, -100.0), 0.0, 0.0, 0.0).acceleration[:2] == (20.0, -20.0)


def test_noise_is_white_of_the_given_size_and_its_stream_that_of_the_seed() -> None:
    def readings(seed: int) -> Vector:
        imu = Imu(ImuSettings(noise=0.05), 500, seed)
        return np.array([imu.read((1.0, -2.0), 0.0, 0.0, 0.0).acceleration for _ in range(4000)])

    first = readings(3)
    np.testing.assert_array_equal(readings(3), first)
    assert np.abs(readings(4) - first).max() > 0.05
    np.testing.assert_allclose(first.mean(axis=0), (1.0, -2.0, 9.80665), atol=4.0 * 0.05 / math.sqrt(4000.0))
    np.testing.assert_allclose(first.std(axis=0), 0.05, rtol=0.05)
    neighbours = np.corrcoef(first[1:, 0], first[:-1, 0])[0, 1]
    assert abs(neighbours) < 0.06
