# SPDX-License-Identifier: Apache-2.0
"""The page of an identification."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fivebar_bringup.identify.result import INTERVALS, IdentificationResult
from fivebar_bringup.pages.content import Picture
from fivebar_bringup.pages.rendering import render
from fivebar_bringup.units import engineering


def html_page(findings: IdentificationResult, pictures: Sequence[Picture]) -> str:
    """Return the page: parameters, quality of the fit, figures, the robot file and its use."""
    return render(
        "identification.html",
        title=f"{findings.start.name}: identified",
        setting=f"from {findings.bag} · {findings.samples} samples at {findings.rate_hz:g} Hz",
        intervals=INTERVALS,
        parameter_rows=findings.rows(),
        quality_rows=_quality_rows(findings),
        pictures=pictures,
        parameter_file=findings.parameter_file(),
    )


def _quality_rows(findings: IdentificationResult) -> Iterable[tuple[str, ...]]:
    identification = findings.identification
    cutoffs = identification.cutoffs
    yield "condition number of the regressor, columns scaled to unit length", f"{identification.fit.condition:.3g}"
    yield "angle readings", f"{findings.encoder()}, noise {engineering(cutoffs.noise, 'rad')}"
    yield "cut-off of the differentiating filter", f"{cutoffs.derivative_hz:.3g} Hz"
    yield "cut-off of the parallel filter", f"{cutoffs.parallel_hz:.3g} Hz"
    yield "accelerations of the motors, root mean square", f"{cutoffs.acceleration:.3g} rad/s²"
    yield "time used, motors 1 and 2", ", ".join(f"{seconds:.2f} s" for seconds in identification.used_s)
    yield "independent rows behind the intervals", f"{identification.fit.independent:.0f}"
    residuals = ", ".join(engineering(value, "Nm") for value in identification.fit.deviations.tolist())
    yield "residual, root mean square, motors 1 and 2", residuals
    yield "unexplained part of the torque", ", ".join(f"{100.0 * part:.2g} %" for part in identification.misfit)
