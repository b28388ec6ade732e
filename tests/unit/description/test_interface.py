# SPDX-License-Identifier: Apache-2.0
"""The stamps of the sample grid, and the list of topics."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_description.interface import GOAL, GOAL_STATUS, TOPICS, sample_of_stamp, sample_stamp_ns

RATES = [rate for rate in range(1, 20_001) if 1_000_000_000 % rate == 0]


@pytest.mark.parametrize(
    ("sample", "rate_hz", "stamp"),
    [
        (0, 500, 1_000_000_000),
        (1, 500, 1_002_000_000),
        (499, 500, 1_998_000_000),
        (500, 500, 2_000_000_000),
        (3, 1000, 1_003_000_000),
        (7, 8, 1_875_000_000),
        (3_600_000, 1000, 3_601_000_000_000),
    ],
)
def test_stamps_are_whole_nanoseconds_from_one_second_on(sample: int, rate_hz: int, stamp: int) -> None:
    assert sample_stamp_ns(sample, rate_hz) == stamp
    assert sample_of_stamp(stamp, rate_hz) == sample


@given(sample=st.integers(0, 10**9), rate_hz=st.sampled_from(RATES), off=st.integers(1, 10**9))
def test_only_stamps_on_the_grid_name_a_sample(sample: int, rate_hz: int, off: int) -> None:
    stamp = sample_stamp_ns(sample, rate_hz)
    period = 1_000_000_000 // rate_hz
    assert sample_of_stamp(stamp, rate_hz) == sample
    found = sample_of_stamp(stamp + off, rate_hz)
    assert found == (sample + off // period if off % period == 0 else None)


@pytest.mark.parametrize("stamp", [0, 998_000_000, 999_999_999])
def test_stamps_before_sample_0_name_no_sample(stamp: int) -> None:
    assert sample_of_stamp(stamp, 500) is None


def test_topics_are_relative_and_different() -> None:
    names = [topic.name for topic in TOPICS]
    assert len(set(names)) == len(names)
    assert not [name for name in names if name.startswith("/")]


def test_late_subscribers_get_all_faults_and_present_states_and_the_control_path_keeps_eight() -> None:
    depths = {topic.name: topic.qos.depth for topic in (*TOPICS, GOAL, GOAL_STATUS) if topic.qos.transient_local}
    states = dict.fromkeys(("safety/state", "drives/state", "run/status", "run/plan", "run/epoch", "goal/status"), 1)
    assert depths == {"faults": 32, "run/ready": 32, **states}
    assert {topic.qos.depth for topic in TOPICS if topic.name not in depths} == {8}
