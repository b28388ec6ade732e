# SPDX-License-Identifier: Apache-2.0
"""Gravity in the plane, a payload and a constant force: model, laws and plants against Pinocchio and virtual work."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from estimate_replay import summary_of
from numpy.typing import NDArray
from scipy.optimize import brentq, linprog

from fivebar_bringup.scenario import Scenario
from fivebar_control.estimation.imu_check import ImuCheck
from fivebar_control.estimation.platform_motion import Applied, acceleration_derivatives, platform_acceleration
from fivebar_control.identification.regressor import platform_load
from fivebar_control.laws.gains import RESOLUTIONS
from fivebar_control.laws.reference import DAMPING, reference_at_rest
from fivebar_control.laws.registry import default_tuning, find_controller
from fivebar_control.laws.resolution import Enforced, fall_along_locus, resolved
from fivebar_control.laws.torque import Torque
from fivebar_control.laws.unified import acceleration, input_map
from fivebar_control.model.dynamics import (
    direct_dynamics,
    direct_dynamics_of_platform,
    inverse_dynamics,
    inverse_dynamics_of_platform,
)
from fivebar_control.model.geometry import direct_geometry, inverse_geometry
from fivebar_control.model.kinematics import (
    assembly_mode,
    det_a,
    distal_acceleration,
    joint_acceleration,
    joints_of,
    state_from_platform,
    working_mode,
)
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.model.state import MotorMotion, Platform, State
from fivebar_control.planning.bent_courses import bent_courses
from fivebar_control.planning.feasibility import screen_run
from fivebar_control.planning.figures import Feasibility
from fivebar_control.planning.limits import motion_limits_of
from fivebar_control.planning.pacing import Task
from fivebar_control.planning.release import ReleaseRefused, ReleaseTask, finished, plan_in_slices
from fivebar_control.planning.timing import Speed, Timed
from fivebar_control.planning.transfer import plan_transfer
from fivebar_control.planning.via_points import along
from fivebar_control.safety.settings import SafetySettings
from fivebar_control.trajectory.criterion import criterion_residual
from fivebar_control.trajectory.planner import Plan, PlanRefused, plan_motion
from fivebar_control.trajectory.zones import ZoneSettings
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.imu import STANDARD_GRAVITY, ImuSettings
from fivebar_description.loads import NO_FORCES, Forces
from fivebar_description.parameters import FiveBar, external_acceleration, external_force, weight_torque
from fivebar_description.robot_file import RobotFile, load_robot, read_robot
from fivebar_sim.effects.friction import FrictionEffects
from fivebar_sim.effects.settings import MUJOCO, PlantSettings
from fivebar_sim.plant import Plant

States = Callable[[int, int], list[State]]
Vector = NDArray[np.float64]
Way = tuple[tuple[float, float], ...]

ALL = Forces(tilt=1.1, downhill=-1.2, moment_1=0.021, moment_2=0.033, payload=0.1, force_x=1.3, force_y=-0.7)
VERTICAL = Forces(tilt=math.pi / 2.0, moment_1=0.02, moment_2=0.02)
DOWN, UP, ASIDE = ((0.0, 0.15), (0.0, 0.02)), ((0.0, 0.02), (0.0, 0.15)), ((-0.03, 0.14), (0.02, 0.03))


def under(name: str, forces: Forces) -> FiveBar:
    file = read_robot(name)
    return RobotFile(**{key: getattr(file, key) for key in RobotFile.model_fields} | {"forces": forces}).five_bar()


def acted_on(robot: FiveBar, forces: Forces = ALL) -> FiveBar:
    """Return a robot with these forces in place of none."""
    legs = (robot.leg1._replace(moment=forces.moment_1 or 0.0), robot.leg2._replace(moment=forces.moment_2 or 0.0))
    return FiveBar(*legs, robot.mass + forces.payload, *forces.gravity(), forces.force_x, forces.force_y)


def legs_weight(robot: FiveBar, state: State) -> tuple[float, float]:
    one, two = state.leg1, state.leg2
    return weight_torque(robot, robot.leg1, one.r_x, one.r_y), weight_torque(robot, robot.leg2, two.r_x, two.r_y)


@pytest.mark.parametrize("residual", [0.0, -2.0e-5])
@pytest.mark.parametrize("where", ["regular_states", "locus_states"])
def test_every_form_of_the_model_has_the_forces_that_pinocchio_has(
    robot: FiveBar, where: str, residual: float, request: pytest.FixtureRequest
) -> None:
    states: States = request.getfixturevalue(where)
    robot = acted_on(robot)
    legs = (leg._replace(residual=residual) for leg in robot[:2])
    robot = robot._replace(leg1=next(legs), leg2=next(legs))
    loop = ClosedLoop(robot)
    for number, state in enumerate(states(20, 1)):
        tau1, tau2 = np.random.default_rng(number).uniform(-2.0, 2.0, 2).tolist()
        w1, w2 = legs_weight(robot, state)
        motion = direct_dynamics(robot, state, tau1, tau2, w1, w2)
        q, v = np.array(joints_of(state)).reshape(2, 4)
        wanted = loop.acceleration(q, v, np.array([tau1, 0.0, tau2, 0.0]))
        size = np.abs(wanted).max() + 10.0
        np.testing.assert_allclose((motion.ddq11, motion.ddq21), wanted[[0, 2]], atol=1e-10 * size)
        place = working_mode(state), state.x, state.y, state.vx, state.vy
        mapped = input_map(robot, state)
        assert mapped is not None
        for found in (
            direct_dynamics_of_platform(robot, state, tau1, tau2, w1, w2),
            acceleration(mapped, tau1 - w1, tau2 - w2),
        ):
            np.testing.assert_allclose(found, motion[2:4], atol=1e-10 * size)
        # the estimator's model adds friction, which Pinocchio's tree has not
        free = robot._replace(
            leg1=robot.leg1._replace(coulomb=0.0, offset=0.0), leg2=robot.leg2._replace(coulomb=0.0, offset=0.0)
        )
        np.testing.assert_allclose(
            platform_acceleration(free, *place, Applied(tau1, tau2, 0.0, 0.0)), motion[2:4], atol=1e-10 * size
        )
        if abs(det_a(state)) > 0.1:
            back = inverse_dynamics(robot, state, motion.ddq11, motion.ddq21, w1, w2)
            np.testing.assert_allclose(back, (tau1, tau2), atol=1e-9)
            a = np.array([motion.ddq11, 0.0, motion.ddq21, 0.0])
            for leg, column, one, two in ((state.leg1, 1, robot.leg1, a[0]), (state.leg2, 3, robot.leg2, a[2])):
                a[column] = distal_acceleration(one, leg, motion.ax, motion.ay) - two
            np.testing.assert_allclose(loop.inverse_dynamics(q, v, a), (tau1, tau2), atol=1e-9)


@pytest.mark.parametrize("place", [(0.0, 0.11), (0.02, 0.08), (-0.005, 0.01)])
def test_motors_hold_what_the_links_weigh_by_virtual_work(place: tuple[float, float]) -> None:
    """The bench's links as they were weighed: the gradient of their potential energy over the motors' angles."""
    file, forces = read_robot("motkin"), Forces(tilt=0.8, downhill=-1.0, payload=0.02, force_x=0.05, force_y=-0.03)
    robot, gravity = under("motkin", forces), np.array(forces.gravity())
    assert file.proximal_links is not None and file.distal_links is not None
    state = state_from_platform(robot, (1, -1), *place, 0.0, 0.0)
    assembly = assembly_mode(state)

    def energy(q11: float, q21: float) -> float:
        tip, total = np.array(direct_geometry(robot, assembly, q11, q21)), 0.0
        for leg, q1, near, far in (
            (robot.leg1, q11, file.proximal_links.leg_1, file.distal_links.leg_1),
            (robot.leg2, q21, file.proximal_links.leg_2, file.distal_links.leg_2),
        ):
            along, base = np.array([math.cos(q1), math.sin(q1)]), np.array([leg.base_x, 0.0])
            elbow = base + leg.proximal * along
            centre = elbow + far.centre_m / leg.distal * (tip - elbow)
            total -= near.mass_kg * gravity @ (base + near.centre_m * along) + far.mass_kg * gravity @ centre
        return float(total - forces.payload * gravity @ tip - np.array([forces.force_x, forces.force_y]) @ tip)

    q11, _, q21, _ = inverse_geometry(robot, (1, -1), *place)
    step = 1e-5
    wanted = (
        (energy(q11 + step, q21) - energy(q11 - step, q21)) / (2.0 * step),
        (energy(q11, q21 + step) - energy(q11, q21 - step)) / (2.0 * step),
    )
    found = inverse_dynamics_of_platform(robot, state, 0.0, 0.0, *legs_weight(robot, state))
    assert found == pytest.approx(wanted, rel=1e-5, abs=1e-8)
    assert max(map(abs, found)) > 1e-3
    # and the reference at rest asks for them, damped by the locus alone
    held = reference_at_rest(robot, state)
    offset = robot.leg1.offset, robot.leg2.offset
    share = 1.0 - DAMPING**2 / (det_a(state) ** 2 + DAMPING**2)
    np.testing.assert_allclose((held.f1, held.f2), np.add(legs_weight(robot, state), offset), atol=1e-12)
    on_platform = np.subtract(found, legs_weight(robot, state))
    np.testing.assert_allclose((held.u1, held.u2), share * on_platform, rtol=1e-9, atol=1e-12)


def test_without_forces_the_robot_is_what_it_was() -> None:
    assert under("dextar", NO_FORCES._replace(moment_1=0.1, moment_2=0.2)) == load_robot("dextar")
    laden = under("dextar", NO_FORCES._replace(payload=0.25))
    assert laden == load_robot("dextar")._replace(mass=0.537 + 0.25)
    assert under("motkin", NO_FORCES) == load_robot("motkin")


@pytest.mark.parametrize(
    ("name", "forces", "message"),
    [
        ("dextar", Forces(tilt=0.1), r"forces\.moment_1: is missing"),
        ("dextar", Forces(tilt=0.1, moment_1=0.0), r"forces\.moment_2: is missing"),
        ("motkin", Forces(tilt=0.1, moment_1=0.02), r"forces\.moment_1: 0\.02: expected none beside proximal_links"),
    ],
)
def test_moments_are_said_once(name: str, forces: Forces, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        under(name, forces)


def test_the_estimators_derivatives_know_the_weight_of_the_legs(robot: FiveBar, regular_states: States) -> None:
    robot = acted_on(robot, ALL._replace(moment_1=0.3, moment_2=-0.2))
    for state in regular_states(10, 3):
        place = (state.x, state.y, state.vx, state.vy)
        found = acceleration_derivatives(robot, working_mode(state), *place, Applied(0.4, -0.3, 0.0, 0.0))
        for axis, columns in enumerate(((found.p_xx, found.p_yx), (found.p_xy, found.p_yy))):
            step = np.eye(4)[axis] * 1e-6
            after, before = (
                np.array(
                    platform_acceleration(
                        robot, working_mode(state), *(place + sign * step).tolist(), Applied(0.4, -0.3, 0.0, 0.0)
                    )
                )
                for sign in (1.0, -1.0)
            )
            np.testing.assert_allclose(columns, (after - before) / 2e-6, rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize("resolution", RESOLUTIONS.values(), ids=RESOLUTIONS)
def test_constraint_laws_get_the_acceleration_along_v1_while_the_platform_falls(
    robot: FiveBar, resolution: int, locus_states: States
) -> None:
    robot = acted_on(robot)
    for state in locus_states(10, 5):
        svd, alpha = parallel_svd(state), 1.7
        beta = fall_along_locus(robot, svd)
        ax, ay = alpha * svd.v_x + beta * svd.t_x, alpha * svd.v_y + beta * svd.t_y
        ddq11, ddq21 = joint_acceleration(state.leg1, ax, ay), joint_acceleration(state.leg2, ax, ay)
        weight = legs_weight(robot, state)
        torque = resolved(resolution, robot, state, svd, Enforced(alpha, ddq11, ddq21, beta), Torque(*weight))
        motion = direct_dynamics(robot, state, *torque, *weight)
        assert svd.v_x * motion.ax + svd.v_y * motion.ay == pytest.approx(alpha, abs=1e-6)
        assert svd.t_x * motion.ax + svd.t_y * motion.ay == pytest.approx(beta, abs=1e-6)
        moving = Platform(state.x, state.y, state.vx, state.vy, motion.ax, motion.ay)
        assert criterion_residual(robot, working_mode(state), moving) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("duration", [0.3, 0.6, 2.0])
@pytest.mark.parametrize("way", [DOWN, UP, ASIDE], ids=["down", "up", "aside"])
def test_a_time_law_falls_with_the_platform_at_the_crossing(
    way: tuple[tuple[float, float], ...], duration: float
) -> None:
    """Also where a polynomial of seventh order would have to go backwards; and then the torque is bounded."""
    robot = under("dextar", VERTICAL)
    plan = plan_motion(robot, (1, -1), way, (duration,), 500, ZoneSettings().as_rule(), "criterion", 0.0)
    (crossing,) = plan.crossings
    assert plan.path.duration == duration
    at = plan.path.at(crossing.time)
    state = state_from_platform(robot, (1, -1), *at[:4])
    svd, (fall_x, fall_y) = parallel_svd(state), external_acceleration(robot)
    assert abs(svd.t_x * fall_x + svd.t_y * fall_y) > 5.0
    wanted = svd.t_x * fall_x + svd.t_y * fall_y
    assert svd.t_x * at.ax + svd.t_y * at.ay == pytest.approx(wanted, rel=1e-6)
    gone = np.array([math.dist(plan.path.at(t)[:2], way[0]) for t in np.linspace(0.0, duration, 500)])
    assert np.diff(gone).min() >= -1e-12
    assert gone[-1] == pytest.approx(math.dist(*way))
    # continuous up to the jerk, and bounded torque, where a polynomial that knows nothing of the forces has 1 / kappa
    torques = []
    for t in crossing.time + np.linspace(-2e-3, 2e-3, 9):
        moved = plan.path.at(float(t))
        here = state_from_platform(robot, (1, -1), *moved[:4])
        if abs(det_a(here)) > 1e-6:
            torques.append(inverse_dynamics_of_platform(robot, here, moved.ax, moved.ay, *legs_weight(robot, here)))
    assert np.abs(torques).max() < 8.0
    assert np.ptp(torques, axis=0).max() < 1.0


@pytest.mark.parametrize("x", [0.01, 0.02, 0.03])
def test_across_t_s_a_curved_path_has_one_pace_and_a_straight_one_none(x: float) -> None:
    """Torques 1 mm to 10 um from the locus: bounded at that pace, beyond any motor 10 % beside it."""
    robot, radius = under("dextar", VERTICAL), 0.025
    y = brentq(lambda one: det_a(state_from_platform(robot, (1, -1), x, one, 0.0, 0.0)), 0.05, 0.1)
    svd = parallel_svd(state_from_platform(robot, (1, -1), x, y, 0.0, 0.0))
    along, across = np.array((svd.v_x, svd.v_y)), np.array((svd.t_x, svd.t_y))
    fall = float(across @ external_force(robot)) / robot.mass

    def largest(way: float, pace: float, bend: float) -> float:
        """Torque on an arc that leaves the locus point along v_1; a `bend` of 0 makes it straight."""
        turn = way * bend
        right = across * math.copysign(1.0, fall)
        heading = math.cos(turn) * along + math.sin(turn) * right
        inwards = math.cos(turn) * right - math.sin(turn) * along
        sideways = 0.5 * way * turn * np.sinc(0.5 * turn / math.pi) ** 2
        place = np.array((x, y)) + way * np.sinc(turn / math.pi) * along + sideways * right
        state = state_from_platform(robot, (1, -1), *place.tolist(), *(pace * heading).tolist())
        ax, ay = (pace * pace * bend * inwards).tolist()
        return max(map(abs, inverse_dynamics_of_platform(robot, state, ax, ay, *legs_weight(robot, state))))

    ways, pace = (1e-3, 1e-4, 1e-5, -1e-5), math.sqrt(abs(fall) * radius)
    assert max(largest(way, pace, 1.0 / radius) for way in ways) < 0.2
    assert min(largest(1e-5, share * pace, 1.0 / radius) for share in (0.9, 1.1)) > 1000.0
    assert min(largest(1e-5, share * pace, 0.0) for share in (0.5, 1.0, 2.0)) > 1000.0


@pytest.mark.parametrize(("crossed", "most"), [(0.05, 18.1), (0.15, 13.7), (0.5, 11.2), (0.65, 9.2), (0.9, 4.0)])
def test_how_far_a_forwards_polynomial_of_seventh_order_accelerates(crossed: float, most: float) -> None:
    """A linear program over its two free coefficients, for each share of the duration at which it may cross."""
    powers = np.arange(8)

    def row(u: float, order: int) -> Vector:
        factors = np.prod([powers - one for one in range(order)], axis=0) if order else np.ones(8)
        values: Vector = factors * np.where(powers >= order, u ** np.clip(powers - order, 0, None), 0.0)
        return values

    forwards = -np.array([row(u, 1) for u in np.linspace(0.0, 1.0, 401)])
    ends = [row(u, order) for u in (0.0, 1.0) for order in range(3)]
    found = []
    for u in np.linspace(0.02, 0.98, 97):
        equal = [*ends, row(u, 0)]
        wanted = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, crossed]
        solved = linprog(-row(u, 2), forwards, np.full(401, 1e-9), equal, wanted, (None, None), method="highs")
        found.append(-solved.fun if solved.status == 0 else 0.0)
    assert max(found) == pytest.approx(most, rel=0.02)


def test_other_time_laws_of_the_locus_are_refused() -> None:
    robot = under("dextar", VERTICAL)
    for law in ("optimal", "optimal_with_friction"):
        with pytest.raises(PlanRefused, match=f"time law {law} knows nothing of gravity.*expected criterion"):
            plan_motion(robot, (1, -1), DOWN, (0.5,), 500, ZoneSettings().as_rule(), law)


def test_a_release_is_not_planned_under_gravity() -> None:
    file = read_robot("dextar")
    state = state_from_platform(file.five_bar(), (1, -1), 0.0, 0.0844926, 0.0, 0.0)
    with pytest.raises(ReleaseRefused, match="gravity or a constant force"):
        task = ReleaseTask(under("dextar", VERTICAL), file.tolerances, SafetySettings(), True, 500)
        finished(plan_in_slices(task, state.leg1.q1, state.leg2.q1))


def test_what_a_constant_force_and_the_legs_take_is_taken_off_before_parameters_are_identified(
    robot: FiveBar, regular_states: States
) -> None:
    robot = acted_on(robot)
    for state in regular_states(10, 7):
        if abs(det_a(state)) < 0.2:
            continue
        motion = MotorMotion(state.leg1.q1, state.leg2.q1, state.leg1.dq1, state.leg2.dq1, 20.0, -35.0)
        load = platform_load(robot, assembly_mode(state), motion)
        torques = inverse_dynamics(robot, state, 20.0, -35.0, *legs_weight(robot, state))
        found = (
            robot.leg1.inertia * 20.0 + robot.mass * load.load1 + load.known1,
            robot.leg2.inertia * -35.0 + robot.mass * load.load2 + load.known2,
        )
        assert found == pytest.approx(torques, rel=1e-9, abs=1e-9)


def fallen(robot: FiveBar, settings: PlantSettings) -> Vector:
    """Return the joints after 0.1 s without torque, from a rest; none of the plants is at the locus by then."""
    plant = Plant(robot, joints_of(state_from_platform(robot, (1, -1), 0.01, 0.13, 0.0, 0.0))[:4], 500, settings)
    for _ in range(50):
        plant.advance((0.3, -0.3))
    return plant.joints


@pytest.mark.parametrize(
    ("settings", "tolerance"),
    [
        (PlantSettings(friction=FrictionEffects(viscous=1e-9)), 1e-7),
        (PlantSettings(engine=MUJOCO), 1e-4),
    ],
    ids=["effects", "mujoco"],
)
def test_all_plants_fall_alike(settings: PlantSettings, tolerance: float) -> None:
    robot = under("dextar", ALL)
    smooth = robot._replace(leg1=robot.leg1._replace(width=0.5), leg2=robot.leg2._replace(width=0.5))
    wanted, level = fallen(smooth, PlantSettings()), fallen(load_robot("dextar"), PlantSettings())
    assert np.abs(wanted - level).max() > 0.05
    np.testing.assert_allclose(fallen(smooth, settings), wanted, atol=tolerance)


def test_an_accelerometer_at_rest_measures_the_reaction_to_all_of_gravity() -> None:
    robot = under("dextar", ALL)
    state = state_from_platform(robot, (1, -1), 0.01, 0.13, 0.0, 0.0)
    plant = Plant(robot, joints_of(state)[:4], 500, PlantSettings())
    # the torque that holds it, friction at rest included
    held = inverse_dynamics_of_platform(robot, state, 0.0, 0.0, *legs_weight(robot, state))
    plant.advance((held[0] + robot.leg1.offset, held[1] + robot.leg2.offset))
    reading = plant.measure_imu()
    assert math.hypot(*reading.acceleration) == pytest.approx(STANDARD_GRAVITY, rel=1e-6)
    check = ImuCheck(robot, (1, -1), 500, ImuSettings())
    assert check.error(reading.acceleration, Platform(0.01, 0.13, 0.0, 0.0, 0.0, 0.0)) == pytest.approx(0.0, abs=1e-4)


def vertical_file(folder: Path) -> str:
    content = read_robot("dextar").model_dump(mode="json", exclude_none=True)
    content |= {"name": "vertical", "forces": {**VERTICAL._asdict(), "tilt": 1.5707}}
    file = folder / "vertical.yaml"
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    return str(file)


def crossed(way: Way, **changes: Any) -> tuple[float, str]:
    """Return the largest distance (m) from the reference of a crossing on Pinocchio's plant, and how it ends."""
    usual = {"working_mode": (1, -1), "segment_duration": 0.5, "zone": ZoneSettings(duration_ms=20.0)}
    scenario = Scenario(name="crossing", waypoints=way, time_law="criterion", force=True, **(usual | changes))
    summary, _ = summary_of(scenario)
    assert summary.tracking_error_peak_m is not None
    return summary.tracking_error_peak_m, summary.outcome


