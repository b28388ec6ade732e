# SPDX-License-Identifier: Apache-2.0
"""Joint states with stamps and a rate of their own become samples on the grid of the run."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fivebar_control.hardware.state_grid import GridSample, JointStates, StateGrid

PERIOD = 0.002
NAN = (math.nan, math.nan)


def moving(seconds: float) -> JointStates:
    """Both joints on sines of up to 6 rad/s and 90 rad/s^2, without velocities."""
    return JointStates((0.4 * math.sin(15.0 * seconds), 0.2 * math.cos(20.0 * seconds)), NAN, NAN)


def samples(stamps: np.ndarray, states_period: float) -> tuple[StateGrid, list[tuple[float, GridSample]]]:
    """The samples among states at some times (s), each with the time of its instant on a grid from the first on."""
    grid = StateGrid(PERIOD, states_period)
    found, number = [], -1
    for stamp in stamps:
        sample = grid.take(round(stamp * 1e9), moving(stamp - stamps[0]))
        if sample is not None:
            number += sample.periods
            found.append((number * PERIOD, sample))
    return grid, found


@pytest.mark.parametrize("rate", [500.0, 1000.0, 750.0, 2000.0])
def test_each_sample_is_the_state_at_its_instant_whatever_the_rate_of_the_states_is(rate: float) -> None:
    stamps = 1000.0 + np.arange(2000) / rate
    _, found = samples(stamps, 1.0 / rate)
    assert len(found) == pytest.approx(500.0 * 2000 / rate, abs=1.0)
    for instant, sample in found:
        # half of a state's period of extrapolation under 90 rad/s^2, and nothing where states fall on the grid
        allowed = 90.0 * (1.0 / rate) ** 2 if rate == 750.0 else 1e-9
        assert sample.states.positions == pytest.approx(moving(instant).positions, abs=allowed)


def test_a_stamp_beside_the_grid_costs_no_angle() -> None:
    rng = np.random.default_rng(11)
    stamps = 5.0 + np.arange(1000) * PERIOD + rng.uniform(-3e-4, 3e-4, 1000)
    stamps[0] = 5.0
    grid, found = samples(stamps, PERIOD)
    assert [sample.periods for _, sample in found] == [1] * 1000
    wrong = max(abs(one.states.positions[0] - moving(instant).positions[0]) for instant, one in found)
    # as they are, angles would be wrong by 6 rad/s * 0.3 ms
    assert wrong < 4e-4
    assert grid.lost == 0


def test_velocities_that_are_missing_are_those_between_samples() -> None:
    grid = StateGrid(PERIOD, PERIOD)
    turning = [JointStates((3.0 * k * PERIOD, -1.0 * k * PERIOD), (math.nan, 0.7), NAN) for k in range(5)]
    found = [grid.take(round(k * PERIOD * 1e9), one) for k, one in enumerate(turning)]
    assert [one.states.velocities for one in found if one] == [(0.0, 0.7), *[(pytest.approx(3.0), 0.7)] * 4]


def test_lost_and_repeated_states_are_counted() -> None:
    stamps = [0, 1, 2, 2, 1, 3, 6, 7]
    grid = StateGrid(PERIOD, PERIOD)
    found = [grid.take(round(k * PERIOD * 1e9), moving(k * PERIOD)) for k in stamps]
    assert [one and one.periods for one in found] == [1, 1, 1, None, None, 1, 3, 1]
    assert (grid.lost, grid.old) == (2, 2)


def test_the_grid_follows_a_clock_that_runs_differently() -> None:
    """Without that, states of a clock that is 200 ppm fast would get half a period beside the grid within 10 s."""
    stamps = np.arange(20_000) * PERIOD * (1.0 - 2e-4)
    grid, found = samples(stamps, PERIOD)
    assert [sample.periods for _, sample in found] == [1] * 20_000
    assert grid.lost == 0


@pytest.mark.parametrize("updates", [1, 2, 4])
def test_the_last_state_before_a_sample_is_known(updates: int) -> None:
    """A torque that is published after it acts from the sample on, where the controller is updated with each state."""
    grid = StateGrid(PERIOD, PERIOD / updates)
    told = []
    for k in range(4 * updates):
        grid.take(round(k * PERIOD / updates * 1e9), moving(0.0))
        told.append(grid.is_last)
    assert told == [k % updates == updates - 1 for k in range(4 * updates)]
