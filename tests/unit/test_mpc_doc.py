# SPDX-License-Identifier: Apache-2.0
"""docs/laws.md says how the predictive law weighs torques, what its horizon can do, and what time laws cost."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from fivebar_bringup.report.thesis import MIDDLE
from fivebar_control.laws.mpc import MpcSettings
from fivebar_control.laws.mpc_problem import SCALE, weights_of
from fivebar_control.planning.line_of_sight import Point
from fivebar_control.trajectory.optimal import POINTS, quickest_passage
from fivebar_control.trajectory.passage_torques import torques_along
from fivebar_control.trajectory.path import Segment, StraightWay
from fivebar_control.trajectory.planner import plan_motion
from fivebar_control.trajectory.time_laws import OPTIMAL
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.parameters import FiveBar
from mpc_study import authority, motion

TEXT = (Path(__file__).parents[2] / "docs" / "laws.md").read_text(encoding="utf-8")


def test_the_weight_on_the_torque_itself_is_that_of_the_cost() -> None:
    (found,) = re.findall(r"\$r_0 = (\d+) \\cdot 10\^\{(-\d+)\}\\,r_s\$, ([\d.]+) % of \$r\$ by default", TEXT)
    share = float(found[0]) * 10.0 ** float(found[1])
    settings = MpcSettings()
    # a row of the program without a plan, a change or a prediction is what remains
    alone = weights_of(2, 0.01, settings.speed_time, 1.0, settings.step_weight, settings.weight)
    assert np.allclose(alone.torques - alone.steps, SCALE * share * settings.step_weight * np.eye(4), rtol=1e-9)
    assert 100.0 * share * settings.step_weight / settings.weight == pytest.approx(float(found[2]), rel=0.2)


def test_the_least_authority_on_the_locus_is_that_of_the_table() -> None:
    scenario = motion(MIDDLE, 0.5)
    for samples, wanted in ((2, 0.00048), (25, 0.27)):
        found = authority(scenario, samples)
        least = 1e3 * min(value for value, kappa in zip(found.least, found.kappa, strict=True) if kappa < 0.056)
        assert least == pytest.approx(wanted, rel=0.02)


@pytest.mark.parametrize(
    "ends", [((0.0, 0.15), (0.0, 0.02)), ((0.03, 0.14), (-0.02, 0.03)), ((0.0, 0.13), (0.03, 0.02))]
)
def test_the_average_of_the_quickest_passage_costs_what_is_said(ends: tuple[Point, Point], dextar: FiveBar) -> None:
    """Only before it is averaged is the passage the quickest: under the same limit the law takes longer."""
    ((low, high),) = re.findall(r"It is averaged over 4 % of the duration, which costs (\d+) to (\d+) % of time", TEXT)
    plan = plan_motion(dextar, (1, -1), ends, [0.5], 500, ZoneRule(), time_law=OPTIMAL)
    (segment,) = plan.path.segments
    assert isinstance(segment, Segment)
    law, way = segment.time_law, StraightWay(*ends[0], *ends[1])
    (crossing,) = plan.crossings
    crossed = math.dist(ends[0], (crossing.x, crossing.y)) / math.dist(*ends)
    quickest = quickest_passage(way, torques_along(dextar, (1, -1), way, POINTS))
    assert quickest is not None
    # on the locus itself the torque along the way is not defined
    along = np.array([one for one in map(law, np.linspace(1e-3, 0.999, 801)) if abs(one[0] - crossed) > 3e-3])
    rows = torques_along(dextar, (1, -1), way, along[:, 0])
    torque = np.abs(rows[1] * along[:, 2, None] + rows[2] * along[:, 1, None] ** 2).max()
    # the torque goes with the inverse square of the duration, and the passage is that for 1 Nm
    longer = math.sqrt(torque) * (1.0 + quickest.law.window) / quickest.duration - 1.0
    assert int(low) <= 100.0 * longer <= int(high)
