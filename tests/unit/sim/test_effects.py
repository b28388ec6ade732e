# SPDX-License-Identifier: Apache-2.0
"""Effects of the simulated robot: energies, limits and laws that their equations must keep."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mechanism_energy import energy
from scipy.integrate import simpson

from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import state_from_joints
from fivebar_description.parameters import FiveBar
from fivebar_description.settings import as_numbers
from fivebar_description.strict_yaml import InputError
from fivebar_description.transmission import Transmission
from fivebar_sim.effects.cable import Cable, cable_force
from fivebar_sim.effects.encoders import EncoderDisc, EncoderErrors, angle_seen_as, seen
from fivebar_sim.effects.friction import FrictionCurve, FrictionEffects, bristle_after, friction, stribeck
from fivebar_sim.effects.heating import Heating
from fivebar_sim.effects.links import LinkErrors, with_another_model, with_links
from fivebar_sim.effects.loads import LOCUS, Push, Tilt, Vibration, push_at
from fivebar_sim.effects.mechanism import MAX_STEP, Mechanism, actual_robot, mechanism_of
from fivebar_sim.effects.mechanism_state import MechanismState
from fivebar_sim.effects.motion import advanced, closed, started
from fivebar_sim.effects.motors import MotorEffects, current_after, motor_of, motor_torque
from fivebar_sim.effects.observation import joints_of
from fivebar_sim.effects.platform_joint import PlatformJoint, joint_force
from fivebar_sim.effects.settings import PlantSettings, has_effects, without_effects
from fivebar_sim.effects.supply import Supply, supplied_share
from fivebar_sim.effects.timing import BusEffects, lost_commands
from fivebar_sim.effects.transmission import transmitted
from fivebar_sim.plant import Plant
from fivebar_sim.sensors import TorqueOutput

RATE = 500
HOME = (0.0, 0.13)
ELASTIC = Transmission(60.0, 0.0, 0.7)
COMPLIANT = PlatformJoint(3e5, 0.0)
LUGRE = FrictionCurve(0.3, 0.45, 0.1, 0.02, 0.05, 0.02, 300.0, 0.4)


def home(robot: FiveBar) -> tuple[float, ...]:
    return tuple(inverse_geometry(robot, (1, -1), *HOME))


def frictionless(**effects: Any) -> PlantSettings:
    return PlantSettings(friction_scale=0.0, **effects)


def moving(robot: FiveBar, plant: PlantSettings, speed1: float, speed2: float) -> tuple[Mechanism, MechanismState]:
    """A mechanism whose motors turn, on the closed loop where it is rigid."""
    mechanism = mechanism_of(robot, plant, RATE)
    state = started(mechanism, *home(robot)).state
    rate = state.rate._replace(link1=speed1, link2=speed2, rotor1=speed1, rotor2=speed2)
    return mechanism, closed(mechanism, state._replace(rate=rate)).state


def after(
    mechanism: Mechanism, state: MechanismState, samples: int, tau1: float = 0.0, tau2: float = 0.0
) -> MechanismState:
    for number in range(samples):
        moved = advanced(mechanism, state, number, tau1, tau2)
        assert math.isfinite(moved.gap)
        state = moved.state
    return state


def test_no_effect_is_on_by_default() -> None:
    assert not has_effects(PlantSettings(mass_scale=1.1, encoder_counts=4096, delay_samples=1, seed=3))
    one = PlantSettings(tilt=Tilt(0.01))
    assert has_effects(one) and not has_effects(without_effects(one))


def test_with_effects_of_size_zero_the_mechanism_is_pinocchios_robot(robot: FiveBar) -> None:
    """A push that never comes: the same robot by other equations, with the same step and another projection."""
    ours = Plant(robot, home(robot), RATE, PlantSettings(push=Push(start=1e6)))
    theirs = Plant(robot, home(robot), RATE)
    for number in range(150):
        torque = 0.9 * math.cos(0.1 * number), -0.7
        ours.advance(torque)
        theirs.advance(torque)
    np.testing.assert_allclose(ours.joints, theirs.joints, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(ours.measure_imu().acceleration, theirs.measure_imu().acceleration, rtol=0.0, atol=1e-4)
    assert math.dist(ours.joints.tolist(), home(robot)) > 0.05


@pytest.mark.parametrize(
    "effects",
    [
        {"push": Push(start=1e6)},
        {"transmission": ELASTIC},
        {"platform_joint": COMPLIANT},
        {"transmission": ELASTIC, "platform_joint": COMPLIANT},
        {"links": LinkErrors(l_11=1e-4, distal_inertia=-5e-4)},
        {"links": LinkErrors(distal_mass=0.05, distal_centre=0.4, base_rise=1e-3, base_height=5e-3)},
        {"cable": Cable(stiffness=30.0, anchor_x=0.05)},
    ],
    ids=["rigid", "elastic", "compliant", "both", "links", "heavy links", "cable"],
)
def test_without_damping_and_friction_energy_stays(effects: dict[str, Any], dextar: FiveBar) -> None:
    """Through the Type 2 locus: what the integrator takes is less than a damping ratio of 2e-4, and falls with h^5."""
    mechanism, state = moving(dextar, frictionless(**effects), 3.0, -3.0)
    before = sum(energy(mechanism, state))

    def lost(steps: int) -> float:
        finer = mechanism._replace(step=mechanism.period / steps)
        total = energy(mechanism, after(finer, state, 100))
        springs = mechanism.elastic or mechanism.compliant or mechanism.cable.stiffness > 0.0
        assert (total.elastic > 1e-4 * total.kinetic) == springs
        return abs(sum(total) / before - 1.0)

    steps = round(mechanism.period / mechanism.step)
    coarse, fine = lost(steps), lost(2 * steps)
    assert coarse < 2e-3
    assert fine < max(coarse / 16.0, 1e-10)


@pytest.mark.parametrize(
    "effects",
    [{"transmission": Transmission(60.0, 0.1, 0.7)}, {"platform_joint": PlatformJoint(3e5, 0.2)}],
    ids=["transmission", "loop"],
)
def test_damping_takes_energy_at_every_sample(effects: dict[str, Any], dextar: FiveBar) -> None:
    mechanism, state = moving(dextar, frictionless(**effects), 3.0, -3.0)
    energies = [sum(energy(mechanism, state))]
    for _ in range(60):
        state = after(mechanism, state, 1)
        energies.append(sum(energy(mechanism, state)))
    assert all(later <= earlier * (1.0 + 1e-6) for earlier, later in pairwise(energies))
    assert energies[-1] < 0.999 * energies[0]


@pytest.mark.parametrize(
    "effects",
    [
        {"transmission": ELASTIC},
        {"platform_joint": COMPLIANT},
        {"friction": FrictionEffects(presliding=5e-3), "motors": MotorEffects(current_loop_hz=100.0)},
    ],
    ids=["elastic", "compliant", "presliding"],
)
def test_errors_fall_with_the_fourth_power_of_the_step(effects: dict[str, Any], dextar: FiveBar) -> None:
    """In presliding, too, where the bristles are springs; the torque is too small to slide."""
    mechanism = mechanism_of(dextar, PlantSettings(**effects), RATE)
    state = started(mechanism, *home(dextar)).state
    torque = (0.1, -0.05) if "friction" in effects else (0.9, -0.7)
    if "friction" not in effects:
        mechanism, state = moving(dextar, frictionless(**effects), 1.0, -1.0)

    def end(steps: int) -> np.ndarray[Any, np.dtype[np.float64]]:
        finer = mechanism._replace(step=mechanism.period / steps)
        return np.array(after(finer, state, 10, *torque).at)

    first = max(round(mechanism.period / mechanism.step), 3)
    exact = end(16 * first)
    coarse, fine = (np.abs(end(steps) - exact).max() for steps in (first, 2 * first))
    assert coarse > 1e-11
    assert coarse / fine > 10.0


def test_a_stiff_robot_is_nearly_a_rigid_one(dextar: FiveBar) -> None:
    stiff = frictionless(transmission=Transmission(1500.0, 1.0, 0.5), platform_joint=PlatformJoint(1e8, 1.0))
    ends = []
    for plant in (stiff, frictionless(push=Push(start=1e6))):
        mechanism = mechanism_of(dextar, plant, RATE)
        ends.append(np.array(joints_of(after(mechanism, started(mechanism, *home(dextar)).state, 50, 0.8, -0.6)))[:4])
    np.testing.assert_allclose(*ends, rtol=0.0, atol=2e-4)
    assert np.abs(ends[0] - home(dextar)).max() > 0.05


def test_the_step_follows_the_stiffest_effect(dextar: FiveBar) -> None:
    def step(**effects: Any) -> float:
        return mechanism_of(dextar, PlantSettings(**effects), RATE).step

    assert step(tilt=Tilt(0.1)) == pytest.approx(MAX_STEP)
    soft, stiff = step(platform_joint=PlatformJoint(1e5)), step(platform_joint=PlatformJoint(1e7))
    assert stiff < 0.2 * soft
    assert step(transmission=Transmission(500.0)) < step(transmission=Transmission(250.0)) < MAX_STEP


@given(z=st.floats(-9e-4, 9e-4), moved=st.floats(-0.1, 0.1), parts=st.integers(2, 9), speed=st.floats(1e-3, 10.0))
def test_a_bristle_ends_alike_however_its_way_is_divided(z: float, moved: float, parts: int, speed: float) -> None:
    """The solution is exact at constant speed, for any step: also one of hundreds of its time constants."""
    time = abs(moved) / speed if moved else 1e-3
    whole = bristle_after(LUGRE, z, moved, time)
    divided = z
    for _ in range(parts):
        divided = bristle_after(LUGRE, divided, moved / parts, time / parts)
    assert divided == pytest.approx(whole, abs=1e-12)
    assert abs(whole) <= max(abs(z), LUGRE.breakaway / LUGRE.stiffness) + 1e-15


def test_near_rest_lugre_is_a_spring() -> None:
    for moved in (1e-7, -1e-7):
        z = bristle_after(LUGRE, 0.0, moved, 1.0)
        assert friction(LUGRE, z, 0.0) - LUGRE.offset == pytest.approx(LUGRE.stiffness * moved, rel=1e-3)


@pytest.mark.parametrize("speed", [0.01, 0.1, 0.3, 2.0, -0.05, -1.0])
@pytest.mark.parametrize("curve", [LUGRE, LUGRE._replace(stiffness=0.0, width=1e-6)], ids=["lugre", "tanh"])
def test_steady_sliding_follows_the_stribeck_curve(curve: FrictionCurve, speed: float) -> None:
    z = bristle_after(curve, 0.0, 10.0 * math.copysign(1.0, speed), 10.0 / abs(speed))
    level = 0.3 + 0.15 * math.exp(-((speed / 0.1) ** 2))
    assert stribeck(curve, speed) == pytest.approx(level)
    wanted = math.copysign(level, speed) + 0.02 * speed + 0.05
    assert friction(curve, z, speed) == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize(("torque", "slides"), [(0.7, False), (1.4, True)])
def test_a_motor_holds_below_break_away_and_slides_beyond(torque: float, slides: bool, dextar: FiveBar) -> None:
    plant = PlantSettings(friction=FrictionEffects(stribeck=1.3, presliding=1e-3, presliding_damping=1.0))
    mechanism = mechanism_of(dextar, plant, RATE)
    start = started(mechanism, *home(dextar)).state
    leg = dextar.leg1
    state = start
    for number in range(200):
        state = advanced(mechanism, state, number, leg.offset + number / 200 * torque * 1.3 * leg.coulomb, 0.0).state
    moved = state.at.link1 - start.at.link1
    if slides:
        assert moved > 0.02
    else:
        # at constant g a monotonic load creeps to q = -(g / s0) ln(1 - tau / g), here with g = 1.3 f_c
        assert moved == pytest.approx(-1.3e-3 * math.log(1.0 - torque), rel=0.05)
        assert abs(state.rate.link1) < 0.02


@pytest.mark.parametrize(
    ("twist", "rate", "torque"),
    [
        (0.5e-3, 0.0, 0.0),
        (-1e-3, 3.0, 0.0),
        (1.5e-3, 0.0, 0.5),
        (-3e-3, 0.0, -2.0),
        (1.5e-3, 0.02, 0.7),
        (1.5e-3, -0.06, 0.0),
        (-1.5e-3, 0.06, 0.0),
    ],
)
def test_backlash_is_a_dead_zone_whose_flanks_never_pull(twist: float, rate: float, torque: float) -> None:
    """Stiffness 1000 Nm/rad, damping 10 Nm s/rad, 2 mrad of play."""
    assert transmitted(1000.0, 10.0, 1e-3, twist, rate) == pytest.approx(torque, abs=1e-12)


def test_a_link_in_its_backlash_moves_freely(dextar: FiveBar) -> None:
    plant = frictionless(transmission=Transmission(300.0, 0.04, 0.7, 0.02))
    mechanism = mechanism_of(dextar, plant, RATE)
    state = started(mechanism, *home(dextar)).state
    state = state._replace(rate=state.rate._replace(rotor1=0.5, rotor2=-0.5))
    free = after(mechanism, state, 9)
    assert free.at.link1 == state.at.link1 and free.rate.rotor1 == 0.5
    assert 0.005 < free.at.rotor1 - free.at.link1 < 0.01
    assert after(mechanism, free, 10).rate.link1 > 0.1


def test_a_joint_with_clearance_carries_nothing_within_it() -> None:
    assert joint_force(1e6, 10.0, 1e-5, 6e-6, -7e-6, 0.1, 0.2) == (0.0, 0.0)
    x, y = joint_force(1e6, 0.0, 1e-5, 1.2e-5, 1.6e-5, 0.1, 0.2)
    assert (x, y) == pytest.approx((6.0, 8.0))
    # the damper alone would pull
    assert joint_force(1e6, 1e3, 1e-5, 1.2e-5, 1.6e-5, -0.1, -0.2) == (0.0, 0.0)


def test_a_joint_with_clearance_stays_within_it(dextar: FiveBar) -> None:
    mechanism = mechanism_of(dextar, frictionless(platform_joint=PlatformJoint(1e6, 0.05, 5e-5)), RATE)
    state, gaps = started(mechanism, *home(dextar)).state, []
    for number in range(60):
        moved = advanced(mechanism, state, number, 0.3, -0.2)
        state = moved.state
        gaps.append(moved.gap)
    assert 5e-5 < max(gaps) < 7e-5


@pytest.mark.parametrize("presliding", [0.0, 1e-3], ids=["tanh", "lugre"])
def test_passive_friction_takes_exactly_the_work_that_it_does(presliding: float, dextar: FiveBar) -> None:
    """The motors turn without friction: what is lost is the work in elbows and platform, which is never negative."""
    smooth = FiveBar(dextar.leg1._replace(width=0.5), dextar.leg2._replace(width=0.5), dextar.mass)
    plant = frictionless(friction=FrictionEffects(passive=0.02, presliding=presliding))
    mechanism = mechanism_of(smooth, plant, 1000)
    state = started(mechanism, *home(smooth)).state
    state = closed(mechanism, state._replace(rate=state.rate._replace(link1=2.0, link2=-1.0))).state
    energies, powers = [], []
    for number in range(151):
        energies.append(sum(energy(mechanism, state)))
        rate, z = state.rate, state.bristles
        speeds = rate.distal1 - rate.link1, rate.distal2 - rate.link2, rate.distal1 - rate.distal2
        curves = mechanism.leg1.elbow_friction, mechanism.leg2.elbow_friction, mechanism.platform_friction
        deflections = z.elbow1, z.elbow2, z.platform
        powers.append(sum(friction(c, d, v) * v for c, d, v in zip(curves, deflections, speeds, strict=True)))
        state = advanced(mechanism, state, number, 0.0, 0.0).state
    lost = energies[0] - energies[-1]
    assert lost > 0.005
    if presliding == 0.0:
        assert min(powers) >= 0.0
        assert lost == pytest.approx(simpson(powers, dx=1e-3), rel=1e-6)
    else:
        # the bristles give back what they hold; what is missing they hold at the end
        assert lost == pytest.approx(simpson(powers, dx=1e-3), rel=0.02)


def test_a_motor_has_gain_ripple_cogging_and_a_lag() -> None:
    motor = motor_of(MotorEffects(ripple=0.1, ripple_periods=4.0, cogging=0.04, cogging_periods=6.0), 0.05, 0.3, 0.7)
    for angle in (0.0, 0.4, 2.0):
        wanted = 2.1 * (1.0 + 0.1 * math.sin(4.0 * angle + 0.3)) + 0.04 * math.sin(6.0 * angle + 0.7)
        assert motor_torque(motor, 2.0, angle) == pytest.approx(wanted)
    assert current_after(1.0, 3.0, 0.0, 1e-9) == 3.0
    assert current_after(1.0, 3.0, 100.0, 0.01) == pytest.approx(3.0 - 2.0 / math.e)


def test_phases_follow_the_seed(dextar: FiveBar) -> None:
    effects = MotorEffects(cogging=0.04)
    phases = [mechanism_of(dextar, PlantSettings(motors=effects, seed=seed), RATE).leg1.motor for seed in (1, 1, 2)]
    assert phases[0] == phases[1] != phases[2]


def test_a_tilted_base_pulls_the_platform_downhill(dextar: FiveBar) -> None:
    """One second of a free robot: it swings about the lowest point; its energy is that of its fall."""
    plant = frictionless(tilt=Tilt(0.1, -math.pi / 2))
    mechanism = mechanism_of(dextar, plant, RATE)
    state = started(mechanism, *home(dextar)).state
    state = after(mechanism, state, 100)
    there = state_from_joints(dextar, *joints_of(state))
    fall = dextar.mass * 9.80665 * math.sin(0.1) * (HOME[1] - there.y)
    assert fall > 1e-3
    assert energy(mechanism, state).kinetic == pytest.approx(fall, rel=1e-5)


def test_a_resting_accelerometer_feels_the_slope(dextar: FiveBar) -> None:
    """Held by presliding friction, it reads the reaction to gravity along the distal link."""
    plant = Plant(
        dextar, home(dextar), RATE, PlantSettings(tilt=Tilt(0.1, 0.3), friction=FrictionEffects(stribeck=2.0))
    )
    plant.advance((dextar.leg1.offset, 0.0))
    x, y, _ = plant.measure_imu().acceleration
    assert math.hypot(x, y) == pytest.approx(9.80665 * math.sin(0.1), rel=0.2)


def test_a_push_acts_for_its_time_and_in_its_direction() -> None:
    push = as_numbers(Push(2.0, 0.3, "plane", 1.0, 0.05))
    assert push_at(push, 0.999, 1.0, 0.0) == push_at(push, 1.05, 1.0, 0.0) == (0.0, 0.0)
    assert push_at(push, 1.01, 0.6, 0.8) == pytest.approx((2.0 * math.cos(0.3), 2.0 * math.sin(0.3)))
    across = as_numbers(Push(2.0, 0.0, LOCUS, 1.0, 0.05))
    assert push_at(across, 1.01, 0.6, 0.8) == pytest.approx((-1.6, 1.2))


def test_a_free_robot_stays_behind_a_base_that_vibrates(dextar: FiveBar) -> None:
    """Along its line of symmetry: the platform's inertia there is that of the mass and of both legs' motors."""
    free = FiveBar(*(leg._replace(inertia=1e-9, offset=0.0) for leg in dextar[:2]), dextar.mass)
    mechanism = mechanism_of(free, frictionless(vibration=Vibration(1e-4, 15.0, math.pi / 2.0), seed=3), RATE)
    state = started(mechanism, *home(free)).state
    shaking = mechanism.shaking
    assert math.hypot(shaking.x, shaking.y) == pytest.approx(1e-4 * (30.0 * math.pi) ** 2)
    # without other forces the platform keeps still in space, where the base was when it began
    velocity = 1e-4 * shaking.pulsation * math.cos(shaking.phase)
    for number in range(60):
        state = advanced(mechanism, state, number, 0.0, 0.0).state
        time = (number + 1) / RATE
        base = 1e-4 * (math.sin(shaking.pulsation * time + shaking.phase) - math.sin(shaking.phase))
        y = state_from_joints(free, *joints_of(state)).y
        assert y - HOME[1] == pytest.approx(velocity * time - base, abs=1e-7)
    feels = [
        Plant(dextar, home(dextar), RATE, PlantSettings(vibration=Vibration(a))).measure_imu() for a in (1e-4, 0.0)
    ]
    assert math.dist(feels[0].acceleration, feels[1].acceleration) > 0.01


def test_a_cable_drags_always_and_pulls_only_where_it_is_taut() -> None:
    assert cable_force(Cable(), 0.1, 0.2) == (0.0, 0.0)
    cable = Cable(0.5, math.pi / 2.0, 20.0, 0.1, 0.3, 0.4)
    assert cable_force(cable, 0.3, 0.32) == pytest.approx((0.0, 0.5))
    # 0.5 m away, 0.4 m beyond its length: 8 N
    assert cable_force(cable, 0.0, 0.0) == pytest.approx((4.8, 6.9))


@pytest.mark.parametrize("change", [-0.5, 1.0])
def test_friction_changes_with_its_own_work(change: float, dextar: FiveBar) -> None:
    """The heat is the work of the friction; what is not lost to cooling changes it."""
    plant = PlantSettings(heating=Heating(change, 2.0, 0.5))
    mechanism = mechanism_of(dextar, plant, RATE)
    cold = mechanism_of(dextar, PlantSettings(tilt=Tilt(1e-9)), RATE)
    one, other = (after(each, started(each, *home(dextar)).state, 40, 1.2, -1.2) for each in (mechanism, cold))
    assert other.bristles.heat1 == 0.0
    turned = one.at.link1 - home(dextar)[0]
    heat = one.bristles.heat1
    assert 0.0 < heat < dextar.leg1.coulomb * turned * (1.0 + max(0.0, change))
    assert (one.rate.link1 > other.rate.link1) == (change < 0.0)
    rested = after(mechanism, one._replace(rate=started(mechanism, *home(dextar)).state.rate), 1, 0.0, 0.0)
    assert rested.bristles.heat1 == pytest.approx(heat * math.exp(-1.0 / RATE / 0.5), rel=2e-3)


def test_a_supply_sags_with_the_power_of_both_motors(dextar: FiveBar) -> None:
    supply = Supply(20.0, 5.0)
    assert supplied_share(Supply(), 2.0, 9.0, 2.0, 9.0) == 1.0
    assert supplied_share(supply, 2.0, 0.0, 0.0, 3.0) == pytest.approx(0.5)
    assert supplied_share(supply, 1.0, 8.0, -1.0, -2.0) == pytest.approx(0.5)
    # what brakes gives power back
    assert supplied_share(supply, 1.0, -30.0, 0.0, 0.0) == 1.0
    sagging = mechanism_of(dextar, frictionless(supply=supply), RATE)
    exact = mechanism_of(dextar, frictionless(tilt=Tilt(1e-9)), RATE)
    rates = [after(one, started(one, *home(dextar)).state, 1, 2.0, 0.0).rate.link1 for one in (sagging, exact)]
    assert rates[0] / rates[1] == pytest.approx(0.5, abs=0.03)


def test_a_heavy_distal_link_is_its_point_masses_and_the_inertia_about_its_centre(dextar: FiveBar) -> None:
    """A bar with its centre in the middle: half of it at each end, less a third of what that is too much."""
    bar, length = 0.06, dextar.leg1.distal
    heavy = mechanism_of(dextar, PlantSettings(links=LinkErrors(distal_mass=bar)), RATE)
    grouped = FiveBar(
        *(leg._replace(inertia=leg.inertia + 0.5 * bar * leg.proximal**2) for leg in dextar[:2]), dextar.mass + bar
    )
    lumped = mechanism_of(grouped, PlantSettings(links=LinkErrors(distal_inertia=-bar * length**2 / 6.0)), RATE)
    for name in ("inertia", "coupling", "distal_inertia"):
        assert getattr(heavy.leg1, name) == pytest.approx(getattr(lumped.leg1, name), rel=1e-12)
    # all of it weighs on the elbow, half of it at the end
    assert (heavy.leg1.moment, heavy.leg1.distal_moment) == pytest.approx(
        (bar * dextar.leg1.proximal, 0.5 * bar * length)
    )


def test_a_raised_base_turns_the_frame_and_shortens_the_links(dextar: FiveBar) -> None:
    raised = PlantSettings(links=LinkErrors(base_rise=1e-3, base_height=4e-3))
    actual, mechanism = actual_robot(dextar, raised), mechanism_of(dextar, raised, RATE)
    apart = dextar.leg2.base_x - dextar.leg1.base_x
    assert actual.leg2.base_x - actual.leg1.base_x == pytest.approx(math.hypot(apart, 1e-3), rel=1e-12)
    assert actual.leg1.distal == pytest.approx(math.sqrt(dextar.leg1.distal**2 - 2e-3**2), rel=1e-12)
    assert mechanism.leg1.disc.zero == mechanism.leg2.disc.zero == pytest.approx(1e-3 / apart, rel=1e-3)
    with pytest.raises(InputError, match=r"plant\.links\.base_height: 0\.1: .* climb half of it: expected below"):
        actual_robot(
            FiveBar(dextar.leg1._replace(distal=0.04), *dextar[1:]), PlantSettings(links=LinkErrors(base_height=0.1))
        )


@given(st.floats(-3.0, 3.0), st.floats(-0.1, 0.1), st.floats(0.0, 0.1), st.floats(0.0, 6.3))
def test_an_angle_is_found_from_its_reading(angle: float, zero: float, amplitude: float, phase: float) -> None:
    disc = EncoderDisc(zero, amplitude, phase)
    assert angle_seen_as(disc, seen(disc, angle, 0.0).angle) == pytest.approx(angle, abs=1e-12)
    ahead, behind = seen(disc, angle + 1e-6, 0.0).angle, seen(disc, angle - 1e-6, 0.0).angle
    assert seen(disc, angle, 2.0).speed == pytest.approx((ahead - behind) / 1e-6, abs=1e-6)


def test_the_robot_starts_where_its_encoders_say(dextar: FiveBar) -> None:
    """Lengths and zeros put the platform elsewhere; the readings are those of the modelled posture all the same."""
    effects = PlantSettings(
        links=LinkErrors(l_11=2e-4, l_22=-2e-4, base_1=1e-4), encoders=EncoderErrors(3e-3, -2e-3, 5e-4)
    )
    plant = Plant(dextar, home(dextar), RATE, effects)
    assert plant.measure().of_motors()[0] == pytest.approx(home(dextar)[::2], abs=1e-12)
    there = state_from_joints(actual_robot(dextar, effects), *plant.joints.tolist(), 0.0, 0.0, 0.0, 0.0)
    assert 1e-4 < math.dist((there.x, there.y), HOME) < 2e-3


def test_a_robot_stays_the_same_beside_another_model_of_it(dextar: FiveBar) -> None:
    links = LinkErrors(1e-4, -2e-4, 3e-4, -1e-4, 2e-4, -3e-4, -7e-5)
    model = with_links(dextar, LinkErrors(2e-4, 1e-4, -1e-4, 0.0, 1e-4))
    left = with_another_model(links, dextar, model)
    for leg, expected in zip(with_links(model, left)[:2], with_links(dextar, links)[:2], strict=True):
        assert leg == pytest.approx(expected, abs=1e-15)
    assert left.distal_inertia == links.distal_inertia


def test_motor_encoders_are_on_the_rotors_side(dextar: FiveBar) -> None:
    plant = Plant(dextar, home(dextar), RATE, frictionless(transmission=Transmission(30.0, 0.04, 0.7)))
    for _ in range(5):
        plant.advance((1.5, -1.5))
    read, there = plant.measure(), plant.truth()
    assert read.position[0] - there.position[0] > 1e-3
    assert read.position[1] == there.position[1]


def test_a_lost_command_holds_the_one_before() -> None:
    for delay in (0, 2):
        drives = TorqueOutput(PlantSettings(delay_samples=delay), {1, 4})
        applied = [drives.apply((float(number + 1), 0.0))[0] for number in range(8)]
        assert applied == [0.0] * delay + [1.0, 1.0, 3.0, 4.0, 4.0, 6.0, 7.0, 8.0][: 8 - delay]


def test_lost_commands_follow_the_seed_within_their_time() -> None:
    bus = BusEffects(3, 0.5, 0.2)
    chosen = lost_commands(bus, 7, RATE)
    assert chosen == lost_commands(bus, 7, RATE) != lost_commands(bus, 8, RATE)
    assert len(set(chosen)) == 3 and all(250 <= number < 350 for number in chosen)


@pytest.mark.parametrize(
    ("effects", "words"),
    [
        ({"transmission": Transmission(backlash=1e-3)}, "plant.transmission.backlash: .* expected plant.transm"),
        ({"platform_joint": PlatformJoint(clearance=1e-5)}, "plant.platform_joint.clearance: .* expected platform_j"),
        ({"links": LinkErrors(distal_inertia=-0.05)}, "plant.links.distal_inertia: -0.05 kg m.2 leaves a leg without"),
    ],
)
def test_effects_that_contradict_each_other_are_refused(effects: Any, words: str, dextar: FiveBar) -> None:
    with pytest.raises(InputError, match=words):
        Plant(dextar, home(dextar), RATE, PlantSettings(**effects))