@pytest.mark.extra
@pytest.mark.parametrize(("controller", "most"), [("unified", 1e-4), ("lqr", 1e-4), ("multi_cartesian", 1.5e-3)])
@pytest.mark.parametrize("way", [DOWN, UP], ids=["down", "up"])
def test_laws_cross_on_a_vertical_robot_as_on_a_level_one(
    controller: str, most: float, way: Way, tmp_path: Path
) -> None:
    error, outcome = crossed(way, robot=vertical_file(tmp_path), controller=controller)
    assert outcome == "succeeded"
    assert error < most


def test_a_robot_whose_laws_do_not_know_that_it_is_vertical_falls() -> None:
    error, outcome = crossed(DOWN, controller="unified", plant={"tilt": {"angle": 1.57, "heading": -1.57}})
    assert outcome != "succeeded"
    assert error > 2e-3


def test_a_requested_motion_is_timed_anew_for_each_duration_and_crosses_as_the_forces_ask() -> None:
    """On a level robot a time law fits every duration."""
    robot, follower = under("motkin", Forces(tilt=math.pi / 2.0)), default_tuning(find_controller("unified"))
    limits = motion_limits_of(follower, torque=0.15)
    found = plan_transfer(
        Task(robot, (1, -1), 500, follower, limits), (0.0, 0.12), (0.0, 0.01), duration=Speed.COMFORTABLE
    )
    assert found.course.time_law == "criterion"
    (crossing,) = found.plan.crossings
    moving = found.plan.path.at(crossing.time)
    assert abs(criterion_residual(robot, (1, -1), moving)) < 1e-6 * robot.mass * 9.81
    assert math.hypot(moving.ax, moving.ay) > 5.0


