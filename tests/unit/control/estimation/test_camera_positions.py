# SPDX-License-Identifier: Apache-2.0
"""Positions by the camera in the filter: late ones count as if they had come at once, wrong ones not at all."""

from __future__ import annotations

import numpy as np
import pytest

from fivebar_control.estimation.ekf import as_vector
from fivebar_control.estimation.estimator import StateEstimator
from fivebar_control.estimation.homing import HomingContradicted, homing_at, seen_assembly
from fivebar_control.estimation.late_reading import CAMERA, LateReading
from fivebar_control.estimation.settings import Drives, EkfSettings, Sensing
from fivebar_control.model.geometry import direct_geometry, inverse_geometry
from fivebar_control.model.kinematics import assembly_mode, state_from_platform
from fivebar_control.model.singularity import inverse_condition
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import load_robot

RATE_HZ, PLACE = 500, (0.01, 0.14)
ROBOT = load_robot("dextar")
DRIVES = Drives(encoder_counts=20_000)


def estimator(**settings: float) -> StateEstimator:
    return StateEstimator(
        ROBOT, homing_at(ROBOT, (1, -1), *PLACE), Sensing(RATE_HZ, DRIVES, EkfSettings(camera=True, **settings))
    )


def after(made: int, late: int, x: float, y: float, samples: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Estimate and covariance of a resting robot after one position that came so many samples late."""
    angles = inverse_geometry(ROBOT, (1, -1), *PLACE)
    one = estimator()
    for sample in range(samples):
        seen = [LateReading(CAMERA, float(made), x, y, 1e-5)] if sample == made + late else []
        one.take(sample, angles.q11, angles.q21, 0.0, 0.0, seen)
    assert one.belief is not None
    return as_vector(one.belief.estimate), one.belief.covariance


def test_a_late_position_has_the_effect_of_one_that_came_at_once() -> None:
    at_once, late = (after(10, delay, PLACE[0] + 1e-5, PLACE[1]) for delay in (0, 40))
    np.testing.assert_array_equal(at_once[0], late[0])
    np.testing.assert_array_equal(at_once[1], late[1])
    assert np.abs(late[0] - after(10, 0, np.nan, np.nan)[0]).max() > 0.0


@pytest.mark.parametrize(("off_x", "off_y"), [(0.02, 0.0), (0.0, -0.005), (np.nan, 0.0)])
def test_a_wrong_position_cannot_pull_the_robot(off_x: float, off_y: float) -> None:
    wrong, none = after(10, 15, PLACE[0] + off_x, PLACE[1] + off_y), after(10, 15, np.nan, np.nan)
    np.testing.assert_array_equal(wrong[0], none[0])
    np.testing.assert_array_equal(wrong[1], none[1])


def test_a_position_older_than_the_history_is_left_out() -> None:
    np.testing.assert_array_equal(after(2, 55, *PLACE)[0], after(2, 0, np.nan, np.nan)[0])


def test_the_assembly_mode_is_seen_at_two_hundred_random_starts() -> None:
    """With 0.1 mm of error of the camera and a count of the encoders, in all working modes."""
    random, seen = np.random.default_rng(12), 0
    while seen < 200:
        x, y = random.uniform(-0.1, 0.1), random.uniform(-0.15, 0.17)
        mode = random.choice([-1, 1], 2).tolist()
        state = state_from_platform(ROBOT, mode, x, y, 0.0, 0.0)
        angles = inverse_geometry(ROBOT, mode, x, y)
        if not (np.isfinite([angles.q11, angles.q21]).all() and inverse_condition(state) > 0.1):
            continue
        other = direct_geometry(ROBOT, -assembly_mode(state), angles.q11, angles.q21)
        if not np.hypot(other[0] - x, other[1] - y) > 0.012:
            continue
        found = seen_assembly(ROBOT, angles.q11 + 3e-4, angles.q21, x + random.normal(0, 1e-4), y)
        assert found == assembly_mode(state)
        seen += 1


def test_a_start_that_the_camera_contradicts_is_refused() -> None:
    angles = inverse_geometry(ROBOT, (1, -1), *PLACE)
    homing = homing_at(ROBOT, (1, -1), *PLACE)
    there = direct_geometry(ROBOT, -homing.assembly, angles.q11, angles.q21)
    for place, words in ((there, "in assembly mode"), ((0.05, 0.05), "allowed are 5 mm"), ((np.nan, 0.0), "not see")):
        with pytest.raises(HomingContradicted, match=words):
            estimator(seen_start=True).take(
                0, angles.q11, angles.q21, 0.0, 0.0, [LateReading(CAMERA, 0.0, *place, 1e-5)]
            )


def test_a_refusal_says_by_how_much(dextar: FiveBar) -> None:
    angles = inverse_geometry(dextar, (1, -1), *PLACE)
    # 0.8 m away from one assembly mode, so that a millimetre in a thousand shows, and on the far side of the other
    with pytest.raises(HomingContradicted, match=r"at \(0\.0100, 0\.9400\) m, 800\.0 mm from where"):
        seen_assembly(dextar, angles.q11, angles.q21, PLACE[0], PLACE[1] + 0.8)
    near = inverse_geometry(dextar, (1, -1), 0.0, 0.0848)
    with pytest.raises(HomingContradicted, match="both assembly modes are within 10 mm of what the camera sees"):
        seen_assembly(dextar, near.q11, near.q21, 0.0, 0.0848)
