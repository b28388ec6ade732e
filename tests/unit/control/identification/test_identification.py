# SPDX-License-Identifier: Apache-2.0
"""Identification from made-up records: what it finds in them, and which it refuses by name.

Motions are sums of sines in the motors' angles, torques are Pinocchio's for them, averaged over every period.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from fivebar_control.identification.cutoff import Cutoffs
from fivebar_control.identification.equations import PARAMETERS, Record, bridged, filtered_equations
from fivebar_control.identification.identification import NotIdentifiable, identify, parameter_values
from fivebar_control.identification.motor_map import map_motors
from fivebar_control.identification.regressor import platform_load
from fivebar_control.model.state import MotorMotion
from fivebar_description.parameters import FiveBar, scaled
from fivebar_description.robot_file import load_robot

Array = NDArray[np.float64]

RATE = 250.0
CENTRE = (1.57, 1.57)
"""Motor angles (rad) of dextar with both proximal links upright: det A > 0 with the platform above them."""

Waves = tuple[tuple[float, float, float], ...]
"""Amplitude (rad), frequency (Hz), phase."""

RICH: tuple[Waves, Waves] = (
    ((0.25, 0.61, 0.3), (0.06, 2.3, 1.0)),
    ((0.25, 0.83, 1.7), (0.06, 1.9, 0.2)),
)


def motion(waves: tuple[Waves, Waves], time: Array) -> tuple[Array, Array, Array]:
    """q, dq, ddq, each [n, 2]."""
    q, dq, ddq = (np.zeros((len(time), 2)) for _ in range(3))
    for motor in range(2):
        q[:, motor] = CENTRE[motor]
        for amplitude, frequency, phase in waves[motor]:
            w = 2.0 * math.pi * frequency
            q[:, motor] += amplitude * np.sin(w * time + phase)
            dq[:, motor] += amplitude * w * np.cos(w * time + phase)
            ddq[:, motor] -= amplitude * w**2 * np.sin(w * time + phase)
    return q, dq, ddq


@cache
def record(waves: tuple[Waves, Waves] = RICH, seconds: float = 16.0, residual: float = 0.0) -> Record:
    """The robot's record; every torque is the mean of five within the period before its sample."""
    robot = with_residual(load_robot("dextar"), residual)
    samples = int(seconds * RATE)
    q = motion(waves, np.arange(samples) / RATE)[0]
    torque = np.zeros((samples, 2))
    zz_1, zz_2, mass = parameter_values(robot)[:3]
    for part in (0.1, 0.3, 0.5, 0.7, 0.9):
        within, speed, acceleration = motion(waves, (np.arange(samples) - part) / RATE)
        for k in range(samples):
            row = MotorMotion(*within[k].tolist(), *speed[k].tolist(), *acceleration[k].tolist())
            load = platform_load(robot, 1, row)
            torque[k] += 0.2 * (np.array([zz_1, zz_2]) * acceleration[k] + mass * np.array([load.load1, load.load2]))
            torque[k] += 0.2 * np.array([load.known1, load.known2])
        for motor, leg in enumerate((robot.leg1, robot.leg2)):
            torque[:, motor] += 0.2 * (leg.coulomb * np.tanh(speed[:, motor] / leg.width) + leg.offset)
    return Record(RATE, q, torque, np.ones(samples))


def with_residual(robot: FiveBar, residual: float) -> FiveBar:
    """The robot with a residual inertia (kg m^2) of each distal link."""
    leg1, leg2 = (leg._replace(residual=residual) for leg in (robot.leg1, robot.leg2))
    return robot._replace(leg1=leg1, leg2=leg2)


@pytest.fixture(scope="module")
def robot() -> FiveBar:
    return load_robot("dextar")


