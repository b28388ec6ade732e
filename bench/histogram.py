# SPDX-License-Identifier: Apache-2.0
"""Histograms for the console, side by side, with bars in proportion to the logarithm of a count."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from rich.table import Table

EMPTY = ""
BAR = 20
"""Characters of the longest bar."""

BINS_PER_PERIOD = 4
LONGEST = 4.0
"""Bins within a period, and periods beyond which times share the last bin."""


def histogram(title: str, period_ms: float, columns: Mapping[str, Sequence[float]]) -> Table:
    """Return the histograms of cycle times (ms) as a table with a column each; rows without any are left out."""
    table = Table("cycle time", *columns, title=title)
    counts = {name: counted(times, period_ms) for name, times in columns.items()}
    most = max((max(column) for column in counts.values()), default=0)
    width = period_ms / BINS_PER_PERIOD
    bins = round(LONGEST * BINS_PER_PERIOD) + 1
    for row in range(bins):
        here = [column[row] for column in counts.values()]
        if any(here):
            end = f"{(row + 1) * width:.2f} ms" if row + 1 < bins else "longer"
            table.add_row(f"{row * width:.2f} to {end}", *(f"{count or EMPTY:>6} {bar(count, most)}" for count in here))
    return table


def counted(times: Sequence[float], period_ms: float) -> list[int]:
    """Return how many times (ms) fall into each bin; the last one holds all that are longer."""
    counts = [0] * (round(LONGEST * BINS_PER_PERIOD) + 1)
    for time in times:
        counts[min(int(time / period_ms * BINS_PER_PERIOD), len(counts) - 1)] += 1
    return counts


def bar(count: int, most: int) -> str:
    """Return a bar for a count; one of them is seen beside thousands."""
    return "#" * round(BAR * math.log1p(count) / math.log1p(most)) if count else ""
