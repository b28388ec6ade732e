# SPDX-License-Identifier: Apache-2.0
"""The brake: it only takes energy, stays within its limits, and is over once the robot is at rest."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_control.laws.torque import ZERO
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import state_from_joints, state_from_platform
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.model.state import JointAngles, State
from fivebar_control.safety.brake import (
    BRAKED_FAULTS,
    Brake,
    brake_of,
    braking_after,
    is_at_rest,
    joint_speed,
    stopping,
)
from fivebar_control.safety.settings import SafetySettings
from fivebar_control.safety.stages import (
    NEAR_TYPE_1,
    NO_FAULT,
    OVER_SPEED,
    TORQUE_EXCESSIVE,
    TORQUE_UNDEFINED,
    TRACKING_LOST,
    fault_of,
    guard_limits_of,
)
from fivebar_description.imu import ImuSettings
from fivebar_description.robot_file import load_robot
from fivebar_sim.effects.settings import PlantSettings
from fivebar_sim.plant import Plant

ROBOT = load_robot()
RATE_HZ = 500
LIMIT = 2.0
BRAKE = brake_of(SafetySettings(torque_limit=LIMIT), ROBOT, RATE_HZ)

INTEGRATION = 1e-8
"""Share of the energy by which the plant's integration may be off in a sample."""

AWAY = (0.02, 0.13)


def moving(vx: float, vy: float, x: float = AWAY[0], y: float = AWAY[1]) -> State:
    return state_from_platform(ROBOT, (1, -1), x, y, vx, vy)


