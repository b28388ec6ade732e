"""The last samples of the filter: what is kept of an entry, and which entry a late reading belongs to."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fivebar_control.estimation.covariance import SIZE
from fivebar_control.estimation.ekf import Belief, Estimate
from fivebar_control.estimation.encoder import Angle
from fivebar_control.estimation.history import (
    ELBOW,
    RATE,
    SEEN_X,
    History,
    angle_at,
    belief_at,
    empty_history,
    entry_of,
    keep_angles,
    keep_belief,
    keep_elbow,
    keep_inputs,
    keep_rate,
    keep_seen,
    row_of,
)

SAMPLES = (0, 1, 2, 5, 6, 9)
"""Of the entries: some samples had no motor readings."""


def kept(count: int) -> History:
    """Return a history of four entries in which the first samples were kept one after the other."""
    history = empty_history(4)
    for entry, sample in enumerate(SAMPLES[:count]):
        keep_inputs(history, entry, sample, 1, 0.0, 0.0)
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
    keep_angles(history, entry, one, two)
    assert (angle_at(history, entry, 1), angle_at(history, entry, 2)) == (one, two)
    covariance = np.arange(SIZE * SIZE, dtype=np.float64).reshape(SIZE, SIZE)
    belief = Belief(Estimate(*map(float, range(1, 12))), covariance)
    keep_belief(history, entry, belief)
    for same in (entry, entry - 4):
        back = belief_at(history, same)
        assert back.estimate == belief.estimate
        np.testing.assert_array_equal(back.covariance, covariance)
    # what is changed later is not what was kept
    back.covariance[0, 0] = -1.0
    assert belief_at(history, entry).covariance[0, 0] == 0.0


def test_an_entry_begins_without_late_readings() -> None:
    history = empty_history(4)
    keep_rate(history, 1, 1.0, 0.0)
    keep_elbow(history, 1, Angle(0.5, 1e-6))
    keep_seen(history, 1, 0.0, 0.1, -0.001, 1e-8)
    assert np.isfinite(history.inputs[row_of(history, 1), [RATE, ELBOW, SEEN_X]]).all()
    keep_inputs(history, 5, 7, 1, 0.0, 0.0)
    assert all(map(math.isnan, history.inputs[row_of(history, 5), [RATE, ELBOW, SEEN_X]]))
