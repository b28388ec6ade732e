# SPDX-License-Identifier: Apache-2.0
"""The acceleration check of section 4.3: what the IMU adds is taken off, and what the robot does wrong is left."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

from fivebar_control.estimation.imu_check import SATURATION, ImuCheck, noise_floor
from fivebar_control.model.kinematics import distal_acceleration, state_from_platform
from fivebar_control.model.state import Platform, State
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.imu import ImuSettings
from fivebar_description.parameters import FiveBar
from fivebar_description.urdf import urdf_text

Vector = NDArray[np.float64]
States = Callable[[int, int], list[State]]
Vectors = Callable[[State], tuple[Vector, Vector]]

MOUNTED = ImuSettings(bias=(0.1, -0.3, 0.2), mount_x=-0.02, mount_y=0.015, roll=0.3, pitch=-0.4, yaw=1.2, range=1000.0)


def modes(state: State) -> tuple[int, int]:
    return (-1 if state.leg1.sin_q2 > 0.0 else 1), (-1 if state.leg2.sin_q2 > 0.0 else 1)


@pytest.mark.parametrize("where", ["regular", "locus"])
def test_a_perfect_motion_leaves_no_error_however_the_imu_is_mounted(
    where: str, robot: FiveBar, loop: ClosedLoop, regular_states: States, locus_states: States, joint_vectors: Vectors
) -> None:
    """The reading is what Pinocchio's frame at the mounting point experiences in the desired motion."""
    model = pin.buildModelFromXML(urdf_text(robot, "robot"))
    rotation = pin.rpy.rpyToMatrix(MOUNTED.roll, MOUNTED.pitch, MOUNTED.yaw)
    place = pin.SE3(rotation, np.array([robot.leg2.distal + MOUNTED.mount_x, MOUNTED.mount_y, 0.0]))
    frame = model.addFrame(pin.Frame("mounted", 4, 0, place, pin.FrameType.OP_FRAME))
    data = model.createData()
    for state in (regular_states if where == "regular" else locus_states)(40, 110):
        q, v = joint_vectors(state)
        a = loop.acceleration(q, v, np.array([0.4, 0.0, -0.3, 0.0]))
        ax, ay = loop.platform(q, v, a)[2].tolist()
        pin.forwardKinematics(model, data, q, v, a)
        felt = pin.getFrameClassicalAcceleration(model, data, frame, pin.ReferenceFrame.LOCAL).linear
        x, y, z = (felt + rotation.T @ (0.0, 0.0, MOUNTED.gravity) + MOUNTED.bias).tolist()
        check = ImuCheck(robot, modes(state), 500, MOUNTED)
        desired = Platform(state.x, state.y, state.vx, state.vy, ax, ay)
        assert abs(check.error((x, y, z), desired)) < 1e-9 * (1.0 + float(np.abs(felt).max()))


def test_error_is_measured_minus_desired_magnitude(dextar: FiveBar) -> None:
    check = ImuCheck(dextar, (1, -1), 500, ImuSettings())
    assert check.error((3.0, 4.0, 9.80665), Platform(0.0, 0.13, 0.0, 0.0, 0.0, 2.0)) == pytest.approx(3.0, abs=1e-14)
    assert check.error((0.0, 0.0, 9.80665), Platform(0.0, 0.13, 0.0, 0.0, 5.0, -12.0)) == pytest.approx(
        -13.0, abs=1e-14
    )


def test_the_desired_side_goes_through_the_same_low_pass(dextar: FiveBar) -> None:
    """A sensor that is late by its own filter makes no error; after one time constant 1 - 1/e of a step are in."""
    check = ImuCheck(dextar, (1, -1), 500, ImuSettings(bandwidth_hz=50.0 / (2.0 * math.pi)))
    check.error((0.0, 0.0, 9.80665), Platform(0.0, 0.13, 0.0, 0.0, 0.0, 0.0))
    errors = [check.error((0.0, 0.0, 9.80665), Platform(0.0, 0.13, 0.0, 0.0, 0.0, 1.0)) for _ in range(10)]
    assert errors[9] == pytest.approx(math.exp(-1.0) - 1.0, abs=1e-12)


def test_saturation_is_noticed_on_any_axis(dextar: FiveBar) -> None:
    check = ImuCheck(dextar, (1, -1), 500, ImuSettings(range=20.0))
    assert check.saturated((20.0, 0.0, 9.8))
    assert check.saturated((0.0, -20.0, 9.8))
    assert check.saturated((0.0, 0.0, SATURATION * 20.0))
    assert not check.saturated((19.9, -19.9, 9.8))


def test_the_lever_goes_through_the_low_pass_too(dextar: FiveBar) -> None:
    """A platform that moves at once: the mounting point's acceleration is felt as late as any other."""
    imu = ImuSettings(bandwidth_hz=50.0, mount_x=-0.02, mount_y=0.015)
    check, moving = ImuCheck(dextar, (1, -1), 500, imu), Platform(0.0, 0.13, 0.3, -0.4, 0.0, 0.0)
    leg = state_from_platform(dextar, (1, -1), *moving[:4]).leg2
    x, y = imu.lever(leg.dtheta, distal_acceleration(dextar.leg2, leg, 0.0, 0.0))
    assert min(abs(x), abs(y)) > 0.01
    share = imu.smoothing(0.002)
    check.error((0.0, 0.0, 9.80665), moving._replace(vx=0.0, vy=0.0))
    assert check.error((share * x, share * y, 9.80665), moving) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("desired", [0.0, 0.1, 1.0, 30.0])
def test_the_noise_floor_is_what_noise_alone_leaves(desired: float) -> None:
    random = np.random.default_rng(111)
    noisy = random.normal((desired, 0.0), 0.2, (400_000, 2))
    errors = np.hypot(noisy[:, 0], noisy[:, 1]) - desired
    assert noise_floor(0.2, desired) == pytest.approx(float(np.sqrt(np.mean(errors**2))), rel=0.01)


def test_the_noise_floor_at_its_ends() -> None:
    assert noise_floor(0.0, 1.0) == 0.0
    assert noise_floor(0.2, 0.0) == pytest.approx(0.2 * math.sqrt(2.0), rel=1e-12)
    assert noise_floor(0.2, 100.0) == pytest.approx(0.2, rel=1e-3)
