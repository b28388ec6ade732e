# SPDX-License-Identifier: Apache-2.0
"""The study of the path law: what it counts, and a crossing of both laws under the same push."""

from __future__ import annotations

import math

import pytest

from path_study import PathRun, line, path_run, single_crossings


def test_a_line_counts_both_distances_and_a_lost_run_for_neither() -> None:
    runs = [PathRun(1e-3, 1e-4, 1e-5), PathRun(9e-3, 2e-4, 3e-4), PathRun(math.inf, math.inf, math.inf)]
    text = line("path", 1.0, runs)
    assert text.startswith("| 1 N | `path` | 1 of 3 (")
    assert "| 2 of 3 (" in text
    assert text.endswith("| 9.00 mm | 0.200 mm | 0.30 mm |")


@pytest.mark.extra
def test_the_path_law_is_late_where_unified_is_in_time_and_both_keep_to_the_path() -> None:
    case = next(single_crossings(404041, "ideal"))
    unified, path = path_run(case, "unified", 1.0), path_run(case, "path", 1.0)
    assert path.timed > unified.timed
    assert max(unified.path, path.path) < 2e-3
    assert path.final < 1e-3