ACROSS_MODE: tuple[int, int] = (1, 1)
ACROSS_START, ACROSS_GOAL = (0.052, 0.038), (0.1039, 0.008)
CORNER: Way = (ACROSS_START, (0.0929, 0.0489), ACROSS_GOAL)
"""Across the folded branch of the locus along v_1, straight and round a corner that falls."""


def planned(time_law: str, duration: float, way: Way = CORNER, payload: float = 0.0) -> tuple[FiveBar, Plan]:
    robot = under("dextar", VERTICAL._replace(payload=payload))
    durations, radii = (duration / (len(way) - 1),) * (len(way) - 1), (0.038,) if len(way) == 3 else (0.0,)
    rule = ZoneSettings().as_rule()
    return robot, plan_motion(robot, ACROSS_MODE, way, durations, 500, rule, time_law, 0.0, radii)


@pytest.mark.parametrize("payload", [0.0, 0.15])
@pytest.mark.parametrize("duration", [0.6, 0.66, 2.0])
def test_a_corner_that_bends_with_the_fall_is_passed_at_the_one_pace_of_the_fall(
    duration: float, payload: float
) -> None:
    """Its speed by the bend of the path alone, and the torque from 1 mm down to 10 um beside the locus."""
    robot, plan = planned("criterion", duration, payload=payload)
    (crossing,) = plan.crossings
    at = plan.path.at(crossing.time)
    svd = parallel_svd(state_from_platform(robot, ACROSS_MODE, *at[:4]))
    speed = math.hypot(at.vx, at.vy)
    assert abs(svd.t_x * at.vx + svd.t_y * at.vy) / speed < 0.1
    # the curvature by three places on the path, some 0.1 mm apart
    around = [np.array(plan.path.at(crossing.time + step)[:2]) for step in (-3e-4, 0.0, 3e-4)]
    bend = (around[2] - 2.0 * around[1] + around[0]) / np.sum((around[2] - around[1]) ** 2)
    fall = np.array((svd.t_x, svd.t_y)) @ external_acceleration(robot)
    along = np.array((svd.t_x, svd.t_y)) @ np.array((at.ax, at.ay))
    assert along == pytest.approx(fall, rel=1e-6)
    assert abs(fall) > 9.0
    assert speed == pytest.approx(math.sqrt(fall / float(np.array((svd.t_x, svd.t_y)) @ bend)), rel=0.1)
    gone = np.array([plan.path.at(t)[:2] for t in np.linspace(0.0, duration, 500)])
    assert np.all(np.linalg.norm(np.diff(gone, axis=0), axis=1) >= 0.0)
    torques = []
    for way in (1e-3, 1e-4, 1e-5, -1e-5, -1e-4, -1e-3):
        moved = plan.path.at(crossing.time + way / speed)
        here = state_from_platform(robot, ACROSS_MODE, *moved[:4])
        torques.append(inverse_dynamics_of_platform(robot, here, moved.ax, moved.ay, *legs_weight(robot, here)))
    assert np.abs(torques).max() < 2.0
    # with another pace, by a quarter, the torque has a pole there
    _, other = planned("quintic", 1.4)
    (crossing,) = other.crossings
    moved = other.path.at(crossing.time + 1e-5 / 0.2)
    here = state_from_platform(robot, ACROSS_MODE, *moved[:4])
    assert np.abs(inverse_dynamics_of_platform(robot, here, moved.ax, moved.ay, 0.0, 0.0)).max() > 100.0


