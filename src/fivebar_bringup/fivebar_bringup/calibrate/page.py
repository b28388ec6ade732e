# SPDX-License-Identifier: Apache-2.0
"""The page of a calibration."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from fivebar_bringup.calibrate.result import INTERVALS, CalibrationResult
from fivebar_bringup.pages.content import Picture
from fivebar_bringup.pages.rendering import render


def html_page(result: CalibrationResult, pictures: Sequence[Picture]) -> str:
    """Return the page: geometry, what is not seen, quality of the fit, mounting, figures and robot file."""
    return render(
        "calibration.html",
        title=f"{result.start.name}: calibrated",
        setting=f"from {result.bag} · {len(result.calibration.crossings)} crossings of the Type 2 locus",
        intervals=INTERVALS,
        parameter_rows=_parameter_rows(result),
        quality_rows=quality_rows(result),
        unseen=[direction.words for direction in result.unseen],
        mounting_rows=result.mounting_rows(),
        pictures=pictures,
        parameter_file=result.parameter_file(),
    )


def _parameter_rows(result: CalibrationResult) -> Iterable[tuple[str, ...]]:
    for parameter in result.parameters():
        yield (
            parameter.name,
            f"{parameter.before:g} ± {parameter.half_width_before:.2g}",
            parameter.text(),
            parameter.unit,
        )


def quality_rows(result: CalibrationResult) -> list[tuple[str, str]]:
    """Return what the quality of the calibration is, in words."""
    calibration = result.calibration
    rows = [
        ("largest elbow gap before", f"{1e3 * float(np.max(np.abs(calibration.gaps_before()))):.3f} mm"),
        ("elbow gap after, largest half width", f"{1e3 * float(np.max(calibration.gap_half_widths())):.4f} mm"),
        ("the same anywhere on the locus", f"{1e3 * float(np.max(calibration.locus_half_widths())):.4f} mm"),
        ("mean squared residual in units of the assumed noise", f"{calibration.misfit:.2f}"),
        ("variances widened for correlated residuals", f"{calibration.colour:.1f} times"),
        ("what transmissions that yield open the loop by near the locus", f"{1e3 * calibration.yielding:.4f} mm"),
        ("touched points", f"{result.touched}"),
        ("positions by the camera", f"{calibration.seen}"),
    ]
    if calibration.turning is not None:
        rows.append(("noise of the gyroscope", f"{calibration.turning.noise:.2g} rad/s"))
    return rows
