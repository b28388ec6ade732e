# SPDX-License-Identifier: Apache-2.0
"""What nodes measure of themselves: intervals between answers, and times from sample to torque."""

from __future__ import annotations

import statistics

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_description.ros.latency_watch import BIN_MS, BINS, LatencyWatch
from fivebar_description.ros.rate_watch import RateWatch

INTERVALS = (0.002, 0.0021, 0.0019, 0.005, 0.002)


def noted(watch: RateWatch, begin: float = 10.0) -> RateWatch:
    now = begin
    watch.note(now)
    for interval in INTERVALS:
        now += interval
        watch.note(now)
    return watch


def test_rates_are_those_of_the_intervals() -> None:
    rates = noted(RateWatch(late_after=0.003)).take()
    assert rates.answers == len(INTERVALS)
    assert rates.rate_hz == pytest.approx(len(INTERVALS) / sum(INTERVALS), rel=1e-9)
    assert rates.jitter_ms == pytest.approx(statistics.pstdev(INTERVALS) * 1e3, rel=1e-6)
    assert rates.interval_max_ms == pytest.approx(5.0, abs=1e-9)
    assert rates.late == 1


def test_taking_begins_anew_but_the_interval_across_counts() -> None:
    watch = noted(RateWatch(late_after=0.003))
    watch.take()
    assert watch.take() == (0, 0.0, 0.0, 0.0, 0)
    watch.note(10.0 + sum(INTERVALS) + 0.004)
    rates = watch.take()
    assert rates.answers == 1
    assert rates.interval_max_ms == pytest.approx(4.0, abs=1e-6)
    assert (rates.late, watch.late) == (1, 2)


def test_a_pause_is_not_late() -> None:
    watch = noted(RateWatch(late_after=0.006))
    watch.pause()
    watch.note(60.0)
    assert watch.late == 0


@given(st.lists(st.floats(0.0, 0.2), min_size=1, max_size=300))
def test_latencies_are_the_quantiles_to_a_bin(seconds: list[float]) -> None:
    watch = LatencyWatch()
    for one in seconds:
        watch.note(one)
    found = watch.summary()
    assert found is not None
    milliseconds = np.array(seconds) * 1e3
    assert found["max"] == pytest.approx(float(np.max(milliseconds)), abs=1e-9)
    for name, fraction in (("p50", 0.5), ("p99", 0.99)):
        exact = float(np.quantile(milliseconds, fraction, method="inverted_cdf"))
        if exact < (BINS - 1) * BIN_MS:
            assert exact - 1e-9 <= found[name] <= exact + BIN_MS + 1e-9
        else:
            assert found[name] >= (BINS - 1) * BIN_MS


def test_without_answers_there_is_no_latency() -> None:
    assert LatencyWatch().summary() is None
