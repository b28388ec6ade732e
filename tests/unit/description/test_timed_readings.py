# SPDX-License-Identifier: Apache-2.0
"""SensorReadings between a robot and its controller: what is refused, and times that survive as stamps."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_description.errors import InputError
from fivebar_description.interface import START_STAMP_NS
from fivebar_description.readings import (
    SensorReadings,
    TimedAngle,
    TimedPosition,
    TimedTurn,
    stamp_of_time,
    time_of_stamp,
)

WRONG: list[tuple[dict[str, Any], str]] = [
    ({"motor_angles": (0.0,)}, r"motor_angles: \(0.0,\): expected 2 finite numbers"),
    ({"motor_torques": (0.0, math.inf)}, r"motor_torques: .*expected 2 finite numbers"),
    ({"joint_angles": (0.0, 0.0, math.nan, 0.0)}, r"joint_angles: .*nan.*expected 4 finite numbers"),
    ({"joint_velocities": (0.0,) * 5}, r"joint_velocities: .*expected 4 finite numbers"),
    ({"time": math.nan}, r"time: \(nan,\): expected a finite number"),
    ({"imu": (TimedTurn(0.0, (0.0, math.nan, 0.0)),)}, r"imu: .*expected 4 finite numbers"),
    ({"passive_angles": (TimedAngle(0.0, math.inf),)}, r"passive_angles: .*expected 2 finite numbers"),
    ({"camera": (TimedPosition(math.nan, 0.0, 0.0, 1e-4, 1e-4),)}, r"camera: .*expected a finite number"),
]


@pytest.mark.parametrize(("fields", "words"), WRONG)
def test_numbers_that_are_missing_or_not_finite_are_refused_by_their_name(fields: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        SensorReadings(**fields).check()


def test_a_picture_without_the_platform_is_a_reading_and_a_sample_without_angles_a_lost_one() -> None:
    unseen = SensorReadings(camera=(TimedPosition(0.0, math.nan, math.nan, math.nan, math.nan),))
    unseen.check()
    assert not unseen.present and SensorReadings(motor_angles=(0.0, 0.0)).present


@given(st.integers(-(10**9), 10**14))
def test_a_stamp_survives_as_a_time(offset: int) -> None:
    assert stamp_of_time(time_of_stamp(START_STAMP_NS + offset)) == START_STAMP_NS + offset