def test_the_parameters_come_back(robot: FiveBar) -> None:
    """From a robot whose inertias, mass and friction are all wrong: they have no say."""
    found = identify(scaled(robot, 2.0, 0.5, 3.0), record())
    true = np.array(parameter_values(robot))
    assert found.fit.values[:7] == pytest.approx(true, rel=1e-3, abs=1e-4)
    assert found.fit.values[7:] == pytest.approx(np.zeros(5), abs=2e-4)
    assert not any(found.harmonics)
    assert found.fit.condition < 10.0
    assert max(found.misfit) < 1e-3


def test_readings_that_are_rounded_down_are_taken_half_a_count_further(robot: FiveBar) -> None:
    """On average they are the exact angles less half a count: the equations are the same as for those."""
    count, exact = 2.0 * math.pi / 500, record()
    cutoffs = Cutoffs(resolution=0.0, noise=1e-6, acceleration=1.0, derivative_hz=20.0, parallel_hz=5.0)
    wanted = filtered_equations(robot, exact, cutoffs)
    rounded = exact._replace(angles=exact.angles - 0.5 * count)
    found = filtered_equations(robot, rounded, cutoffs._replace(resolution=count))
    assert np.isfinite(wanted.regressor).any()
    np.testing.assert_allclose(found.regressor, wanted.regressor, rtol=1e-9, atol=1e-9)


def test_a_gap_is_left_out(robot: FiveBar) -> None:
    whole = record()
    angles, torques = whole.angles.copy(), whole.torques.copy()
    angles[1500:1510] = math.nan
    torques[1500:1510] = math.nan
    torques[1495:1500] = 77.0
    found = identify(robot, whole._replace(angles=angles, torques=torques))
    assert found.fit.values[:7] == pytest.approx(np.array(parameter_values(robot)), rel=1e-3, abs=1e-4)
    assert sum(found.used_s) < sum(identify(robot, whole).used_s)


def test_samples_that_are_missing_one_by_one_leave_no_gap(robot: FiveBar) -> None:
    """As of a busy machine: with every one of them left out, little would be left beside the filters' reach."""
    whole = record()
    angles, torques, assembly = whole.angles.copy(), whole.torques.copy(), whole.assembly.copy()
    lost = np.arange(600, len(angles) - 40, 60)
    angles[lost] = torques[lost] = math.nan
    assembly[lost] = math.nan
    found, exact = identify(robot, Record(RATE, angles, torques, assembly)), identify(robot, whole)
    assert found.fit.values == pytest.approx(exact.fit.values, rel=2e-3, abs=2e-4)
    assert found.used_s == pytest.approx(exact.used_s, abs=0.1)


def test_only_short_gaps_are_bridged_and_by_what_is_around_them() -> None:
    time = np.arange(40) / 500.0
    angles = np.stack([np.sin(9.0 * time), 0.2 * time**3], axis=1)
    torques, ones = np.stack([time, -time], axis=1), np.ones(40)
    holed = Record(500.0, angles.copy(), torques.copy(), ones.copy())
    for first, last in ((0, 1), (5, 8), (20, 29), (33, 34), (39, 40)):
        holed.angles[first:last] = holed.torques[first:last] = holed.assembly[first:last] = math.nan
    found = bridged(holed)
    assert np.flatnonzero(np.isnan(found.angles).any(axis=1)).tolist() == [0, *range(20, 29), 39]
    within = [5, 6, 7, 33]
    np.testing.assert_allclose(found.angles[within], angles[within], atol=2e-7)
    np.testing.assert_allclose(found.torques[within], torques[within], atol=1e-12)
    assert found.assembly[within].tolist() == [1.0] * 4
    assert np.isnan(holed.angles[5]).all()


def test_the_torques_of_the_wrong_period_are_noticed(robot: FiveBar) -> None:
    """One sample of shift is what an effort of the coming instead of the past period would be."""
    late = record()._replace(torques=np.roll(record().torques, -1, axis=0))
    assert max(identify(robot, late).misfit) > 10.0 * max(identify(robot, record()).misfit)


def still(motor: int) -> tuple[Waves, Waves]:
    return ((), RICH[1]) if motor == 1 else (RICH[0], ())


