# SPDX-License-Identifier: Apache-2.0
"""The simulated robot: energy, closure, an independent integration, determinism, and what it refuses."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import simpson, solve_ivp

from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import det_a, state_from_joints, state_from_platform
from fivebar_control.model.state import State
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.imu import ImuSettings
from fivebar_description.parameters import FiveBar, friction_torque, scaled
from fivebar_description.robot_file import load_robot
from fivebar_description.strict_yaml import InputError
from fivebar_sim.effects.settings import PlantSettings
from fivebar_sim.plant import Plant, PlantDiverged

Vector = NDArray[np.float64]
Vectors = Callable[[State], tuple[Vector, Vector]]

FREE = PlantSettings(friction_scale=0.0)
HOME = (0.0, 0.13)


def home(robot: FiveBar, x: float = HOME[0], y: float = HOME[1]) -> tuple[float, ...]:
    return tuple(inverse_geometry(robot, (1, -1), x, y))


def state_of(robot: FiveBar, plant: Plant) -> State:
    return state_from_joints(robot, *plant.joints.tolist(), *plant.joint_velocities.tolist())


@pytest.mark.extra
@pytest.mark.parametrize(
    ("vx", "vy", "crosses"),
    [(0.0, -0.3, True), (0.15, -0.2, True), (0.2, 0.02, False)],
)
def test_a_free_motion_keeps_its_energy_and_its_loop_closed_for_10_s(
    vx: float, vy: float, crosses: bool, robot: FiveBar, joint_vectors: Vectors
) -> None:
    """No torque, no friction: through the Type 2 locus, and Type 1 at the edge of the workspace, again and again."""
    start = state_from_platform(robot, (1, -1), *HOME, vx, vy)
    q, v = joint_vectors(start)
    plant = Plant(robot, q.tolist(), 100, FREE, velocities=v.tolist())
    energy = plant.kinetic_energy()
    rotors = robot.leg1.inertia * start.leg1.dq1**2 + robot.leg2.inertia * start.leg2.dq1**2
    assert energy == pytest.approx(0.5 * (rotors + robot.mass * (vx**2 + vy**2)), rel=1e-12)
    modes = set()
    for _ in range(1000):
        plant.advance((0.0, 0.0))
        assert plant.kinetic_energy() == pytest.approx(energy, rel=1e-6)
        modes.add(det_a(state_of(robot, plant)) > 0.0)
    assert plant.closure_error < 1e-9
    if crosses:
        assert modes == {True, False}
    assert ClosedLoop(robot).tip_gap(plant.joints).gap == pytest.approx((0.0, 0.0), abs=1e-12)


def test_a_motion_too_fast_for_the_step_is_taken_in_smaller_ones(dextar: FiveBar, joint_vectors: Vectors) -> None:
    """At 5 m/s a step of 1 ms would open the loop by a micrometre: as good as with an eighth of it all the same."""
    q, v = joint_vectors(state_from_platform(dextar, (1, -1), *HOME, 3.0, -4.0))
    coarse, fine = (Plant(dextar, q.tolist(), rate, FREE, velocities=v.tolist()) for rate in (1000, 8000))
    energy = coarse.kinetic_energy()
    for _ in range(100):
        coarse.advance((0.0, 0.0))
        for _ in range(8):
            fine.advance((0.0, 0.0))
    assert coarse.closure_error <= 1e-9
    assert coarse.kinetic_energy() == pytest.approx(energy, rel=1e-6)
    np.testing.assert_allclose(coarse.joints, fine.joints, rtol=0.0, atol=1e-5)


@pytest.mark.parametrize("torque", [(0.9, -0.7), (0.2, 0.6)])
def test_a_driven_motion_agrees_with_the_reduced_model_integrated_by_scipy(
    torque: tuple[float, float], robot: FiveBar
) -> None:
    """Two models, two integrators, friction on, for half a second under a constant torque."""
    smooth = FiveBar(robot.leg1._replace(width=0.5), robot.leg2._replace(width=0.5), robot.mass)

    def rates(_: float, y: Vector) -> list[float]:
        state = state_from_platform(smooth, (1, -1), *y.tolist())
        f1, f2 = (friction_torque(leg, at.dq1) for leg, at in ((smooth.leg1, state.leg1), (smooth.leg2, state.leg2)))
        motion = direct_dynamics(smooth, state, *torque, f1, f2)
        return [state.vx, state.vy, motion.ax, motion.ay]

    times = np.arange(0.0, 0.3001, 0.02)
    truth = solve_ivp(rates, (0.0, times[-1]), [*HOME, 0.0, 0.0], "DOP853", times, rtol=1e-12, atol=1e-13)
    plant = Plant(smooth, home(smooth), 1000)
    for sample in range(301):
        if sample % 20 == 0:
            state = state_of(smooth, plant)
            wanted = truth.y[:, sample // 20]
            np.testing.assert_allclose((state.x, state.y), wanted[:2], rtol=0.0, atol=1e-9)
            np.testing.assert_allclose((state.vx, state.vy), wanted[2:], rtol=0.0, atol=1e-7)
        plant.advance(torque)
    assert math.dist(wanted[:2], HOME) > 0.01


def test_friction_takes_exactly_the_work_that_it_does(robot: FiveBar, joint_vectors: Vectors) -> None:
    """dT/dt = -f . qdot, summed by Simpson's rule over a coasting motion."""
    smooth = FiveBar(robot.leg1._replace(width=0.5), robot.leg2._replace(width=0.5), robot.mass)
    q, v = joint_vectors(state_from_platform(smooth, (1, -1), *HOME, 0.3, -0.2))
    plant = Plant(smooth, q.tolist(), 1000, velocities=v.tolist())
    energies, powers = [], []
    for _ in range(201):
        energies.append(plant.kinetic_energy())
        dq1, _, dq2, _ = plant.joint_velocities.tolist()
        powers.append(friction_torque(smooth.leg1, dq1) * dq1 + friction_torque(smooth.leg2, dq2) * dq2)
        plant.advance((0.0, 0.0))
    lost = energies[0] - energies[-1]
    assert lost > 0.01
    assert lost == pytest.approx(simpson(powers, dx=1e-3), rel=1e-6)


