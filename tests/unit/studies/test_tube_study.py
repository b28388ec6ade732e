# SPDX-License-Identifier: Apache-2.0
"""The study of the tube: robots within the mismatch, runs compared with the tube, those at a limit told apart."""

from __future__ import annotations

from itertools import islice

import pytest

from fivebar_studies.benchmark.crossings import benchmark
from tube_study import (
    BELIEVED,
    OFF_MODEL,
    TubeRun,
    believed_crossings,
    off_model,
    read,
    table,
    tube_run,
)


def test_robots_off_the_model_are_within_the_mismatch_and_the_same_again() -> None:
    case = benchmark()[0].on("ideal")
    drawn = [off_model(case._replace(number=number)) for number in range(200)]
    scales = [scale - 1.0 for one in drawn for scale in (one.mass_scale, one.inertia_scale)]
    assert 0.09 < max(map(abs, scales)) <= 0.1
    assert 0.18 < max(abs(one.friction_scale - 1.0) for one in drawn) <= 0.2
    assert drawn[3] == off_model(case._replace(number=3))


def test_a_table_counts_runs_at_a_limit_apart() -> None:
    runs = [
        TubeRun(0, BELIEVED, False, 0.5, 1e-4, 5e-5),
        TubeRun(1, BELIEVED, False, 1.01, 1e-4, 1.1e-4),
        TubeRun(2, BELIEVED, True, float("inf"), 1e-4, 1e-2),
    ]
    _, _, free, limited = table("unified", runs).splitlines()
    assert free.startswith("| `unified`, as believed | 2 | 1 (1.3% to 98.7%) | 1.01 | 0.100, 0.10 mm |")
    assert limited.startswith("| `unified`, as believed, at a motor's limit | 1 | 0 (0.0% to 97.5%) | inf |")
    lines = [",".join(map(str, run)) for run in runs]
    assert read(lines) == runs


@pytest.mark.extra
def test_a_crossing_of_the_sweep_stays_within_its_tube_with_either_law() -> None:
    (case,) = islice(believed_crossings(1), 1)
    for controller in ("unified", "mpc"):
        believed = tube_run(case, controller, BELIEVED)
        off = tube_run(off_model(case), controller, OFF_MODEL)
        assert believed.inside
        assert off.inside
        assert not believed.limited
        # the robot is another one, and its tube wider
        assert off.error > 2.0 * believed.error
        assert off.radius > 2.0 * believed.radius
