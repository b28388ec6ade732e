# SPDX-License-Identifier: Apache-2.0
"""A robot without power that is led by hand along a scenario's waypoints: the plant, its encoders and IMU, and a hand.

The hand pulls the platform towards the planned place with a spring and a damper. It moves the motors against their
friction, through the transmissions, and the platform through the Type 2 locus, where the motors have no say.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

from fivebar_bringup.bag import serialize
from fivebar_bringup.bag.writer import BagWriter
from fivebar_bringup.scenario import Scenario
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.model.state import Platform, State
from fivebar_control.scenario.start import initial_joints
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    GROUND_TRUTH,
    IMU_DATA,
    IMU_FRAME,
    JOINTS,
    MOTOR_STATES,
    sample_stamp_ns,
)
from fivebar_description.parameters import FiveBar
from fivebar_description.strict_yaml import InputError
from fivebar_sim.effects.gyroscope import ImuClock
from fivebar_sim.effects.loads import tilt_angle
from fivebar_sim.engines import motion_of
from fivebar_sim.sensors import Encoder, Imu, ImuReading, ReadingQueue, imu_queue

STIFFNESS, DAMPING = 3700.0, 110.0
"""Stiffness and damping of the hand, for each kg of the platform: N/m and N s/m. It follows the waypoints at some
10 Hz on any robot."""


class GuidedSample(NamedTuple):
    """One sample.

    Attributes:
        motors: what both motors' encoders read (rad).
        imu: readings that arrived with it, each with the sample at which it was made.
        position, velocity: the exact joints (rad, rad/s).
        force: of the hand (N).
    """

    motors: tuple[float, float]
    imu: list[tuple[int, ImuReading]]
    position: tuple[float, ...]
    velocity: tuple[float, ...]
    force: float


def pulled(robot: FiveBar, state: State, wanted: Platform) -> tuple[float, float]:
    """Return the force (N) of a hand that leads the platform of a robot to where it is wanted."""
    stiffness, damping = STIFFNESS * robot.mass, DAMPING * robot.mass
    return (
        stiffness * (wanted.x - state.x) + damping * (wanted.vx - state.vx),
        stiffness * (wanted.y - state.y) + damping * (wanted.vy - state.vy),
    )


def guide(scenario: Scenario) -> list[GuidedSample]:
    """Lead the robot of a scenario along its waypoints, at its pace, without power.

    Raises:
        InputError: the robot moves faster than it can be simulated.
    """
    plan, rate_hz, actual = scenario.plan(), scenario.rate_hz, scenario.actual_robot()
    motion = motion_of(scenario.five_bar(), scenario.plant, rate_hz, initial_joints(scenario))
    seed, faults = scenario.plant.seed, scenario.plant.gyroscope
    imu = Imu(scenario.imu, rate_hz, seed, tilt_angle(actual, scenario.plant.tilt), faults)
    queue: ReadingQueue[ImuReading] = imu_queue(scenario.imu, faults, rate_hz, seed)
    counts = scenario.plant.encoder_counts
    encoders = None if counts is None else [Encoder(counts, 1.0 / rate_hz) for _ in ACTIVE_JOINTS]
    samples = []
    for number in range(plan.path.samples(rate_hz) + 1):
        angles = motion.seen[0][0], motion.seen[0][2]
        if encoders is not None:
            angles = encoders[0].read(angles[0])[0], encoders[1].read(angles[1])[0]
        tip = motion.imu_motion()
        q, v = (tuple(values.tolist()) for values in motion.joints)
        reading = imu.read((tip.along, tip.across), q[2] + q[3], tip.rate, tip.rate_change)
        arrived = queue.arrived(number, reading)
        state, wanted = state_from_joints(actual, *q, *v), plan.path.at(number / rate_hz)
        pull_x, pull_y = pulled(actual, state, wanted)
        samples.append(GuidedSample(angles, arrived, q, v, math.hypot(pull_x, pull_y)))
        motion.hold(pull_x, pull_y)
        if math.isinf(motion.advance((0.0, 0.0))):
            raise InputError(f"{scenario.name}: led by hand, the robot moves too fast after sample {number}")
    return samples


def write_guided_bag(samples: list[GuidedSample], scenario: Scenario, directory: Path) -> None:
    """Write what a recorder leaves of it: the motors' readings without torque, the IMU's, and the exact state."""
    clock = ImuClock(scenario.imu, scenario.plant.gyroscope, scenario.rate_hz, scenario.plant.seed)
    with BagWriter(directory, [MOTOR_STATES, IMU_DATA, GROUND_TRUTH]) as bag:
        for number, sample in enumerate(samples):
            stamp = sample_stamp_ns(number, scenario.rate_hz)
            message = serialize.joint_state(stamp, ACTIVE_JOINTS, sample.motors, effort=(0.0, 0.0))
            bag.write(MOTOR_STATES, stamp, message)
            exact = serialize.joint_state(stamp, JOINTS, sample.position, sample.velocity, (0.0,) * 4)
            bag.write(GROUND_TRUTH, stamp, exact)
            for moment, reading in sample.imu:
                message = serialize.imu(
                    clock.stamp_ns(moment), IMU_FRAME, reading.angular_velocity, reading.acceleration
                )
                bag.write(IMU_DATA, stamp, message)
        bag.close({})
