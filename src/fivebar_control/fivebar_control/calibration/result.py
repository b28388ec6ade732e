# SPDX-License-Identifier: Apache-2.0
"""A calibrated geometry, and what is derived from it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.calibration.closure import GEOMETRY, locus_rows
from fivebar_control.calibration.record import Turning

FloatArray = NDArray[np.float64]

CONFIDENCE, QUANTILE = 0.95, 1.959964
"""Confidence of the intervals, and the quantile of the normal distribution for it."""


class LocusPassage(NamedTuple):
    """A passage through the Type 2 locus: its sample, and the row of the elbow gap's derivatives, [8]."""

    sample: int
    row: FloatArray


class Calibration(NamedTuple):
    """A calibrated geometry.

    Attributes:
        start: [15], parameters before, in the order of `PARAMETERS`; with a camera [19], as are the others.
        values: [15], and after.
        covariance: [15, 15], with what was known before.
        before: [15], standard deviations before.
        information: [15, 15], of the recording alone, and on the geometry of those before it.
        times: [k], of the samples that were used (s).
        theta: [k], the distal link's angle there (rad).
        platform: [k, 2], the platform there (m).
        residuals: [k], of the closure (m).
        across: [k], det A.
        yielding: by how much play and elasticity of the transmissions open the loop near the locus, root mean square
            (m): an estimator that takes them as rigid finds the geometry wrong by that.
        crossings: passages through the locus.
        misfit: mean of the squared residuals in units of their variances; 1 where robot and noise are as modelled.
        colour: factor by which correlated residuals widen the variances.
        turning: readings of the gyroscope, None without one.
        resolution: of the encoders (rad).
        seen: number of a camera's positions that were used.
    """

    start: FloatArray
    values: FloatArray
    covariance: FloatArray
    before: FloatArray
    information: FloatArray
    times: FloatArray
    theta: FloatArray
    platform: FloatArray
    residuals: FloatArray
    across: FloatArray
    yielding: float
    crossings: list[LocusPassage]
    misfit: float
    colour: float
    turning: Turning | None
    resolution: float
    seen: int = 0

    @property
    def half_widths(self) -> FloatArray:
        """Half widths of the intervals, [15]."""
        return QUANTILE * np.sqrt(np.diag(self.covariance))

    def gaps_before(self) -> FloatArray:
        """Return the elbow gap (m) of the geometry before at the crossings, by that after the calibration."""
        change = (self.start - self.values)[: len(GEOMETRY)]
        return np.array([row @ change for _, row in self.crossings])

    def gap_half_widths(self) -> FloatArray:
        """Return half widths (m) of the elbow gap's intervals at the crossings."""
        part = self.covariance[: len(GEOMETRY), : len(GEOMETRY)]
        return QUANTILE * np.sqrt([row @ part @ row for _, row in self.crossings])

    def locus_half_widths(self) -> FloatArray:
        """Return half widths (m) of the elbow gap's intervals all over the Type 2 locus (`locus_rows`)."""
        part = self.covariance[: len(GEOMETRY), : len(GEOMETRY)]
        rows = locus_rows(self.values[: len(GEOMETRY)])
        widths: FloatArray = QUANTILE * np.sqrt(np.sum((rows @ part) * rows, axis=1))
        return widths


def covariance_of(information: FloatArray, scale: FloatArray) -> FloatArray:
    """Return the inverse of an information matrix whose parameters have these scales."""
    inverse: FloatArray = np.linalg.inv(information * np.outer(scale, scale)) * np.outer(scale, scale)
    return inverse
