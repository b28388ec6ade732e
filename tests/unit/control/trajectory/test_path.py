# SPDX-License-Identifier: Apache-2.0
"""Paths: where the platform should be, and which segment an instant belongs to."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_control.trajectory.path import Path

CORNERS = ((0.0, 0.15), (0.0, 0.035), (-0.025, 0.025), (-0.025, 0.125))
DURATIONS = (1.0, 0.5, 2.0)
TIMES = st.floats(0.01, 3.49)


@pytest.fixture(scope="module")
def path() -> Path:
    return Path.through(CORNERS, DURATIONS)


def test_waypoints_are_reached_at_rest(path: Path) -> None:
    for time, (x, y) in zip((0.0, 1.0, 1.5, 3.5), CORNERS, strict=True):
        assert path.at(time) == pytest.approx((x, y, 0.0, 0.0, 0.0, 0.0), abs=1e-17)
    assert path.duration == 3.5


def test_before_the_start_and_after_the_end_the_platform_rests(path: Path) -> None:
    assert path.at(-1.0) == (*CORNERS[0], 0.0, 0.0, 0.0, 0.0)
    assert path.at(9.0) == pytest.approx((*CORNERS[-1], 0.0, 0.0, 0.0, 0.0), abs=1e-17)


def test_the_middle_of_a_segment_has_its_mean_place_and_15_8_of_its_mean_speed(path: Path) -> None:
    middle = path.at(1.25)
    assert (middle.x, middle.y) == pytest.approx((-0.0125, 0.03), abs=1e-16)
    assert (middle.vx, middle.vy) == pytest.approx((-0.025 / 0.5 * 1.875, -0.01 / 0.5 * 1.875), abs=1e-15)
    assert (middle.ax, middle.ay) == pytest.approx((0.0, 0.0), abs=1e-12)


@given(t=TIMES)
def test_velocity_and_acceleration_are_derivatives(path: Path, t: float) -> None:
    h = 1e-6
    before, now, after = path.at(t - h), path.at(t), path.at(t + h)
    # across a waypoint the third derivative jumps, which costs an order
    assert now.vx == pytest.approx((after.x - before.x) / (2.0 * h), abs=1e-8)
    assert now.vy == pytest.approx((after.y - before.y) / (2.0 * h), abs=1e-8)
    assert now.ax == pytest.approx((after.vx - before.vx) / (2.0 * h), abs=1e-5)
    assert now.ay == pytest.approx((after.vy - before.vy) / (2.0 * h), abs=1e-5)


@given(t=TIMES)
def test_the_reference_stays_on_its_line(path: Path, t: float) -> None:
    at, line = path.at(t), path.line_at(t)
    across = line.direction_y * (at.x - line.x) - line.direction_x * (at.y - line.y)
    assert abs(across) < 1e-16
    assert math.hypot(line.direction_x, line.direction_y) == pytest.approx(1.0, abs=1e-15)
    assert line.direction_x * at.vx + line.direction_y * at.vy >= 0.0


def test_an_instant_between_two_segments_belongs_to_the_later_one(path: Path) -> None:
    assert [path.segment_index(t) for t in (0.0, 0.999, 1.0, 1.499, 1.5, 3.5, 9.0)] == [0, 0, 1, 1, 2, 2, 2]
    assert path.segment_index(-1.0) == 0
    assert path.line_at(1.0)[:2] == CORNERS[1]
    assert path.line_at(math.nextafter(1.0, 0.0))[:2] == CORNERS[0]
    assert path.line_at(1.5)[2:] == (0.0, 1.0)


@pytest.mark.parametrize(
    ("durations", "rate_hz", "last"),
    [
        ((1.0,), 500, 500),
        ((0.1,), 1000, 100),
        ((0.3,), 10, 3),
        ((0.1, 0.2), 1000, 300),
        ((0.7, 0.1, 0.2), 1000, 1000),
        ((1.0,), 8, 8),
        ((0.1001,), 1000, 101),
        ((0.0999,), 1000, 100),
        ((0.1,) * 10, 500, 500),
    ],
)
def test_samples_cover_the_whole_motion_and_not_one_more(durations: tuple[float, ...], rate_hz: int, last: int) -> None:
    waypoints = [(0.01 * number, 0.1) for number in range(len(durations) + 1)]
    assert Path.through(waypoints, durations).samples(rate_hz) == last


def test_one_duration_per_segment() -> None:
    with pytest.raises(ValueError, match="zip"):
        Path.through(CORNERS, (1.0, 1.0))
