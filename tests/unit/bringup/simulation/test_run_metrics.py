# SPDX-License-Identifier: Apache-2.0
"""The metrics of a run from its columns: figures worked out by hand, and what is not known or has diverged."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest

from fivebar_bringup.simulation.run_metrics import RunColumns, metrics_of


def columns(samples: int, value: float) -> RunColumns:
    """Return columns that have one value everywhere."""
    single, pair = np.full(samples, value), np.full((2, samples), value)
    return RunColumns(pair, single, single, single, single, single, pair, pair, pair, single)


def test_the_figures_are_those_of_the_columns() -> None:
    run = RunColumns(
        tracking_error=np.array([[0.0, -3e-3, 1e-3], [0.0, 4e-3, 5.9e-3]]),
        from_reference=np.array([0.0, 5e-3, 6e-3]),
        from_path=np.array([0.0, 2e-3, 1e-3]),
        from_segment=np.array([9e-3, -1e-3, 5e-4]),
        det_a=np.array([0.5, 0.0, -0.5]),
        sigma=np.array([0.0, 1.0, 0.5]),
        requested=np.array([[0.1, 0.6, math.nan], [0.1, -0.2, math.nan]]),
        applied=np.array([[0.0, 0.5, -0.5], [0.0, 0.2, 0.1]]),
        motor_angle=np.array([[0.0, 0.2, 0.1], [1.0, 1.0, 0.5]]),
        estimate_error=np.array([math.nan, 1e-4, math.nan]),
    )
    metrics = metrics_of(run, 0.5)
    assert (metrics.samples, metrics.mode_changes, metrics.left_sample, metrics.saturated) == (3, 1, 2, 1)
    assert (metrics.error_x, metrics.error_y) == (3e-3, 5.9e-3)
    assert (metrics.error_peak, metrics.error_final, metrics.path_error) == (6e-3, 6e-3, 2e-3)
    # 9 mm at sigma = 0 do not count
    assert metrics.constraint_error == 1e-3
    assert (metrics.requested1, metrics.requested2, metrics.applied1, metrics.applied2) == (0.6, 0.2, 0.5, 0.2)
    # 0.5 Nm over 0.2 rad and over 0.1 rad back, 0.1 Nm over 0.5 rad
    assert metrics.work == pytest.approx(0.1 + 0.05 + 0.05)
    assert metrics.estimate_error == 1e-4
    assert math.isnan(metrics.misfit)
    assert metrics_of(run, math.inf).saturated == 0


@pytest.mark.parametrize("samples", [0, 1, 3])
@pytest.mark.parametrize("value", [math.nan, math.inf, 1e308])
def test_a_run_that_is_not_known_or_has_diverged_has_metrics(samples: int, value: float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        metrics = metrics_of(columns(samples, value), 1.0)
    largest = value if samples else math.nan
    assert metrics.error_peak == pytest.approx(largest, nan_ok=True)
    assert metrics.requested1 == pytest.approx(largest, nan_ok=True)
    assert metrics.saturated == (0 if math.isnan(largest) else samples)
    assert metrics.mode_changes == 0