def test_friction_without_offset_only_ever_slows_down(robot: FiveBar, joint_vectors: Vectors) -> None:
    plain = FiveBar(robot.leg1._replace(offset=0.0), robot.leg2._replace(offset=0.0), robot.mass)
    q, v = joint_vectors(state_from_platform(plain, (1, -1), *HOME, 0.2, -0.3))
    plant = Plant(plain, q.tolist(), 500, velocities=v.tolist())
    energies = [plant.kinetic_energy()]
    for _ in range(300):
        plant.advance((0.0, 0.0))
        energies.append(plant.kinetic_energy())
    assert all(after <= before for before, after in pairwise(energies))
    assert energies[-1] < 1e-3 * energies[0]


def test_scales_change_the_plant_and_not_the_model(dextar: FiveBar) -> None:
    options = PlantSettings(mass_scale=1.1, inertia_scale=0.9, friction_scale=1.2)
    other = Plant(dextar, home(dextar), 500, options)
    same = Plant(scaled(dextar, 1.1, 0.9, 1.2), home(dextar), 500)
    nominal = Plant(dextar, home(dextar), 500)
    for plant in (other, same, nominal):
        for _ in range(20):
            plant.advance((1.0, -1.0))
    assert other.joints.tolist() == same.joints.tolist()
    assert np.abs(other.joints - nominal.joints).max() > 1e-4


def test_the_sampling_rate_changes_nothing_but_the_samples(dextar: FiveBar) -> None:
    slow, fast = (Plant(dextar, home(dextar), rate) for rate in (100, 1000))
    for _ in range(30):
        slow.advance((0.8, -0.8))
        for _ in range(10):
            fast.advance((0.8, -0.8))
    np.testing.assert_allclose(slow.joints, fast.joints, rtol=0.0, atol=1e-13)


def test_friction_brings_light_motors_to_rest_and_does_not_drive_them() -> None:
    """On the bench it stops a slow motion within a fraction of a millisecond."""
    robot = load_robot("motkin")
    plant = Plant(robot, inverse_geometry(robot, (1, -1), 0.0, 0.1), 500, velocities=(0.03, 0.0, 0.0, 0.0))
    for _ in range(50):
        plant.advance((0.0, 0.0))
    assert np.abs(plant.truth().velocity).max() < 1e-6


