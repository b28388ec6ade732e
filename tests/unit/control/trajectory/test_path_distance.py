# SPDX-License-Identifier: Apache-2.0
"""Distance from the path, whatever the time: against the nearest of many points, late, and where it turns back."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from fivebar_control.trajectory import path_distance
from fivebar_control.trajectory.path import Path
from fivebar_control.trajectory.path_distance import line_distance, path_distances

RATE = 500


ASIDE = Path.through([(0.0, 0.15), (0.0, 0.03), (0.04, 0.05)], [1.0, 1.0])


def sampled(path: Path) -> np.ndarray:
    return np.array([path.at(number / RATE)[:2] for number in range(path.samples(RATE) + 1)])


def test_a_robot_that_is_late_is_on_the_path_and_one_beside_it_is_off_by_that() -> None:
    places = sampled(ASIDE)
    late = np.array([ASIDE.at(0.7 * number / RATE)[:2] for number in range(len(places))])
    assert np.abs(late - places).max() > 0.03
    assert path_distances(places, late).max() < 1e-6
    beside = late.copy()
    beside[100:300] += np.array([0.002, 0.0])
    assert path_distances(places, beside)[150:300] == pytest.approx(0.002, abs=1e-9)
    assert path_distances(places, beside)[400:].max() < 1e-6


def test_it_is_that_of_the_nearest_point_of_the_whole_path_near_a_corner() -> None:
    places = sampled(ASIDE)
    random = np.random.default_rng(3)
    robot = places + 1e-3 * np.cumsum(random.normal(0.0, 0.05, places.shape), axis=0)
    dense = np.array([ASIDE.at(t)[:2] for t in np.linspace(0.0, ASIDE.duration, 40001)])
    wanted = [math.sqrt(((dense - one) ** 2).sum(axis=1).min()) for one in robot]
    assert path_distances(places, robot) == pytest.approx(wanted, abs=1e-5)


def test_a_path_that_turns_back_over_itself_is_followed_and_gaps_are_not_known() -> None:
    places = sampled(Path.through([(0.0, 0.15), (0.0, 0.12), (0.0, 0.15)], [1.0, 1.0]))
    robot = places + np.array([0.001, 0.0])
    robot[10] = math.nan
    found = path_distances(places, robot)
    assert math.isnan(found[10])
    assert np.delete(found, 10) == pytest.approx(0.001, abs=1e-9)
    broken = places.copy()
    broken[200:210] = math.nan
    assert np.nanmax(path_distances(broken, places)) < 1e-4
    assert np.isnan(path_distances(broken[200:210], places[200:210])).all()


@pytest.mark.parametrize(
    "stands", [False, True], ids=["rests with its reference", "stands while its reference goes on"]
)
def test_the_effort_of_a_sample_does_not_grow_with_the_run(stands: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = 0

    def counted(*of_line: Any) -> float:
        nonlocal calls
        calls += 1
        return line_distance(*of_line)

    monkeypatch.setattr(path_distance, "line_distance", counted)
    motion = sampled(Path.through([(0.0, 0.15), (0.0, 0.03)], [6.0]))
    places = np.concatenate([motion, np.repeat(motion[-1:], 3000, axis=0)])
    beside = np.array([1e-4, 0.0])
    found = path_distances(places, np.tile(places[0] + beside, (len(places), 1)) if stands else places + beside)
    assert found == pytest.approx(1e-4, abs=1e-9)
    assert calls < 20 * len(places)