@pytest.mark.parametrize("motor", [1, 2])
def test_a_motor_that_stands_still_is_named(robot: FiveBar, motor: int) -> None:
    with pytest.raises(NotIdentifiable, match=f"not enough motion: motor {motor} turns faster than 0.06 rad/s"):
        identify(robot, record(still(motor), 6.0))


def test_a_short_record_is_refused(robot: FiveBar) -> None:
    whole = record()
    short = Record(RATE, whole.angles[:40], whole.torques[:40], whole.assembly[:40])
    with pytest.raises(NotIdentifiable, match="too short: 40 samples"):
        identify(robot, short)
    brief = Record(RATE, whole.angles[:250], whole.torques[:250], whole.assembly[:250])
    with pytest.raises(NotIdentifiable, match="too short: the filters' reach at ends and gaps leaves"):
        identify(robot, brief)


def test_a_motor_that_turns_one_way_leaves_friction_and_offset_together(robot: FiveBar) -> None:
    whole = record()
    backwards = motion(RICH, np.arange(len(whole.angles)) / RATE)[1][:, 0] < 0.0
    torques = whole.torques.copy()
    torques[backwards, 0] = math.nan
    with pytest.raises(NotIdentifiable, match="f_s11 and f_off11: the condition number"):
        identify(robot, whole._replace(torques=torques))


def test_without_the_assembly_mode_nothing_is_used(robot: FiveBar) -> None:
    with pytest.raises(NotIdentifiable, match="away from the Type 2 locus"):
        identify(robot, record()._replace(assembly=np.zeros(len(record().angles))))


def test_torques_of_the_other_sign_are_refused(robot: FiveBar) -> None:
    with pytest.raises(NotIdentifiable, match="comes out negative"):
        identify(robot, record()._replace(torques=-record().torques))


def test_torques_of_the_other_motor_are_refused(robot: FiveBar) -> None:
    with pytest.raises(NotIdentifiable, match=r"of the torque of motor \d unexplained"):
        identify(robot, record()._replace(torques=record().torques[:, ::-1]))


def test_noise_that_hides_a_parameter_is_refused(robot: FiveBar) -> None:
    """Slow motion has hardly any inertial torque."""
    slow = tuple(((0.3, 0.1 * (motor + 2), 0.0),) for motor in range(2))
    quiet = record((slow[0], slow[1]), 24.0)
    noise = 0.3 * np.random.default_rng(1).normal(size=quiet.torques.shape)
    with pytest.raises(NotIdentifiable, match=r"the motion determines (zz_11R|zz_21R|m) too poorly: "):
        identify(robot, quiet._replace(torques=quiet.torques + noise))


def test_parameters_are_in_the_order_of_their_names(robot: FiveBar) -> None:
    assert dict(zip(PARAMETERS, parameter_values(robot), strict=True)) == {
        "zz_11R": 0.0133,
        "zz_21R": 0.0142,
        "m": 0.537,
        "f_s11": 0.345,
        "f_s21": 0.43,
        "f_off11": 0.0855,
        "f_off21": 0.0,
    }


SLOW = (((0.7, 0.05, 0.3), (0.05, 1.3, 1.0)), ((0.7, 0.06, 1.7), (0.05, 1.1, 0.2)))
"""Through several periods of cogging at no more than a few of them a second, with something fast for the gains."""

GAINS = (1.04, 0.93)
COGGING = {7: (0.03, -0.02), 12: (-0.01, 0.015)}
"""Nm, cosine and sine by periods."""


