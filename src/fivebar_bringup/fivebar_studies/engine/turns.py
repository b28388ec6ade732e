# SPDX-License-Identifier: Apache-2.0
"""The order in which a case tries what takes long the first time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

Input = TypeVar("Input")
Output = TypeVar("Output")

GOLDEN = 0.5 * (5.0**0.5 - 1.0)


def in_turns(function: Callable[[Input], Output], items: Sequence[Input], case: int) -> list[Output]:
    """Return the results of a function for all items, in their order.

    Each case begins with another item. What takes long the first time, such as the compilation of a law's loop, is then
    done by several processes at once. Multiples of the golden ratio keep the beginnings of successive cases apart.
    """
    first = int((case * GOLDEN) % 1.0 * len(items))
    results = {place: function(items[place]) for place in (*range(first, len(items)), *range(first))}
    return [results[place] for place in range(len(items))]
