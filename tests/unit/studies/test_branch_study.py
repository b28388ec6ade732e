# SPDX-License-Identifier: Apache-2.0
"""The study of both branches of the locus: what it counts, and a crossing of each."""

from __future__ import annotations

import math

import pytest

from branch_study import FORCES, ROBOTS, BranchRun, accepted, branch_run, table


def test_the_table_counts_each_branch_and_takes_a_lost_run_for_no_success() -> None:
    runs = [
        BranchRun("stretched", 2.0, True, (1e-3, 1.9e-3, math.inf), (True, False)),
        BranchRun("stretched", 2.0, True, (3e-3, 5e-3, 9e-3), (True, True)),
        BranchRun("folded", 2.0, False, (1e-3, 2.1e-3, 4e-3), (False, False)),
    ]
    rows = [line.split(" | ") for line in table(runs).splitlines()[2:]]
    counts = [[cell.partition(" (")[0] for cell in row[1:]] for row in rows]
    assert counts == [
        ["2 of 2", "0 of 1"],
        ["1 of 2", "1 of 1"],
        ["1 of 2", "0 of 1"],
        ["0 of 2", "0 of 1"],
        ["3 of 4", "0 of 2"],
    ]


@pytest.mark.extra
def test_a_stronger_push_moves_a_crossing_of_either_branch_farther() -> None:
    runs = [branch_run(*pair) for pair in accepted(8080, 1)]
    assert sorted(run.branch for run in runs) == ["folded", "stretched"]
    for run in runs:
        assert run.alone
        assert len(run.pushed) == len(FORCES)
        assert 1e-5 < run.pushed[0] < run.pushed[1] < run.pushed[2]
        assert len(run.sensed) == ROBOTS