def screened_run(robot: FiveBar, plan: Plan) -> Feasibility:
    follower = default_tuning(find_controller("unified"))
    return screen_run(robot, plan, 500, follower.limited_to(2.5), motion_limits_of(follower, torque=2.5))


def test_the_screen_names_the_pace_at_which_a_bend_falls_and_takes_that_one() -> None:
    robot, plan = planned("criterion", 0.66)
    (crossing,) = plan.crossings
    at = plan.path.at(crossing.time)
    pace = f"{math.hypot(at.vx, at.vy):.2f}"
    assert screened_run(robot, plan).reasons == []
    for duration in (0.5, 2.0):
        cause = screened_run(*planned("quintic", duration)).reasons[-1]
        assert f"falls across the path, and follows its bend at {pace}" in cause, cause


def test_a_straight_line_across_the_fall_is_refused_with_the_corner_that_would_do() -> None:
    robot, plan = planned("criterion", 0.6, (ACROSS_START, ACROSS_GOAL))
    verdict = screened_run(robot, plan)
    assert not verdict.feasible
    (cause,) = verdict.causes
    assert "no motor holds the platform, which falls across the path by 8.49 m/s^2" in cause
    assert "a corner there that bends towards (-0.50, -0.87), which falls at 0.461 m/s" in cause
    # a corner to the other side bends against the fall
    up = ACROSS_START, (0.064, -0.003), ACROSS_GOAL
    with pytest.raises(PlanRefused, match=r"which falls across the path .* bends towards \(-0\."):
        planned("criterion", 0.6, up)


