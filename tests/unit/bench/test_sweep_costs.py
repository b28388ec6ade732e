# SPDX-License-Identifier: Apache-2.0
"""Where the processor time of a case goes, as another thread sees it."""

from __future__ import annotations

import time

from sweep_costs import REST, costs_of


def spend(seconds: float) -> None:
    """Keep the processor busy for some of this thread's time."""
    until = time.thread_time() + seconds
    while time.thread_time() < until:
        pass


def inner() -> None:
    spend(0.3)


def outer() -> None:
    inner()
    spend(0.2)


def work() -> None:
    outer()
    spend(0.1)


def test_each_part_has_its_own_processor_time_and_the_innermost_one_counts() -> None:
    costs = costs_of(work, {(__name__, "inner"): "inside", (__name__, "outer"): "outside"})
    assert abs(sum(costs.values()) - 0.6) < 0.1
    assert costs["inside"] > costs["outside"] > costs[REST] > 0.0


def test_all_of_what_has_no_part_is_the_rest() -> None:
    costs = costs_of(work, {})
    assert set(costs) == {REST}
