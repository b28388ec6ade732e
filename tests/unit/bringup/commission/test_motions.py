# SPDX-License-Identifier: Apache-2.0
"""The motions of a commissioning, which are found for any robot."""

from __future__ import annotations

from itertools import pairwise

import pytest

from fivebar_bringup.motions.start import HOME_MODE
from fivebar_commission.motions import (
    FARTHEST,
    LEAST_KAPPA,
    crossing_points,
    exciting_points,
    state_at,
    through_all,
    turned,
    way_of,
)
from fivebar_control.model.kinematics import assembly_mode, working_mode
from fivebar_control.model.singularity import STRETCHED, distal_links, inverse_condition
from fivebar_description.robot_file import read_robot


@pytest.mark.parametrize("name", ["motkin", pytest.param("dextar", marks=pytest.mark.extra), "unequal"])
def test_they_begin_and_end_at_home_and_cross_where_they_should(name: str) -> None:
    file = read_robot(name)
    robot, home = file.five_bar(), file.home_m
    start = state_at(robot, home)
    exciting = exciting_points(robot, home)
    ways = crossing_points(robot, home)
    crossing = through_all(robot, home, ways)
    for points in (exciting, crossing):
        assert points[0] == points[-1] == home
        assert all(one != other for one, other in pairwise(points))
        for one in points:
            state = state_at(robot, one)
            assert working_mode(state) == HOME_MODE
            assert inverse_condition(state) >= LEAST_KAPPA or one == home
            # no cable is wound up
            assert max(map(abs, turned(start, state))) < FARTHEST
    found = [way_of(robot, start, *ends) for ends in pairwise(exciting)]
    assert all(way is not None and way.crossing is None for way in found)
    crossings = [way_of(robot, start, *ends) for ends in pairwise(crossing)]
    assert all(way is not None for way in crossings)
    places = [way.crossing for way in crossings if way is not None and way.crossing is not None]
    assert len(places) == 2 * len(ways) == 8
    assert all(distal_links(state_at(robot, place)) == STRETCHED for place in places)
    assert len({assembly_mode(state_at(robot, way.end)) for way in ways} | {assembly_mode(start)}) == 2
    assert len({(round(x, 3), round(y, 3)) for x, y in places}) >= 3