def test_a_plant_at_rest_stays_there_without_friction_offset(dextar: FiveBar) -> None:
    plant = Plant(dextar, home(dextar), 500, FREE)
    before = plant.joints
    for _ in range(50):
        plant.advance((0.0, 0.0))
    np.testing.assert_allclose(plant.joints, before, rtol=0.0, atol=1e-15)


def test_two_plants_with_one_seed_are_equal_to_the_last_bit(dextar: FiveBar) -> None:
    options = PlantSettings(encoder_counts=40_000, delay_samples=1, torque_quantum=0.01, seed=7)

    def run(seed: int) -> list[object]:
        plant = Plant(dextar, home(dextar), 500, options._replace(seed=seed), ImuSettings(noise=0.05))
        record: list[object] = []
        for sample in range(60):
            record.extend((plant.measure(), plant.measure_imu(), plant.joints.tolist()))
            plant.advance((math.sin(0.1 * sample), math.cos(0.1 * sample)))
        return record

    first = run(7)
    assert run(7) == first
    other = run(8)
    assert [other[index] for index in (0, 2)] == [first[index] for index in (0, 2)]
    assert other[1] != first[1]


def test_reading_the_sensors_does_not_move_the_robot(dextar: FiveBar) -> None:
    watched, alone = (Plant(dextar, home(dextar), 500, imu=ImuSettings(noise=0.1)) for _ in range(2))
    for _ in range(30):
        watched.measure()
        watched.measure_imu()
        for plant in (watched, alone):
            plant.advance((1.0, 0.5))
    assert watched.joints.tolist() == alone.joints.tolist()


def test_exact_sensors_and_the_applied_torque(dextar: FiveBar) -> None:
    plant = Plant(dextar, home(dextar), 500, PlantSettings(torque_limit=1.5, torque_quantum=0.1))
    assert plant.measure().effort == (0.0, 0.0, 0.0, 0.0)
    plant.advance((0.33, -7.0))
    measured = plant.measure()
    assert measured.position == tuple(plant.joints.tolist())
    assert measured.velocity == tuple(plant.joint_velocities.tolist())
    assert measured.effort == pytest.approx((0.3, 0.0, -1.5, 0.0), abs=1e-15)


def test_a_delayed_command_acts_that_many_samples_later(dextar: FiveBar) -> None:
    prompt = Plant(dextar, home(dextar), 500, FREE)
    late = Plant(dextar, home(dextar), 500, FREE._replace(delay_samples=2))
    commands = [(1.0, -1.0), (0.5, 2.0), (-1.0, 0.3), (0.0, 0.0), (0.0, 0.0)]
    efforts = []
    for command in commands:
        late.advance(command)
        efforts.append(late.measure().effort[::2])
    assert efforts == [(0.0, 0.0), (0.0, 0.0), *commands[:3]]
    for command in commands[:3]:
        prompt.advance(command)
    np.testing.assert_allclose(late.joints, prompt.joints, rtol=0.0, atol=1e-14)


def test_encoders_read_counts_and_differences(dextar: FiveBar) -> None:
    counts, rate = 10_000, 500
    plant = Plant(dextar, home(dextar), rate, PlantSettings(encoder_counts=counts))
    step = 2.0 * math.pi / counts
    first = plant.measure()
    assert first.velocity == (0.0, 0.0, 0.0, 0.0)
    for _ in range(25):
        plant.advance((2.0, -2.0))
        before, now = first, plant.measure()
        for measured, exact in zip(now.position, plant.joints.tolist(), strict=True):
            assert 0.0 <= exact - measured < step * (1.0 + 1e-9)
            assert measured / step == pytest.approx(round(measured / step), abs=1e-9)
        wanted = [(b - a) * rate for a, b in zip(before.position, now.position, strict=True)]
        assert now.velocity == pytest.approx(wanted, abs=1e-9)
        first = now
    assert plant.joint_velocities[0] > 1.0


