# SPDX-License-Identifier: Apache-2.0
"""Raw figures and joint quantities: exact by hand for one drive, and consistent for any."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_control.hardware.configuration import Drive
from fivebar_control.hardware.units import (
    Scale,
    position_rad,
    scale_of,
    torque_nm,
    torque_raw,
    velocity_rad_s,
)

GEARED = Drive(
    node_id=1, counts_per_revolution=4000, gear_ratio=5.0, sign=-1, home_offset_rad=0.25, rated_torque_nm=0.4,
    torque_units_per_rated=1000, velocity_units_per_rev_s=60.0, torque_limit_nm=3.0,
)  # fmt: skip

drives = st.builds(
    Drive,
    node_id=st.just(1),
    counts_per_revolution=st.integers(100, 2**24),
    gear_ratio=st.floats(0.1, 200.0),
    sign=st.sampled_from((1, -1)),
    home_offset_rad=st.floats(-10.0, 10.0),
    rated_torque_nm=st.floats(0.5, 5.0),
    velocity_units_per_rev_s=st.floats(1.0, 1e6),
    torque_limit_nm=st.floats(1.0, 1.5),
)
scales = drives.map(scale_of)
counts = st.integers(-(2**31), 2**31 - 1)


def position_counts(scale: Scale, angle: float) -> int:
    """The encoder reading nearest to a joint angle (rad)."""
    return round((angle - scale.home_offset) * scale.counts_per_rad)


def velocity_raw(scale: Scale, velocity: float) -> int:
    """The value of 0x606C nearest to a joint velocity (rad/s)."""
    return round(velocity * scale.velocity_per_rad_s)


def test_a_geared_drive_by_hand() -> None:
    scale = scale_of(GEARED)
    # 1000 counts are a quarter of a motor turn, a twentieth of a joint turn, backwards
    assert position_rad(scale, 1000) == pytest.approx(0.25 - 2.0 * math.pi / 20.0, abs=1e-15)
    assert position_counts(scale, 0.25) == 0
    # 300 rpm are 5 motor turns per second, one joint turn per second
    assert velocity_rad_s(scale, 300) == pytest.approx(-2.0 * math.pi, abs=1e-15)
    assert velocity_raw(scale, 2.0 * math.pi) == -300
    # rated torque is 0.4 Nm at the motor, 2 Nm at the joint
    assert torque_nm(scale, 1000) == pytest.approx(-2.0, abs=1e-15)
    assert torque_raw(scale, 1.0) == -500
    assert torque_raw(scale, 0.0011) == -1
    assert (torque_raw(scale, 9.0), torque_raw(scale, -9.0)) == (-1500, 1500)


@given(scale=scales, raw=counts)
def test_counts_come_back(scale: Scale, raw: int) -> None:
    back = position_counts(scale, position_rad(scale, raw))
    # where the home offset is large against a count, its rounding may move the reading
    slack = 1e-14 * abs(scale.counts_per_rad) * (abs(scale.home_offset) + abs(raw / scale.counts_per_rad))
    assert abs(back - raw) <= slack


@given(scale=scales, angle=st.floats(-10.0, 10.0))
def test_an_angle_is_kept_to_half_a_count(scale: Scale, angle: float) -> None:
    back = position_rad(scale, position_counts(scale, angle))
    assert abs(back - angle) <= 0.5 / abs(scale.counts_per_rad) + 1e-12


@given(scale=scales, raw=counts)
def test_velocities_come_back(scale: Scale, raw: int) -> None:
    assert velocity_raw(scale, velocity_rad_s(scale, raw)) == raw


@given(scale=scales, torque=st.floats(allow_nan=False, allow_infinity=False))
def test_a_torque_is_kept_to_half_a_unit_within_the_limit(scale: Scale, torque: float) -> None:
    raw = torque_raw(scale, torque)
    assert abs(raw) <= scale.torque_limit <= 0x7FFF
    wanted = torque * scale.torque_per_nm
    if abs(wanted) <= scale.torque_limit:
        assert abs(raw - wanted) <= 0.5
    else:
        assert abs(raw) == scale.torque_limit
        assert math.copysign(1.0, raw) == math.copysign(1.0, wanted)


@given(drive=drives)
def test_the_limit_is_never_exceeded_by_rounding(drive: Drive) -> None:
    scale = scale_of(drive)
    assert abs(torque_nm(scale, torque_raw(scale, 1e9))) <= drive.torque_limit_nm * (1.0 + 1e-6)


@given(scale=scales, raw=st.integers(-1000, 1000))
def test_sign_turns_everything_the_same_way(scale: Scale, raw: int) -> None:
    """Power is the same on both sides: torque times speed keeps its sign."""
    power = torque_nm(scale, raw) * velocity_rad_s(scale, raw)
    assert power >= 0.0


@pytest.mark.parametrize("torque", [math.nan, math.inf, -math.inf])
def test_a_torque_that_is_no_number_is_refused(torque: float) -> None:
    with pytest.raises(ValueError, match="expected a finite number"):
        torque_raw(scale_of(GEARED), torque)
