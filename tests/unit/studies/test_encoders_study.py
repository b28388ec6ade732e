# SPDX-License-Identifier: Apache-2.0
"""What looking ahead costs and gains where only the motors' encoders are known."""

from __future__ import annotations

import numpy as np
import pytest

from encoders_study import (
    DURATIONS,
    MOVED,
    PATHS,
    EncoderRun,
    EncoderTask,
    ThesisMotion,
    drawn,
    line,
    run,
)
from fivebar_bringup.report.thesis import MIDDLE


def test_motions_follow_from_the_seed_and_stay_near_those_of_the_thesis() -> None:
    motions = drawn(5, 40)
    assert motions == drawn(5, 40) != drawn(6, 40)
    for motion in motions:
        assert DURATIONS[0] <= motion.duration <= DURATIONS[1]
        nearest = min(
            float(np.max(np.abs(np.array(motion.waypoints) - path)))
            for path in PATHS
            if len(path) == len(motion.waypoints)
        )
        assert 0.0 < nearest <= MOVED


@pytest.mark.extra
def test_a_weight_on_what_departs_from_the_plan_takes_torque_and_little_accuracy() -> None:
    motion = ThesisMotion((MIDDLE[0], MIDDLE[1]), 2.0)
    default, soft = (run(EncoderTask("encoders", f"`mpc`, `weight` {weight:g}", motion)) for weight in (3e-7, 1e-5))
    assert not soft.stopped
    assert not default.stopped
    assert soft.torque < 0.9 * default.torque
    assert soft.error < soft.estimate + 2e-4


def test_a_row_has_quantiles_and_counts_of_what_is_within_the_aims() -> None:
    runs = [EncoderRun(2e-4, 1e-4, 1.5, False), EncoderRun(1e-4, 1e-4, 0.5, True)]
    peers = [EncoderRun(1e-4, 1e-4, 1.0, False)] * 2
    row = line("one", runs, peers)
    assert "0.150 / 0.180 / 0.200 mm" in row
    assert "0.050 / 0.080 / 0.100 mm, 1 of 2" in row
    assert "1.000 / 1.300 / 1.500, 1 of 2" in row
    assert row.endswith("| 1 |")


@pytest.mark.extra
@pytest.mark.parametrize("rig", ["encoders", "realistic"])
@pytest.mark.parametrize("words", ["`unified`", "`mpc`, `weight` 1e-05"])
def test_each_law_crosses_by_the_encoders_in_a_second(words: str, rig: str) -> None:
    done = run(EncoderTask(rig, words, ThesisMotion((MIDDLE[0], MIDDLE[1]), 1.0)))
    assert not done.stopped
    assert done.error < 5e-4
    assert done.torque < 1.5
