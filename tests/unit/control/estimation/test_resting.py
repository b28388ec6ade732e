# SPDX-License-Identifier: Apache-2.0
"""Where a robot rests by motors and camera: told once it rests and is seen, and where its modes can be told."""

from __future__ import annotations

import math

import pytest

from fivebar_control.estimation.estimator import StateEstimator
from fivebar_control.estimation.homing import HomingContradicted, homing_at
from fivebar_control.estimation.late_reading import CAMERA, LateReading
from fivebar_control.estimation.resting import REST_TIME, MotorReading, Resting
from fivebar_control.estimation.settings import Drives, EkfSettings, Sensing
from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.robot_file import load_robot

RATE_HZ = 500
ROBOT = load_robot("dextar")
BELOW, ABOVE = (0.01, 0.03), (0.0, 0.15)
"""Places (m) in both assembly modes."""


def rested(
    x: float,
    y: float,
    seen: tuple[float, float] | None = None,
    samples: int = 200,
    turning: float = 0.0,
    first: int = 0,
    pictures: tuple[int, ...] = (30, 15),
) -> Resting:
    """Motors that read (x, y) m from a sample on and turn at a speed (rad/s), and pictures, by default of that place.

    Those are made so many samples before the end.
    """
    resting, angles = Resting(ROBOT, (1, -1), RATE_HZ, 3e-4), inverse_geometry(ROBOT, (1, -1), x, y)
    for sample in range(first, first + samples):
        left = first + samples - sample
        resting.read(MotorReading(sample, angles.q11 + turning * (left - 1) / RATE_HZ, angles.q21))
        if left in pictures:
            resting.see(LateReading(CAMERA, float(sample), *((x, y) if seen is None else seen), 1e-5))
            resting.see(LateReading(CAMERA, sample + 1.0, math.nan, math.nan, math.nan))
    return resting


def test_a_robot_at_rest_is_found_in_the_mode_in_which_it_is_seen() -> None:
    for place, assembly in ((BELOW, -1), (ABOVE, 1)):
        found = rested(*place).posture()
        assert found[:2] == pytest.approx(place)
        assert found[2:] == ((1, -1), assembly)


def test_what_cannot_be_told_is_refused() -> None:
    blind = Resting(ROBOT, (1, -1), RATE_HZ, 3e-4)
    for sample in range(200):
        blind.read(MotorReading(sample, 1.6, 1.5))
    other = rested(*BELOW)
    other.see(LateReading(CAMERA, 199.0, BELOW[0] + 2e-3, BELOW[1], 1e-5))
    far = rested(*BELOW)
    far.see(LateReading(CAMERA, 199.0, BELOW[0] + 0.6, BELOW[1], 1e-5))
    for resting, words in (
        (rested(*BELOW, samples=100), "not been read for 0.3 s"),
        (rested(*BELOW, samples=100, first=500), "not been read for 0.3 s"),
        (far, "still moves, 600.0 mm"),
        (rested(*BELOW, pictures=(30,)), "not seen the platform twice"),
        # one picture of before and one since the motors stand still
        (rested(*BELOW, pictures=(152, 15)), "not seen the platform twice"),
        (rested(*BELOW, turning=0.05), "have turned"),
        (blind, "not seen the platform twice"),
        (other, "still moves, 2.0 mm"),
        (rested(*BELOW, seen=(0.05, 0.05)), "allowed are 5 mm"),
        (rested(0.0, 0.0848), "both assembly modes"),
    ):
        with pytest.raises(HomingContradicted, match=words):
            resting.posture()


@pytest.mark.parametrize(("turned", "rests"), [(2.55e-3, True), (2.65e-3, False)])
def test_a_motor_may_turn_by_two_counts_more_than_its_tolerance(turned: float, rests: bool) -> None:
    """Within 0.3 s; and the posture is that of the last reading."""
    resting = rested(*ABOVE, turning=turned / REST_TIME)
    if rests:
        assert resting.posture()[:2] == pytest.approx(ABOVE, abs=1e-9)
    else:
        with pytest.raises(HomingContradicted, match="have turned"):
            resting.posture()


def test_what_moved_before_does_not_count() -> None:
    """The motors have stood still for 0.3 s, the first picture being of the beginning of that time."""
    resting = Resting(ROBOT, (1, -1), RATE_HZ, 3e-4)
    resting.read(MotorReading(0, 1.0, 1.0))
    angles = inverse_geometry(ROBOT, (1, -1), *ABOVE)
    for sample in range(100, 251):
        resting.read(MotorReading(sample, angles.q11, angles.q21))
    for made in (100.0, 115.0):
        resting.see(LateReading(CAMERA, made, *ABOVE, 1e-5))
    assert resting.posture()[:2] == pytest.approx(ABOVE, abs=1e-9)


def test_an_estimator_that_has_lost_the_robot_begins_again_elsewhere() -> None:
    """In the other assembly mode, with a fault behind it; late positions of the time before are left out."""
    one = StateEstimator(
        ROBOT,
        homing_at(ROBOT, (1, -1), *ABOVE),
        Sensing(RATE_HZ, Drives(20000, 1), EkfSettings(camera=True, seen_start=True)),
    )
    above, below = (inverse_geometry(ROBOT, (1, -1), *place) for place in (ABOVE, BELOW))
    one.take(0, above.q11, above.q21, 0.0, 0.0, [LateReading(CAMERA, 0.0, *ABOVE, 1e-5)])
    one.take(500, below.q11, below.q21, 0.0, 0.0)
    assert one.fault is not None
    assert one.fault.name == "estimate_lost"
    one.commanded(500, 0.0, 0.0)
    one.begin_at(rested(*BELOW).posture())
    assert not one.awaits(501)
    for sample in range(501, 520):
        told = one.take(sample, below.q11, below.q21, 0.0, 0.0, [LateReading(CAMERA, sample - 15.0, *BELOW, 1e-5)])
    assert one.fault is None
    assert told.position == pytest.approx(tuple(below), abs=1e-3)