def test_the_imu_measures_the_platforms_acceleration_in_the_distal_link(robot: FiveBar) -> None:
    """Against fourth-order differences of the platform's velocity and of the link's angle."""
    rate = 5000
    plant = Plant(robot, home(robot), rate, FREE, ImuSettings(gravity=9.81))
    states, readings = [], []
    for _ in range(504):
        states.append(state_of(robot, plant))
        readings.append(plant.measure_imu())
        plant.advance((1.0, -0.6))
    weights = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) * rate / 12.0
    for sample in (50, 250, 500):
        near = states[sample - 2 : sample + 3]
        ax, ay = weights @ [(state.vx, state.vy) for state in near]
        turning = weights @ [state.leg2.q1 + state.leg2.q2 for state in near]
        theta = states[sample].leg2.q1 + states[sample].leg2.q2
        along = math.cos(theta) * ax + math.sin(theta) * ay
        across = -math.sin(theta) * ax + math.cos(theta) * ay
        assert readings[sample].acceleration == pytest.approx((along, across, 9.81), abs=1e-6)
        assert readings[sample].angular_velocity == pytest.approx((0.0, 0.0, turning), abs=1e-6)
    assert math.hypot(ax, ay) > 1.0


@pytest.mark.parametrize("offset", [2e-5, 0.3])
def test_an_open_posture_is_refused_with_its_gap(offset: float, dextar: FiveBar) -> None:
    joints = list(home(dextar))
    joints[3] += offset
    gap = 2.0 * dextar.leg2.distal * math.sin(0.5 * offset) * 1e3
    with pytest.raises(InputError, match=r"initial_joints: \[.*\]: the legs end .* apart") as caught:
        Plant(dextar, joints, 500)
    assert f"{gap:.3f} mm apart" in str(caught.value)


def test_a_posture_rounded_to_microradians_is_closed(dextar: FiveBar) -> None:
    joints = [round(angle, 6) for angle in home(dextar)]
    plant = Plant(dextar, joints, 500)
    assert np.linalg.norm(ClosedLoop(dextar).tip_gap(plant.joints).gap) < 1e-12


@pytest.mark.parametrize("joints", [(), (1.0, 2.0, 3.0), (1.0, 2.0, 3.0, math.nan), (1.0, 2.0, math.inf, 3.0)])
def test_a_malformed_posture_is_refused(joints: tuple[float, ...], dextar: FiveBar) -> None:
    with pytest.raises(InputError, match=r"initial_joints: .*expected four finite angles in rad"):
        Plant(dextar, joints, 500)


@pytest.mark.parametrize("velocities", [(0.0,), (0.0, 0.0, 0.0, math.nan)])
def test_malformed_velocities_are_refused(velocities: tuple[float, ...], dextar: FiveBar) -> None:
    with pytest.raises(InputError, match=r"initial velocities: .*expected four finite speeds in rad/s"):
        Plant(dextar, home(dextar), 500, velocities=velocities)


def test_initial_velocities_are_put_onto_the_loop(dextar: FiveBar) -> None:
    plant = Plant(dextar, home(dextar), 500, velocities=(1.0, 0.0, 0.0, 0.0))
    jacobian = ClosedLoop(dextar).tip_gap(plant.joints).jacobian
    np.testing.assert_allclose(jacobian @ plant.joint_velocities, (0.0, 0.0), atol=1e-15)
    assert np.abs(plant.joint_velocities).max() > 0.1


def test_an_absurd_torque_is_a_named_failure(dextar: FiveBar) -> None:
    plant = Plant(dextar, home(dextar), 500, PlantSettings(torque_limit=None))
    with pytest.raises(PlantDiverged, match=r"motor speeds .* rad/s under 1e\+06 and -1e\+06 Nm open the loop by"):
        for _ in range(100):
            plant.advance((1e6, -1e6))


def test_the_default_drives_keep_such_a_torque_to_their_limit(dextar: FiveBar) -> None:
    plant = Plant(dextar, home(dextar), 500)
    plant.advance((1e6, -1e6))
    assert plant.measure().effort == (10.0, 0.0, -10.0, 0.0)


def test_what_callers_get_is_a_copy(dextar: FiveBar) -> None:
    plant = Plant(dextar, home(dextar), 500)
    plant.joints[:] = 9.0
    plant.joint_velocities[:] = 9.0
    assert plant.joints.tolist() == pytest.approx(home(dextar), abs=1e-12)
    assert plant.joint_velocities.tolist() == [0.0, 0.0, 0.0, 0.0]
