# SPDX-License-Identifier: Apache-2.0
"""Transmissions come back from a chirp on the two-mass model; a rigid robot and unsuitable records are refused."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from scipy.linalg import expm

from fivebar_control.identification.equations import Record
from fivebar_control.identification.identification import NotIdentifiable
from fivebar_control.identification.resonance import (
    FloatArray,
    NoResonance,
    OnlyBounded,
    elastic_model,
    find_resonance,
    inertia_at,
    rigid_model,
)
from fivebar_control.laws.chirp import HIGHEST, ChirpSettings, chirp
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import assembly_mode, state_from_platform
from fivebar_description.robot_file import load_robot

ROBOT = load_robot("dextar")
RATE, COUNT = 500.0, 2.0 * math.pi / 20_000
HOME = inverse_geometry(ROBOT, (1, -1), 0.0, 0.13)
ASSEMBLY = float(assembly_mode(state_from_platform(ROBOT, (1, -1), 0.0, 0.13, 0.0, 0.0)))
SWEEPS = ChirpSettings(amplitude=1.8, from_hz=10.0, sweep=3.0)
TWO_AMPLITUDES = SWEEPS._replace(fall=0.6)
GIVEN = np.array([ROBOT.leg1.inertia, ROBOT.leg2.inertia])


def linear_model(frequencies: tuple[float, float] | None, share: float) -> tuple[FloatArray, FloatArray]:
    """Return the matrices of the linear model."""
    still = Record(RATE, np.array([[HOME.q11, HOME.q21]]), np.zeros((1, 2)), np.array([ASSEMBLY]))
    inertia = inertia_at(ROBOT, still)
    if frequencies is None:
        return rigid_model(inertia)
    odds = math.log(share / (1.0 - share))
    legs = np.array([[math.log(one), math.log(0.04), odds, 0.0, 0.0] for one in frequencies])
    return elastic_model(inertia, GIVEN, legs)


def chirped(
    frequencies: tuple[float, float] | None,
    share: float = 0.7,
    against: bool = True,
    late: Sequence[int] = (0,) * 3000,
    settings: ChirpSettings = SWEEPS,
) -> Record:
    """Return counted angles of the linear model without friction under a chirp.

    Each sample is read, and the next torque applied, by some tenths of a period late.
    """
    samples = len(late)
    system, entry = linear_model(frequencies, share)
    size = len(system)
    whole = np.zeros((size + 2, size + 2))
    whole[:size, :size], whole[:size, size:] = system / RATE, entry / RATE
    steps = [expm(tenths / 10.0 * whole) for tenths in range(20)]
    wanted = np.array([chirp(settings, k / RATE, HIGHEST * RATE) for k in range(samples)])
    if not against:
        wanted[:, 1] = wanted[:, 0]
    state, angles, torques = np.zeros(size), np.zeros((samples, 2)), np.zeros((samples, 2))
    for number in range(1, samples):
        # rates follow all angles
        torques[number] = wanted[number] - GIVEN * (100.0 * state[:2] + 20.0 * state[size // 2 : size // 2 + 2])
        step = steps[10 + late[number] - late[number - 1]]
        state = step[:size, :size] @ state + step[:size, size:] @ torques[number]
        angles[number] = state[:2]
    return recorded(angles, torques)


def played(frequency: float, play: float, settings: ChirpSettings, seconds: float) -> Record:
    """Return the same on transmissions with play (rad), whose springs and dampers act where the flanks touch."""
    samples, parts = round(seconds * RATE), 16
    still = Record(RATE, np.array([[HOME.q11, HOME.q21]]), np.zeros((1, 2)), np.array([ASSEMBLY]))
    rotors = 0.7 * GIVEN
    links, pulsation = np.linalg.inv(inertia_at(ROBOT, still) - np.diag(rotors)), 2.0 * math.pi * frequency
    at, rate = np.zeros((2, 2)), np.zeros((2, 2))
    angles, torques = np.zeros((samples, 2)), np.zeros((samples, 2))
    for number in range(1, samples):
        hold = GIVEN * (100.0 * at[0] + 20.0 * rate[0])
        torques[number] = np.array(chirp(settings, number / RATE, HIGHEST * RATE)) - hold
        for _ in range(parts):
            turned, turning = at[0] - at[1], rate[0] - rate[1]
            bent = turned - np.clip(turned, -0.5 * play, 0.5 * play)
            spring = GIVEN * pulsation * np.where(bent == 0.0, 0.0, pulsation * bent + 0.08 * turning)
            rate += np.array([(torques[number] - spring) / rotors, links @ spring]) / RATE / parts
            at += rate / RATE / parts
        angles[number] = at[0]
    return recorded(angles, torques)


def recorded(angles: FloatArray, torques: FloatArray) -> Record:
    """Return a record of angles from home, counted."""
    # a slow motion turns the encoders through many counts, whose rounding is noise then
    angles = angles + np.array([HOME.q11, HOME.q21]) + np.linspace(0.0, 0.03, len(angles))[:, None]
    return Record(RATE, COUNT * np.round(angles / COUNT), torques, np.full(len(angles), ASSEMBLY))


def with_gaps(record: Record, places: Sequence[int], length: int) -> Record:
    """Leave some samples out at each of these places, as where a machine stood still."""
    angles, torques = record.angles.copy(), record.torques.copy()
    for place in places:
        angles[place : place + length] = torques[place : place + length] = np.nan
    return record._replace(angles=angles, torques=torques)


@pytest.mark.extra
@pytest.mark.parametrize(
    ("frequencies", "gaps", "length"),
    [
        ((60.0, 60.0), (), 0),
        ((45.0, 110.0), (), 0),
        # too long to be bridged; and so many short ones that no second is without one
        ((60.0, 60.0), (700, 720, 1350, 2010), 8),
        ((60.0, 60.0), range(150, 2900, 130), 2),
    ],
)
def test_transmissions_come_back_with_intervals(
    frequencies: tuple[float, float], gaps: Sequence[int], length: int
) -> None:
    found = find_resonance(ROBOT, with_gaps(chirped(frequencies), gaps, length))
    for leg, true in zip(found.legs, frequencies, strict=True):
        assert leg.frequency.value == pytest.approx(true, rel=0.03)
        assert 0.0 < leg.frequency.half_width < 0.1 * true
        assert leg.rotor_share.value == pytest.approx(0.7, abs=0.05)
        assert leg.damping.value == pytest.approx(0.04, abs=0.02)
    assert abs(found.delay.value) < 2e-4
    assert found.lowest == min(leg.frequency.value for leg in found.legs)
    assert found.locked[0] < found.locked[1]


@pytest.mark.parametrize("frequencies", [(60.0, 60.0), (45.0, 110.0)])
def test_the_intervals_hold_the_truth_where_samples_come_late_and_get_lost(frequencies: tuple[float, float]) -> None:
    random = np.random.default_rng(8)
    late = np.minimum(9, random.exponential(1.5, 6000).astype(int))
    assert np.mean(late > 4) > 0.02
    lost = np.flatnonzero(random.random(6000) < 0.01)
    record = with_gaps(chirped(frequencies, late=late.tolist(), settings=TWO_AMPLITUDES), lost.tolist(), 1)
    found = find_resonance(ROBOT, record)
    assert found.amplitudes == 2
    for leg, true in zip(found.legs, frequencies, strict=True):
        assert abs(leg.frequency.value - true) < leg.frequency.half_width < 0.1 * true


def test_the_intervals_hold_the_truth_where_transmissions_have_play() -> None:
    found = find_resonance(ROBOT, played(70.0, 3e-4, TWO_AMPLITUDES, 12.0))
    for leg in found.legs:
        assert abs(leg.frequency.value - 70.0) < leg.frequency.half_width < 0.15 * 70.0


def test_where_play_hides_the_resonance_a_bound_is_told_that_one_amplitude_takes_for_it() -> None:
    record = played(130.0, 6e-4, TWO_AMPLITUDES, 12.0)
    larger = find_resonance(ROBOT, Record(RATE, *(column[:3000] for column in record[1:])))
    assert larger.amplitudes == 1
    assert all(leg.frequency.value + leg.frequency.half_width < 120.0 for leg in larger.legs)
    with pytest.raises(OnlyBounded, match=r"play hides their resonance: it is at .* Hz or above") as told:
        find_resonance(ROBOT, record)
    assert 0.9 * larger.lowest < told.value.at_least < 0.98 * larger.lowest
    assert told.value.likely == pytest.approx(130.0, rel=0.2)


def test_a_smaller_amplitude_that_moves_no_spring_says_nothing_of_play() -> None:
    """Where it does not overcome friction, the robot looks rigid under it."""
    soft, rigid = (chirped(one, late=(0,) * 6000, settings=TWO_AMPLITUDES) for one in ((60.0, 60.0), None))
    record = Record(
        RATE, *(np.concatenate((one[:3000], two[3000:])) for one, two in zip(soft[1:], rigid[1:], strict=True))
    )
    with pytest.raises(OnlyBounded, match="too weak to tell play from elasticity") as told:
        find_resonance(ROBOT, record)
    assert 54.0 < told.value.at_least < 60.0


def test_a_rigid_robot_has_none_up_to_where_the_chirp_can_tell() -> None:
    with pytest.raises(NoResonance, match=r"no resonance is visible up to \d+ Hz.* rigid as far as"):
        find_resonance(ROBOT, chirped(None))


def test_unsuitable_records_are_refused() -> None:
    record = chirped(None)
    with pytest.raises(NotIdentifiable, match=r"too short: 3\.0 s"):
        find_resonance(ROBOT, Record(RATE, *(column[:1500] for column in record[1:])))
    with pytest.raises(NotIdentifiable, match=r"too short"):
        find_resonance(ROBOT, Record(RATE, *(column[:400] for column in record[1:])))
    with pytest.raises(NotIdentifiable, match="0 frequencies of 1 Hz are swept"):
        find_resonance(ROBOT, chirped(None, against=False))
    with pytest.raises(NotIdentifiable, match="the assembly mode changes"):
        find_resonance(ROBOT, record._replace(assembly=np.where(np.arange(3000) < 9, -ASSEMBLY, ASSEMBLY)))
    near = inverse_geometry(ROBOT, (1, -1), 0.0, 0.07)
    moved = record.angles - record.angles[0] + [near.q11, near.q21]
    with pytest.raises(NotIdentifiable, match=r"1/cond\(A\) is 0\.\d+ in this posture"):
        find_resonance(ROBOT, record._replace(angles=moved))
