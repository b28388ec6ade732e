# SPDX-License-Identifier: Apache-2.0
"""A sensor from another package: where its readings are put, and what they say of the state."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from fivebar_control.estimation.constants import EstimatorModel
from fivebar_control.estimation.covariance import SIZE, VX, VY, X, Y
from fivebar_control.estimation.ekf import Belief
from fivebar_control.estimation.history import SAMPLE, entry_of, keep_late, row_of
from fivebar_control.estimation.late_reading import EXTRA
from fivebar_control.estimation.measurements import Taken, taken
from fivebar_control.estimation.readings import EstimatorMemory, Placed
from fivebar_control.model.state import WorkingMode
from fivebar_description.extra_sensor import ExpectedReading
from fivebar_description.parameters import FiveBar


def nothing_expected(
    settings: Any, robot: FiveBar, mode: WorkingMode, x: float, y: float, vx: float, vy: float
) -> ExpectedReading:
    """Return what is expected of a sensor that is not there."""
    return ExpectedReading(math.nan, 0.0, 0.0, 0.0, 0.0)


extra_expected: Callable[..., ExpectedReading] = nothing_expected
"""Expectation of the sensor, to be bound before (`step.filter_functions`)."""


def with_extra(model: EstimatorModel, memory: EstimatorMemory, moment: float, value: float) -> Placed:
    """Add a reading; it is put at the sample before the moment (samples) at which it was made."""
    entry = entry_of(memory.history, memory.newest, math.floor(moment))
    if entry == 0:
        return Placed(memory, memory.newest)
    at = float(memory.history.inputs[row_of(memory.history, entry), SAMPLE])
    keep_late(memory.history, entry, EXTRA, value, (moment - at) / model.rate_hz, model.extra_variance)
    return Placed(memory, entry)


def extra_taken(model: EstimatorModel, belief: Belief, value: float, lag: float, variance: float) -> Taken:
    """Return the effect of a reading; `lag` (s) is the time from the belief's sample to it."""
    e, known = belief.estimate, model.filter
    x, y = e.x + lag * e.vx, e.y + lag * e.vy
    expected = extra_expected(model.extra, known.robot, known.mode, x, y, e.vx, e.vy)
    row = np.zeros(SIZE)
    row[X], row[VX] = expected.by_x, expected.by_vx + lag * expected.by_x
    row[Y], row[VY] = expected.by_y, expected.by_vy + lag * expected.by_y
    return taken(belief, row, value - expected.value, variance)
