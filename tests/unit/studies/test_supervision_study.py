# SPDX-License-Identifier: Apache-2.0
"""The study of the three supervisions: what it counts, and that each one acts."""

from __future__ import annotations

from itertools import islice

import pytest

from fivebar_control.laws.registry import SUPERVISIONS
from supervision_study import SupervisedRun, supervised_run, table, timed_crossings


def test_the_table_has_a_row_for_each_supervision_of_a_rig() -> None:
    runs = [
        SupervisedRun("ideal", supervision, supervision != "sigmoid", 1e-3 * number, 1.5 + number)
        for supervision in SUPERVISIONS
        for number in (0, 1)
    ]
    rows = [line.split(" | ") for line in table(runs).splitlines()[2:]]
    assert [row[1].strip("`") for row in rows] == list(SUPERVISIONS)
    assert [row[2].partition(" (")[0] for row in rows] == ["2 of 2", "0 of 2", "2 of 2"]
    assert all(row[3:] == ["0.50, 0.95 mm", "1 |"] for row in rows)


@pytest.mark.extra
def test_the_supervisions_make_three_runs_of_one_crossing() -> None:
    (case,) = islice(timed_crossings(31331, "ideal"), 1)
    runs = [supervised_run(case, supervision) for supervision in SUPERVISIONS]
    assert all(run.success for run in runs)
    assert len({run.error for run in runs}) == len(SUPERVISIONS)