def commanded(noise: float = 0.0, residual: float = 0.0) -> Record:
    """The record of motors that give more or less than their command, and cog; torques are the commanded ones."""
    known = record(SLOW, 18.0, residual)
    q = known.angles
    # the torque of a sample was held over the period before it
    middle = np.vstack([q[:1], 0.5 * (q[1:] + q[:-1])])
    needed = known.torques + sum(
        cosine * np.cos(periods * middle) + sine * np.sin(periods * middle)
        for periods, (cosine, sine) in COGGING.items()
    )
    random = np.random.default_rng(3).normal(0.0, noise, needed.shape) if noise else 0.0
    return known._replace(torques=needed / np.array(GAINS) + random)


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_gains_friction_and_cogging_come_back(robot: FiveBar, noise: float) -> None:
    maps = map_motors(robot, commanded(noise), tuple(COGGING))
    for found, gain, leg in zip(maps, GAINS, (robot.leg1, robot.leg2), strict=True):
        wanted = [(found.gain, gain), (found.coulomb, leg.coulomb / gain), (found.offset, leg.offset / gain)]
        for one, (cosine, sine) in zip(found.cogging, COGGING.values(), strict=True):
            wanted += [(one.cosine, cosine / gain), (one.sine, sine / gain)]
            wanted.append((one.amplitude, math.hypot(cosine, sine) / gain))
        for estimate, true in wanted:
            assert estimate.value == pytest.approx(true, rel=0.02, abs=2e-3)
            if noise:
                # fifteen values at 95 %: twice the half width holds all of them
                assert abs(estimate.value - true) < 2.0 * estimate.half_width


def test_motors_with_other_constants_that_cog_and_turn_in_oil_come_back_in_units_of_the_command(robot: FiveBar) -> None:
    """Without a word about the harmonics, which are seen, and with intervals that hold what is there."""
    noise = commanded(0.01)
    speed = np.gradient(noise.angles, 1.0 / RATE, axis=0)
    viscous = 0.02 / np.array(GAINS)
    found = identify(robot, noise._replace(torques=noise.torques + viscous * speed))
    assert [sorted(one) for one in found.harmonics] == [sorted(COGGING)] * 2
    one, two = GAINS
    leg1, leg2, mass = robot[:3]
    masses = 0.5 * mass * (1.0 / one + 1.0 / two), 0.5 * mass * (1.0 / one - 1.0 / two)
    friction = leg1.coulomb / one, leg2.coulomb / two, leg1.offset / one, leg2.offset / two
    true = np.array([leg1.inertia / one, leg2.inertia / two, masses[0], *friction, *viscous, 0.0, masses[1], 0.0])
    left = np.abs(found.fit.values[:12] - true)
    # twelve values at 95 %: one and a half times the half width holds all of them
    assert np.all(left < 1.5 * found.fit.half_widths[:12])
    assert np.all(found.fit.half_widths[3:5] < 0.03 * true[3:5])
    ratio, half = found.constants_ratio()
    assert abs(ratio - two / one) < half < 0.1


def test_the_gain_applies_to_what_residual_inertias_need(robot: FiveBar) -> None:
    """They are given, as actual torque: taken off the commanded one as they are, they would pull the gain towards 1."""
    residual = -0.002
    maps = map_motors(with_residual(robot, residual), commanded(residual=residual), tuple(COGGING))
    plain = map_motors(robot, commanded(), tuple(COGGING))
    for found, without, gain in zip(maps, plain, GAINS, strict=True):
        assert found.gain.value == pytest.approx(gain, rel=2e-3)
        assert abs(found.gain.value - gain) < 2.0 * abs(without.gain.value - gain) + 2e-4


def test_cogging_that_is_not_there_is_within_its_interval(robot: FiveBar) -> None:
    (first, _) = map_motors(robot, commanded(0.02), (*COGGING, 9))
    assert first.cogging[-1].amplitude.value < 3.0 * first.cogging[-1].amplitude.half_width + 1e-4


def test_a_motion_through_too_few_periods_is_refused(robot: FiveBar) -> None:
    short = commanded()
    count = int(2.6 * RATE)
    some = short._replace(angles=short.angles[:count], torques=short.torques[:count], assembly=short.assembly[:count])
    with pytest.raises(NotIdentifiable, match="does not distinguish gains, friction and these harmonics"):
        map_motors(robot, some, tuple(COGGING))