@given(st.floats(-0.04, 0.04), st.floats(0.03, 0.14), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_the_torque_opposes_both_motors_within_the_limit(x: float, y: float, vx: float, vy: float) -> None:
    state = moving(vx, vy, x, y)
    torque, left = stopping(BRAKE, ROBOT, state, 100)
    for tau, leg in zip(torque, (state.leg1, state.leg2), strict=True):
        assert tau * leg.dq1 <= 0.0
        assert abs(tau) <= LIMIT
    if is_at_rest(state, BRAKE.rest_speed):
        assert (torque, left) == (ZERO, 0)
    else:
        assert left == 99
        assert (torque == ZERO) == (inverse_condition(state) < BRAKE.kappa)


def test_a_slow_motor_is_braked_with_the_time_constant_and_a_fast_one_with_the_limit() -> None:
    """-zz dq / t for a motor alone; never less than ten samples."""
    state = moving(0.05, -0.05)
    torque = stopping(BRAKE, ROBOT, state, 1).torque
    wanted = [-leg.inertia / 0.02 * one.dq1 for leg, one in zip(ROBOT[:2], state[:2], strict=True)]
    assert torque == pytest.approx(wanted, rel=1e-12)
    fast = moving(2.0, 2.0)
    assert {abs(tau) for tau in stopping(BRAKE, ROBOT, fast, 1).torque} == {LIMIT}
    # at least ten samples
    slow = brake_of(SafetySettings(), ROBOT, 100)
    assert slow.damping1 == pytest.approx(ROBOT.leg1.inertia / 0.1)
    assert slow.torque_limit == math.inf


def test_which_faults_brake_and_for_how_long() -> None:
    assert braking_after(BRAKE, TRACKING_LOST) == braking_after(BRAKE, NEAR_TYPE_1) == RATE_HZ
    assert braking_after(BRAKE, NO_FAULT) == braking_after(BRAKE, OVER_SPEED) == 0
    limits = guard_limits_of(SafetySettings(), RATE_HZ)
    for number in (*range(TORQUE_UNDEFINED, TRACKING_LOST + 1), TORQUE_EXCESSIVE):
        fault = fault_of(number, limits, ROBOT, (1, -1), moving(1.0, 1.0), *AWAY, ZERO, 0.0)
        assert (fault.name in BRAKED_FAULTS) == (braking_after(BRAKE, number) > 0)
    assert braking_after(brake_of(SafetySettings(brake=False), ROBOT, RATE_HZ), TRACKING_LOST) == 0
    assert brake_of(SafetySettings(brake_duration=0.2), ROBOT, RATE_HZ).samples == 100


def unsound() -> list[State]:
    joints, fast = inverse_geometry(ROBOT, (1, -1), *AWAY), (3.0, 1.0, 2.0, -1.0)
    return [
        state_from_joints(ROBOT, *joints, math.nan, 1.0, 2.0, 3.0),
        state_from_joints(ROBOT, *joints, 3.0, 1.0, math.inf, 3.0),
        state_from_joints(ROBOT, math.nan, *joints[1:], *fast),
        # both legs stretched away from each other: the mean of their tips is where no leg reaches
        state_from_joints(ROBOT, 0.5 * math.pi, 0.0, 0.5 * math.pi, 0.0, *fast),
    ]


@pytest.mark.parametrize("state", unsound())
def test_there_is_no_torque_for_good_where_the_state_is_not_sound(state: State) -> None:
    assert stopping(BRAKE, ROBOT, state, 100) == (ZERO, 0)


def test_there_is_no_torque_without_samples_left_and_none_after_the_last() -> None:
    state = moving(0.5, 0.0)
    assert stopping(BRAKE, ROBOT, state, 0) == (ZERO, 0)
    last = stopping(BRAKE, ROBOT, state, 1)
    assert last.torque != ZERO
    assert last.left == 0


def test_a_platform_that_moves_while_the_motors_rest_is_not_at_rest() -> None:
    """As it passes the centre of the locus; there is no torque, but the brake is not over."""
    centre = moving(0.0, -0.3, 0.0, math.sqrt(0.0081 - 0.000961))
    assert max(abs(centre.leg1.dq1), abs(centre.leg2.dq1)) < 1e-12
    assert not is_at_rest(centre, BRAKE.rest_speed)
    assert stopping(BRAKE, ROBOT, centre, 100) == (ZERO, 99)
    assert joint_speed(centre) > 1.0


def energy(robot_state: State) -> float:
    """Kinetic energy (J)."""
    leg1, leg2 = robot_state.leg1, robot_state.leg2
    motors = ROBOT.leg1.inertia * leg1.dq1**2 + ROBOT.leg2.inertia * leg2.dq1**2
    return 0.5 * (motors + ROBOT.mass * (robot_state.vx**2 + robot_state.vy**2))


class Run:
    """The robot with its platform moving, which a pull of the motors has made, and then the brake or nothing."""

    def __init__(self, pull: tuple[float, float], samples: int, brake: Brake, friction: float = 1.0) -> None:
        start = inverse_geometry(ROBOT, (1, -1), *AWAY)
        settings = PlantSettings(torque_limit=LIMIT, friction_scale=friction)
        self.plant = Plant(ROBOT, JointAngles(*start), RATE_HZ, settings, ImuSettings())
        for _ in range(samples):
            self.plant.advance(pull)
        self.states = [self.state()]
        self.torques: list[tuple[float, float]] = []
        left = brake.samples
        while left > 0:
            torque, left = stopping(brake, ROBOT, self.states[-1], left)
            self.torques.append(torque)
            self.plant.advance(torque)
            self.states.append(self.state())

    def state(self) -> State:
        measured = self.plant.truth()
        return state_from_joints(ROBOT, *measured.position, *measured.velocity)

    @property
    def way(self) -> float:
        """How far (m) the platform has gone."""
        places = np.array([(one.x, one.y) for one in self.states])
        return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


@pytest.mark.parametrize("pull", [(1.5, 0.5), (-0.8, -1.4), (1.2, -1.2), (-2.0, 0.5)])
@pytest.mark.parametrize("friction", [0.0, 1.0])
def test_the_energy_never_increases_and_the_robot_comes_to_rest(pull: tuple[float, float], friction: float) -> None:
    """On Pinocchio's plant, without friction too: from sample to sample, held torques and all."""
    run = Run(pull, 40, BRAKE, friction)
    energies = [energy(one) for one in run.states]
    assert energies[0] > 1e-3
    assert all(after <= before + INTEGRATION * energies[0] for before, after in pairwise(energies))
    assert is_at_rest(run.states[-2], BRAKE.rest_speed)
    assert run.torques[-1] == ZERO
    assert max(abs(tau) for torque in run.torques for tau in torque) <= LIMIT
    assert len(run.torques) < RATE_HZ


def test_the_way_to_rest_is_a_fraction_of_that_without_braking() -> None:
    coasting = BRAKE._replace(damping1=0.0, damping2=0.0)
    for samples in (20, 40):
        braked, coasted = (Run((1.5, 0.5), samples, brake).way for brake in (BRAKE, coasting))
        assert braked < 0.5 * coasted
