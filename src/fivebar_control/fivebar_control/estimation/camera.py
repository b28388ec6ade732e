# SPDX-License-Identifier: Apache-2.0
"""The camera above the robot: where the positions that it sees are put, and what they say of the state."""

from __future__ import annotations

import math

import numpy as np

from fivebar_control.estimation.constants import EstimatorModel
from fivebar_control.estimation.covariance import SIZE, VX, VY, X, Y
from fivebar_control.estimation.ekf import Belief
from fivebar_control.estimation.history import SAMPLE, entry_of, keep_late, row_of
from fivebar_control.estimation.late_reading import CAMERA
from fivebar_control.estimation.measurements import Taken, taken
from fivebar_control.estimation.readings import EstimatorMemory, Placed

CAMERA_GATE = 6.0
"""Distance of a position by the camera from the estimate, in standard deviations, beyond which it is not taken: noise
does not get there, and a wrong tag is farther away."""


def with_seen(
    model: EstimatorModel, memory: EstimatorMemory, moment: float, x: float, y: float, variance: float
) -> Placed:
    """Add a position (m) by the camera with the variance (m^2) that it says of itself.

    It is put at the sample before its exposure, and takes effect there: what followed is worked out again.
    """
    entry = entry_of(memory.history, memory.newest, math.floor(moment))
    if entry == 0:
        return Placed(memory, memory.newest)
    at = float(memory.history.inputs[row_of(memory.history, entry), SAMPLE])
    lag = (moment - at) / model.rate_hz
    # beyond the gate a reading has no effect, and so its innovation does not count
    keep_late(memory.history, entry, CAMERA, x, lag, max(variance, model.camera_variance), y, False)
    return Placed(memory, entry)


def seen_at(belief: Belief, x: float, y: float, lag: float, variance: float, gate: float) -> Taken:
    """Return the effect of a position by the camera; one beyond the gate has none, but its misfit is returned.

    Args:
        belief: at a sample.
        x, y: position (m).
        lag: time (s) from the sample to the exposure.
        variance: of either coordinate (m^2).
        gate: in standard deviations of the innovation.
    """
    e, p = belief.estimate, belief.covariance
    row_x, row_y = np.zeros(SIZE), np.zeros(SIZE)
    row_x[X], row_x[VX], row_y[Y], row_y[VY] = 1.0, lag, 1.0, lag
    off_x, off_y = x - e.x - lag * e.vx, y - e.y - lag * e.vy
    column_x, column_y = p @ row_x, p @ row_y
    s_xx, s_yy = float(np.dot(row_x, column_x)) + variance, float(np.dot(row_y, column_y)) + variance
    s_xy = float(np.dot(row_y, column_x))
    squared = (s_yy * off_x * off_x - 2.0 * s_xy * off_x * off_y + s_xx * off_y * off_y) / (s_xx * s_yy - s_xy * s_xy)
    if not squared <= gate * gate:
        return Taken(belief, 0.5 * squared, math.nan)
    by_x = taken(belief, row_x, off_x, variance)
    e = by_x.belief.estimate
    by_both = taken(by_x.belief, row_y, y - e.y - lag * e.vy, variance)
    return Taken(by_both.belief, 0.5 * squared, math.nan)
