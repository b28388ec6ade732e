# SPDX-License-Identifier: Apache-2.0
"""The benchmark of the environment measures it and the closed loop."""

from __future__ import annotations

from environment_speed import environment_speed


def test_both_are_measured() -> None:
    found = environment_speed("ideal", rounds=1)
    # so slow is no machine that runs the tests
    assert min(found) > 1000.0
