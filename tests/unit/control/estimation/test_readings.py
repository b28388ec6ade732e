# SPDX-License-Identifier: Apache-2.0
"""Where a reading is put in the estimator's history."""

from __future__ import annotations

import numpy as np
import pytest
from estimator_at_rest import ANGLES, RATE_HZ, model_of, started

from fivebar_control.estimation.camera import with_seen
from fivebar_control.estimation.encoder import MOST_REPETITIONS
from fivebar_control.estimation.extra_sensor import with_extra
from fivebar_control.estimation.gyroscope import with_rate
from fivebar_control.estimation.history import (
    LAG,
    PERIODS,
    SAMPLE,
    TAU1,
    TAU2,
    VALUE,
    row_of,
)
from fivebar_control.estimation.late_reading import GYROSCOPE, PASSIVE
from fivebar_control.estimation.passive_encoder import with_elbow
from fivebar_control.estimation.readings import with_motors
from fivebar_control.estimation.step import first_update
from fivebar_description.sensors import KnownSensors


def test_further_readings_remember_those_before() -> None:
    memory = first_update(model_of(), 1, 1.0, 2.0)
    later = with_motors(with_motors(memory, 1, 1, 1.0, 2.5, 0.1, 0.2), 4, 3, 1.0, 2.5, 0.3, 0.4)
    assert (later.newest, later.last1, later.last2, later.before1, later.before2) == (2, 1.0, 2.5, 1.0, 2.5)
    assert (later.repeated1, later.repeated2) == (3, 2)
    kept = later.history.inputs[row_of(later.history, 2)]
    assert kept[[SAMPLE, PERIODS, TAU1, TAU2]].tolist() == [4.0, 3.0, 0.3, 0.4]
    for sample in range(5, 40):
        later = with_motors(later, sample, 1, 1.0, 2.5, 0.0, 0.0)
    assert later.repeated1 == MOST_REPETITIONS


@pytest.mark.parametrize(
    ("made", "entry", "lag"), [(3.0, 3, 0.0), (2.25, 3, -0.75), (2.0, 2, 0.0), (4.5, 4, 0.5), (0.5, 1, -0.5)]
)
def test_a_rate_is_put_at_the_sample_after_it(made: float, entry: int, lag: float) -> None:
    """By its own clock, of which 2 ms are known; what comes after the newest sample is put there."""
    model = model_of(known=KnownSensors(imu_clock=0.002))
    placed = with_rate(model, started(model), made + 1.0, 0.3)
    kept = placed.memory.history.late[row_of(placed.memory.history, entry), GYROSCOPE]
    assert placed.start == entry
    assert kept[VALUE] == 0.3
    assert kept[LAG] * RATE_HZ == pytest.approx(lag, abs=1e-9)


@pytest.mark.parametrize(("clock", "entry"), [(0.0, 4), (0.0015, 3), (0.0035, 2), (-0.0015, 4)])
def test_a_rate_is_put_where_its_clock_is_estimated_to_have_been(clock: float, entry: int) -> None:
    """It was stamped half a period after sample 3, by a clock that is so late (s)."""
    model, memory = model_of(), started(model_of())
    belief = memory.belief._replace(estimate=memory.belief.estimate._replace(clock=clock))
    placed = with_rate(model, memory._replace(belief=belief), 3.5, 0.3)
    assert placed.start == entry
    lag = placed.memory.history.late[row_of(placed.memory.history, entry), GYROSCOPE, LAG]
    assert lag * RATE_HZ == pytest.approx(3.5 - entry, abs=1e-12)


@pytest.mark.parametrize("zero", [0.0, 0.1])
def test_the_passive_encoders_zero_is_taken_off_its_reading(zero: float) -> None:
    model = model_of(known=KnownSensors(passive_zero=zero))
    placed = with_elbow(model, started(model), 4.0, ANGLES.q22 + zero)
    kept = placed.memory.history.late[row_of(placed.memory.history, placed.start), PASSIVE]
    assert kept[VALUE] == pytest.approx(ANGLES.q22, abs=1e-12)


@pytest.mark.parametrize("add", [with_rate, lambda *rest: with_seen(*rest, 0.15, 1e-8), with_elbow, with_extra])
def test_a_reading_of_before_the_second_sample_is_left_out(add: object) -> None:
    model = model_of()
    memory = started(model)
    before = memory.history.late.copy()
    placed = add(model, memory, -0.5, 0.3)  # type: ignore[operator]
    assert placed.start == memory.newest
    assert placed.memory.belief is memory.belief
    np.testing.assert_array_equal(memory.history.late, before)
