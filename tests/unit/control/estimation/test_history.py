# SPDX-License-Identifier: Apache-2.0
"""The last samples of the filter: what is kept of an entry, and which entry a late reading belongs to."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fivebar_control.estimation import history as ring
from fivebar_control.estimation.covariance import SIZE
from fivebar_control.estimation.ekf import Belief, Estimate
from fivebar_control.estimation.encoder import Angle
from fivebar_control.estimation.history import VALUE, History, empty_history, entry_of, row_of
from fivebar_control.estimation.late_reading import CAMERA, EXTRA, GYROSCOPE, PASSIVE

SAMPLES = (0, 1, 2, 5, 6, 9)
"""Of the entries: some samples had no motor readings."""


def kept(count: int) -> History:
    """Return a history of four entries in which the first samples were kept one after the other."""
    history = empty_history(4)
    for entry, sample in enumerate(SAMPLES[:count]):
        ring.keep_inputs(history, entry, sample, 1, 0.0, 0.0)
    return history


@pytest.mark.parametrize(
    ("sample", "entry"),
    [(12, 5), (9, 5), (8, 0), (7, 0), (6, 4), (5, 3), (4, 0), (2, 0), (1, 0), (0, 0)],
)
def test_a_reading_belongs_to_the_entry_of_its_sample(sample: int, entry: int) -> None:
    """The newest one takes what comes after it; the oldest one, here that of sample 2, takes nothing."""
    assert entry_of(kept(6), 5, sample) == entry


def test_before_the_ring_is_full_the_first_entry_is_the_oldest() -> None:
    history = kept(3)
    assert [entry_of(history, 2, sample) for sample in (0, 1, 2, 3)] == [0, 1, 2, 2]


def test_angles_and_beliefs_come_back_as_they_were_kept() -> None:
    history, entry = empty_history(4), 6
    one, two = Angle(0.1, 0.2), Angle(0.3, 0.4)
    ring.keep_angles(history, entry, one, two)
    assert (ring.angle_at(history, entry, 1), ring.angle_at(history, entry, 2)) == (one, two)
    covariance = np.arange(SIZE * SIZE, dtype=np.float64).reshape(SIZE, SIZE)
    belief = Belief(Estimate(*map(float, range(1, 12))), covariance)
    ring.keep_belief(history, entry, belief)
    for same in (entry, entry - 4):
        back = ring.belief_at(history, same)
        assert back.estimate == belief.estimate
        np.testing.assert_array_equal(back.covariance, covariance)
    # what is changed later is not what was kept
    back.covariance[0, 0] = -1.0
    assert ring.belief_at(history, entry).covariance[0, 0] == 0.0


def test_an_entry_begins_without_late_readings() -> None:
    history = empty_history(4)
    for sensor in (PASSIVE, GYROSCOPE, CAMERA, EXTRA):
        ring.keep_late(history, 1, sensor, 0.5, 0.0, 1e-6)
    assert np.isfinite(history.late[row_of(history, 1), :, VALUE]).all()
    ring.keep_inputs(history, 5, 7, 1, 0.0, 0.0)
    assert np.isnan(history.late[row_of(history, 5), :, VALUE]).all()


def test_what_is_kept_of_an_entry_is_in_its_row_of_the_ring_alone() -> None:
    """Entry 6 of a ring of four has the row of entry 2; the late readings are marked as not taken yet."""
    history = empty_history(4)
    before = history.inputs.copy()
    ring.keep_inputs(history, 6, 40, 3, 0.7, -0.6)
    ring.keep_angles(history, 6, Angle(0.1, 0.2), Angle(0.3, 0.4))
    ring.keep_late(history, 6, GYROSCOPE, 1.5, -0.001)
    ring.keep_late(history, 6, PASSIVE, 0.5, 0.0, 1e-6)
    ring.keep_late(history, 6, CAMERA, 0.01, -0.002, 1e-8, 0.14, False)
    assert tuple(history.inputs[2].tolist()) == (0.1, 0.2, 0.3, 0.4, 0.7, -0.6, 3.0, 40.0)
    np.testing.assert_array_equal(np.delete(history.inputs, 2, axis=0), np.delete(before, 2, axis=0))
    nan = math.nan
    kept = [[0.5, 0.0, 0.0, 1e-6, 1.0], [1.5, 0.0, -0.001, nan, 1.0], [0.01, 0.14, -0.002, 1e-8, 0.0], [nan] * 5]
    np.testing.assert_array_equal(history.late[2], kept)
    assert np.isnan(np.delete(history.late, 2, axis=0)).all()
