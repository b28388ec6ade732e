"""The acceleration check of section 4.3."""

from __future__ import annotations

import pytest

from fivebar_control.estimation.imu_check import acceleration_error


def test_error_is_the_difference_of_magnitudes_measured_minus_desired() -> None:
    assert acceleration_error((3.0, 4.0), (0.0, 2.0)) == pytest.approx(3.0, abs=1e-15)
    assert acceleration_error((0.0, 0.0), (5.0, -12.0)) == pytest.approx(-13.0, abs=1e-15)


def test_a_turned_frame_makes_no_error() -> None:
    assert acceleration_error((-4.0, 3.0), (3.0, 4.0)) == 0.0
