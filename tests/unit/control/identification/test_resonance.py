"""Transmissions come back from a chirp on the two-mass model; a rigid robot and unsuitable records are refused."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from scipy.linalg import expm

from fivebar_control.identification.equations import Record
from fivebar_control.identification.identification import NotIdentifiable
from fivebar_control.identification.resonance import NoResonance, elastic_model, find_resonance, inertia_at, rigid_model
from fivebar_control.laws.chirp import HIGHEST, ChirpSettings, chirp
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import assembly_mode, state_from_platform
from fivebar_description.robot_file import load_robot

ROBOT = load_robot("dextar")
RATE, COUNT = 500.0, 2.0 * math.pi / 20_000
HOME = inverse_geometry(ROBOT, 1, -1, 0.0, 0.13)
ASSEMBLY = float(assembly_mode(state_from_platform(ROBOT, 1, -1, 0.0, 0.13, 0.0, 0.0)))
SWEEPS = ChirpSettings(amplitude=1.8, from_hz=10.0, sweep=3.0)


def chirped(frequencies: tuple[float, float] | None, share: float = 0.7, against: bool = True) -> Record:
    """Return counted angles of the linear model without friction under six seconds of a chirp."""
    samples = 3000
    still = Record(RATE, np.array([[HOME.q11, HOME.q21]]), np.zeros((1, 2)), np.array([ASSEMBLY]))
    inertia = inertia_at(ROBOT, still)
    model = rigid_model(inertia)
    if frequencies is not None:
        odds = math.log(share / (1.0 - share))
        legs = np.array([[math.log(one), math.log(0.04), odds, 0.0, 0.0] for one in frequencies])
        model = elastic_model(inertia, np.array([ROBOT.leg1.inertia, ROBOT.leg2.inertia]), legs)
    system, entry = model
    size = len(system)
    whole = np.zeros((size + 2, size + 2))
    whole[:size, :size], whole[:size, size:] = system / RATE, entry / RATE
    step = expm(whole)
    wanted = np.array([chirp(SWEEPS, k / RATE, HIGHEST * RATE) for k in range(samples)])
    if not against:
        wanted[:, 1] = wanted[:, 0]
    state, angles, torques = np.zeros(size), np.zeros((samples, 2)), np.zeros((samples, 2))
    hold = np.array([ROBOT.leg1.inertia, ROBOT.leg2.inertia])
    for number in range(1, samples):
        # rates follow all angles
        torques[number] = wanted[number] - hold * (100.0 * state[:2] + 20.0 * state[size // 2 : size // 2 + 2])
        state = step[:size, :size] @ state + step[:size, size:] @ torques[number]
        angles[number] = state[:2]
    # a slow motion turns the encoders through many counts, whose rounding is noise then
    angles += np.array([HOME.q11, HOME.q21]) + np.linspace(0.0, 0.03, samples)[:, None]
    return Record(RATE, COUNT * np.round(angles / COUNT), torques, np.full(samples, ASSEMBLY))


def with_gaps(record: Record, places: Sequence[int], length: int) -> Record:
    """Leave some samples out at each of these places, as where a machine stood still."""
    angles, torques = record.angles.copy(), record.torques.copy()
    for place in places:
        angles[place : place + length] = torques[place : place + length] = np.nan
    return record._replace(angles=angles, torques=torques)


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


def test_a_rigid_robot_has_none_up_to_where_the_chirp_can_tell() -> None:
    with pytest.raises(NoResonance, match=r"no resonance is visible up to \d+ Hz.* rigid as far as"):
        find_resonance(ROBOT, chirped(None))


def test_unsuitable_records_are_refused() -> None:
    record = chirped(None)
    with pytest.raises(NotIdentifiable, match=r"too short: 3\.0 s"):
        find_resonance(ROBOT, Record(RATE, *(column[:1500] for column in record[1:])))
    with pytest.raises(NotIdentifiable, match="0 frequencies of 1 Hz are swept"):
        find_resonance(ROBOT, chirped(None, against=False))
    with pytest.raises(NotIdentifiable, match="the assembly mode changes"):
        find_resonance(ROBOT, record._replace(assembly=np.where(np.arange(3000) < 9, -ASSEMBLY, ASSEMBLY)))
    near = inverse_geometry(ROBOT, 1, -1, 0.0, 0.07)
    moved = record.angles - record.angles[0] + [near.q11, near.q21]
    with pytest.raises(NotIdentifiable, match=r"1/cond\(A\) is 0\.\d+ in this posture"):
        find_resonance(ROBOT, record._replace(angles=moved))