def test_a_request_across_the_fall_is_bent_where_that_is_quicker_than_another_way() -> None:
    robot, follower = under("dextar", VERTICAL), default_tuning(find_controller("unified"))
    limits = motion_limits_of(follower, torque=2.5)
    found = plan_transfer(Task(robot, ACROSS_MODE, 500, follower, limits), ACROSS_START, ACROSS_GOAL)
    assert len(found.waypoints) == 3
    assert found.course.blend_radius[0] > 0.03
    assert found.plan.path.duration < 1.0
    (crossing,) = found.crossings
    assert crossing.authority < 0.1
    assert crossing.distal_links == "folded"


def test_a_quicker_way_with_a_rest_is_preferred_to_a_bend() -> None:
    """On the bench the straight line goes along the links, and a slanted one crosses hardly slower than a corner."""
    robot, follower = load_robot("motkin_vertical"), default_tuning(find_controller("unified"))
    start, goal, limits = (0.0, -0.022), (0.0, -0.112), motion_limits_of(follower, torque=0.186)
    task = Task(robot, (1, -1), 500, follower.limited_to(0.186), limits)
    tried = [along(task, course, Speed.COMFORTABLE) for course in bent_courses(task, start, goal)]
    bent = [one.plan.path.duration for one in tried if isinstance(one, Timed)]
    assert bent
    found = plan_transfer(Task(robot, (1, -1), 500, follower, limits), start, goal)
    assert not found.course.rounded
    assert found.plan.path.duration < min(bent)
    # a level robot is not bent
    assert list(bent_courses(task._replace(robot=load_robot("motkin")), start, goal)) == []


def test_a_corner_that_falls_is_crossed_on_pinocchios_plant(tmp_path: Path) -> None:
    error, outcome = crossed(
        CORNER,
        working_mode=ACROSS_MODE,
        segment_duration=0.33,
        blend_radius=0.038,
        robot=vertical_file(tmp_path),
        controller="unified",
        plant={"torque_limit": 2.5},
    )
    assert outcome == "succeeded"
    assert error < 1e-4
