# SPDX-License-Identifier: Apache-2.0
"""Limits of the estimator's watch follow from what sound robots reach, with an honest distance from it."""

from __future__ import annotations

import numpy as np
import pytest

from fivebar_bringup.odds.misfit_limits import (
    FEWEST,
    alarm_rate,
    as_settings,
    fitted_limit,
    fitted_limits,
    rounded_up,
)
from fivebar_control.estimation.constants import WatchLimits

ALARMS = 1000.0


@pytest.mark.extra
def test_a_limit_is_exceeded_as_seldom_as_it_promises() -> None:
    """Over many samples of maxima with an exponential tail: the limit's own rate of alarms."""
    random, rates = np.random.default_rng(39), []
    for _ in range(200):
        maxima = (3.0 + 0.2 * random.exponential(1.0, 400)).tolist()
        fit = fitted_limit(maxima, ALARMS)
        assert fit.limit >= max(fit.largest, fit.quantile)
        rates.append(float(np.exp(-(fit.limit - 3.0) / 0.2)))
    # the upper end of the interval is on the safe side in nearly all of them
    assert np.mean(np.array(rates) < 1.0 / ALARMS) > 0.93
    # and no farther away than its interval: a limit without power would be as safe
    assert np.median(rates) > 1e-3 / ALARMS


@pytest.mark.extra
def test_the_rate_of_alarms_is_what_runs_come_to_and_its_upper_end_beyond() -> None:
    """Of shares of a limit with an exponential tail, one in 1000 of which exceeds the limit."""
    random, rates = np.random.default_rng(40), []
    for _ in range(50):
        uses = 1.0 + 0.1 * (random.exponential(1.0, (1000, 1)) - np.log(ALARMS))
        rates.append(alarm_rate(uses.tolist()))
    assert np.median([one.rate for one in rates if one is not None]) == pytest.approx(1.0 / ALARMS, rel=0.4)
    assert np.mean([one.upper > 1.0 / ALARMS for one in rates if one is not None]) > 0.9
    assert alarm_rate([[0.1] * (FEWEST - 1)]) is None


def test_runs_of_a_crossing_that_are_alike_tell_less_of_the_rate_of_alarms() -> None:
    random = np.random.default_rng(41)
    each = 0.6 + 0.05 * random.exponential(1.0, 100)
    apart, together = (
        alarm_rate([[use] for use in each.tolist() for _ in range(9)]),
        alarm_rate([[use] * 9 for use in each.tolist()]),
    )
    assert apart is not None and together is not None
    assert apart.rate == together.rate
    assert apart.rate < apart.upper < together.upper


def test_too_few_runs_are_refused_and_equal_ones_bear_a_limit() -> None:
    with pytest.raises(ValueError, match=f"{FEWEST - 1} runs: expected at least {FEWEST}"):
        fitted_limit([1.0] * (FEWEST - 1))
    assert fitted_limit([2.0] * FEWEST).limit == pytest.approx(2.0)


def test_each_limit_is_fitted_to_its_own_maxima_and_rounded_up() -> None:
    maxima = [WatchLimits(10.0, 2.0, 5.0 + 0.01 * number) for number in range(50)]
    found = fitted_limits(maxima)
    assert found["misfit_limit"].limit == pytest.approx(10.0)
    assert found["jump_limit"].largest == pytest.approx(5.49)
    assert as_settings(found)["offset_limit"] == pytest.approx(2.0)
    assert [rounded_up(one) for one in (12.01, 0.4501, 99.5)] == [13.0, 0.46, 100.0]
