# SPDX-License-Identifier: Apache-2.0
"""The shapes of a scene against the model: where they are, and that they stay finite and few."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.scene.map import loci_shapes, path_shapes
from fivebar_bringup.scene.moving import LONGEST_ARROW, SceneSample, Trail, moving_shapes
from fivebar_bringup.scene.settings import SceneSettings
from fivebar_bringup.scene.shapes import Shape
from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.geometry import elbow_position, reach_margin
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.model.state import State, WorkingMode
from fivebar_description.parameters import FiveBar, friction_torque
from fivebar_description.robot_file import load_robot

States = Callable[[int, int], list[State]]
SETTINGS = SceneSettings()
MODE = (1, -1)


def named(shapes: list[Shape], group: str) -> list[Shape]:
    return [shape for shape in shapes if shape.group == group]


def test_links_begin_and_end_where_the_kinematics_say(robot: FiveBar, regular_states: States) -> None:
    for state in regular_states(20, 1):
        links = named(moving_shapes(robot, SceneSample(state), SETTINGS), "links")
        for number, (leg, angles) in enumerate(((robot.leg1, state.leg1), (robot.leg2, state.leg2))):
            elbow = elbow_position(leg, angles.q1)
            lower, upper = links[2 * number].points, links[2 * number + 1].points
            for point, place in ((lower[0], (leg.base_x, 0.0)), (lower[1], elbow), (upper[0], elbow)):
                assert math.dist(point[:2], place) < 1e-14
            assert math.dist(upper[1][:2], (state.x, state.y)) < 1e-12


@pytest.mark.parametrize("mode", [(1, -1), (1, 1)])
def test_the_locus_is_where_the_distal_links_align(robot: FiveBar, mode: WorkingMode) -> None:
    type1, type2, others = loci_shapes(robot, mode)
    for x, y, _ in type1.points:
        assert min(abs(reach_margin(leg, x, y)) for leg in (robot.leg1, robot.leg2)) < 1e-9
    inside = [
        (x, y) for x, y, _ in type2.points if min(reach_margin(leg, x, y) for leg in (robot.leg1, robot.leg2)) > 1e-4
    ]
    assert len(inside) > 50
    # a micrometre beside the locus det A is some 1e-5
    assert max(abs(det_a(state_from_platform(robot, mode, x, y, 0.0, 0.0))) for x, y in inside) < 1e-9
    assert len(others.points) > len(type2.points)


def test_zones_lie_on_the_path_around_the_crossings() -> None:
    scenario = load_scenario("middle")
    plan = scenario.plan()
    path, zone = path_shapes(load_robot("dextar"), plan, zones=True)
    assert all(abs(x) < 1e-12 and 0.02 - 1e-12 <= y <= 0.15 + 1e-12 for x, y, _ in (*path.points, *zone.points))
    low, high = min(y for _, y, _ in zone.points), max(y for _, y, _ in zone.points)
    assert all(low < crossing.y < high for crossing in plan.crossings)
    assert high - low < 0.1
    assert path_shapes(load_robot("dextar"), plan, zones=False)[1].points == ()


def test_forces_are_those_of_the_model_also_on_the_locus(robot: FiveBar, locus_states: States) -> None:
    for state in locus_states(10, 2):
        torque = (0.4, -0.7)
        shapes = moving_shapes(robot, SceneSample(state, torque), SETTINGS)
        arrows = [
            [end - start for start, end in zip(*shape.points, strict=True)][:2] for shape in named(shapes, "forces")
        ]
        friction = (friction_torque(robot.leg1, state.leg1.dq1), friction_torque(robot.leg2, state.leg2.dq1))
        motion = direct_dynamics(robot, state, *torque, *friction)
        total = math.hypot(robot.mass * motion.ax, robot.mass * motion.ay) * SETTINGS.force_length
        assert math.hypot(*arrows[2]) == pytest.approx(min(total, LONGEST_ARROW), rel=1e-9)
        assert all(math.hypot(*arrow) <= LONGEST_ARROW + 1e-12 for arrow in arrows)


def test_what_is_unknown_is_not_drawn(robot: FiveBar, regular_states: States) -> None:
    (state,) = regular_states(1, 3)
    shapes = moving_shapes(robot, SceneSample(state), SETTINGS)
    absent = {shape.group for shape in shapes if not shape.points}
    assert absent == {"torques", "forces", "reference"}


def test_an_old_trail_is_bounded_and_a_resting_robot_leaves_none(dextar: FiveBar) -> None:
    trail = Trail(7)
    assert trail.shape().points == ()
    for step in range(100):
        state = state_from_platform(dextar, MODE, 0.0, 0.15 - 0.001 * step, 0.0, 0.0)
        trail.add(state)
        trail.add(state)
    assert len(trail) == 7
    shape = trail.shape()
    assert [round(1e3 * y) for _, y, _ in shape.points] == [57, 56, 55, 54, 53, 52, 51]
    assert len(shape.colours) == len(shape.points)
