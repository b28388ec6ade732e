# SPDX-License-Identifier: Apache-2.0
"""The reference of a robot that takes requests: one motion at a time, from rest to rest, none when refused."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest

from fivebar_control.planning.motion_queue import MOST_VIA, Goal, GoalRefused, MotionQueue, read_goal, via_fields
from fivebar_control.trajectory.path import Path
from fivebar_control.trajectory.planner import plan_motion
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.parameters import FiveBar

RATE_HZ = 100


@pytest.fixture
def queue(dextar: FiveBar) -> MotionQueue:
    """A robot that goes from (0, 0.15) to (0, 0.12) within samples 0 to 50."""
    return MotionQueue(plan_motion(dextar, (1, -1), ((0.0, 0.15), (0.0, 0.12)), (0.5,), RATE_HZ, ZoneRule()), RATE_HZ)


def test_without_a_request_it_rests_at_the_end_of_the_plan(queue: MotionQueue) -> None:
    assert queue.at(0)[:2] == (0.0, 0.15)
    assert queue.at(25).y == pytest.approx(0.135)
    assert queue.at(50) == queue.at(5000) == (0.0, 0.12, 0.0, 0.0, 0.0, 0.0)
    assert queue.resting_from() == 50


def test_a_motion_follows_from_the_sample_that_it_is_given(queue: MotionQueue) -> None:
    order = queue.request(60, Goal(0.03, 0.12, assembly=1, duration=1.0))
    assert order == ((0.0, 0.12), (1, -1), (0.03, 0.12), 1, 1.0, 1.0, 1.0, 0.0, (), ())
    queue.begin(75, Path.through((order.start, order.goal), (1.0,)))
    assert queue.at(74) == queue.at(75) == (0.0, 0.12, 0.0, 0.0, 0.0, 0.0)
    assert queue.at(125)[:2] == pytest.approx((0.015, 0.12))
    assert queue.at(175)[:2] == queue.at(9999)[:2] == pytest.approx((0.03, 0.12))
    # a repeated sample of the motion before gets the same answer as then
    assert queue.at(25).y == pytest.approx(0.135)


def test_one_motion_after_the_other(queue: MotionQueue) -> None:
    for first, goal in ((50, (0.03, 0.12)), (150, (0.0, 0.15))):
        order = queue.request(first, Goal(*goal))
        queue.begin(first, Path.through((order.start, order.goal), (1.0,)))
    assert queue.at(150)[:2] == (0.03, 0.12)
    assert queue.at(250)[:2] == (0.0, 0.15)


def test_a_window_holds_the_references_of_its_samples_whatever_was_asked_before(queue: MotionQueue) -> None:
    def expect(sample: int, ahead: int) -> None:
        assert queue.window(sample, ahead) == tuple(queue.at(number) for number in range(sample, sample + ahead + 1))

    for sample, ahead in ((0, 5), (1, 5), (1, 5), (2, 3), (3, 3), (30, 3), (45, 20), (46, 20)):
        expect(sample, ahead)
    # a motion that begins within a window that has been given out
    order = queue.request(50, Goal(0.03, 0.12))
    queue.begin(55, Path.through((order.start, order.goal), (1.0,)))
    for sample in (47, 48, 60):
        expect(sample, 20)


def test_where_a_fault_has_left_the_robot_the_next_motion_begins(queue: MotionQueue) -> None:
    queue.request(60, Goal(0.03, 0.12))
    queue.rest_at(80, 0.01, 0.13)
    assert queue.at(79) == queue.at(5000) == (0.01, 0.13, 0.0, 0.0, 0.0, 0.0)
    order = queue.request(80, Goal(0.0, 0.15))
    assert order.start == (0.01, 0.13)
    queue.begin(90, Path.through((order.start, order.goal), (1.0,)))
    assert queue.at(90)[:2] == (0.01, 0.13)
    assert queue.at(190)[:2] == (0.0, 0.15)


def test_the_references_of_a_motion_are_announced_with_its_first_sample_and_where_it_changes(
    queue: MotionQueue,
) -> None:
    order = queue.request(60, Goal(0.03, 0.12))
    motion = Path.through((order.start, order.goal), (1.0,))
    queue.begin(75, motion, (1.0, 2.0))
    assert [queue.announced(sample) for sample in (74, 75, 76)] == [(), (1.0, 2.0), ()]
    queue.stop(motion, 90, (3.0,))
    assert [queue.announced(sample) for sample in (75, 90)] == [(), (3.0,)]


def test_no_request_is_taken_while_the_robot_moves_or_another_is_planned(queue: MotionQueue) -> None:
    with pytest.raises(GoalRefused, match=r"moving for another 0\.30 s"):
        queue.request(20, Goal(0.03, 0.12))
    queue.request(50, Goal(0.03, 0.12))
    with pytest.raises(GoalRefused, match="another request"):
        queue.request(51, Goal(0.0, 0.15))
    queue.cancel()
    assert queue.request(52, Goal(0.0, 0.15)).goal == (0.0, 0.15)
    assert queue.at(9999)[:2] == (0.0, 0.12)


def test_another_working_mode_is_refused(queue: MotionQueue) -> None:
    with pytest.raises(GoalRefused, match=r"\(-1, -1\) is reached only through a Type 1 singularity"):
        queue.request(50, Goal(0.03, 0.12, mode1=-1))
    assert queue.request(50, Goal(0.03, 0.12, mode1=1, mode2=-1)).working_mode == (1, -1)


def test_a_motion_that_nobody_ordered_or_that_begins_elsewhere_is_not_followed(queue: MotionQueue) -> None:
    elsewhere = Path.through(((0.0, 0.11), (0.03, 0.12)), (1.0,))
    with pytest.raises(GoalRefused, match="no request that this motion"):
        queue.begin(60, elsewhere)
    queue.request(50, Goal(0.03, 0.12))
    with pytest.raises(GoalRefused, match="does not begin where"):
        queue.begin(60, elsewhere)
    assert queue.at(9999)[:2] == (0.0, 0.12)


@pytest.mark.parametrize(
    ("names", "values", "expected"),
    [
        (("x", "y"), (0.1, 0.2), Goal(0.1, 0.2)),
        (("y", "x", "assembly_mode"), (0.2, 0.1, -1.0), Goal(0.1, 0.2, assembly=-1)),
        (("x", "y", "assembly_mode", "duration"), (0.1, 0.2, math.nan, math.nan), Goal(0.1, 0.2)),
        (("x", "y", "mode1", "mode2", "duration"), (0.1, 0.2, 1.0, -1.0, 2.5), Goal(0.1, 0.2, 0, 1, -1, 2.5)),
    ],
)
def test_a_message_becomes_a_goal(names: Sequence[str], values: Sequence[float], expected: Goal) -> None:
    assert read_goal(names, values) == expected


@pytest.mark.parametrize(
    ("names", "values", "why"),
    [
        (("x",), (0.1,), "expected x and y"),
        (("x", "y", "z"), (0.1, 0.2, 0.3), "expected x and y"),
        (("x", "y", "y"), (0.1, 0.2, 0.3), "at most once"),
        (("x", "y"), (0.1,), "one position per name"),
        (("x", "y"), (math.nan, 0.2), "finite"),
        (("x", "y"), (0.1, math.inf), "finite"),
        (("x", "y", "mode1"), (0.1, 0.2, 0.5), "mode1 0.5"),
        (("x", "y", "duration"), (0.1, 0.2, -1.0), "duration -1.0"),
        (("x", "y", "duration"), (0.1, 0.2, math.inf), "duration inf"),
        (("x", "y", "blend_radius"), (0.1, 0.2, 0.01), "blend_radius 0.01: expected with via points"),
        (("x", "y", "via1_x"), (0.1, 0.2, 0.3), r"via point 1 \(0.3, nan\): expected finite"),
        (("x", "y", "via1_x", "via1_y"), (0.1, 0.2, 0.3, math.inf), r"via point 1 \(0.3, inf\): expected finite"),
        (("x", "y", "via2_x", "via2_y"), (0.1, 0.2, 0.3, 0.4), r"via points \[2\]: expected them numbered from 1"),
        (("x", "y", "via0_x", "via0_y"), (0.1, 0.2, 0.3, 0.4), "expected x and y"),
        (("x", "y", "via1_z"), (0.1, 0.2, 0.3), "via1_blend_radius and so on"),
        (
            ("x", "y", "via1_x", "via1_y", "blend_radius"),
            (0.1, 0.2, 0.3, 0.4, 1e-4),
            "blend_radius 0.0001 at via point 1: expected 0 for a rest, or at least 0.001 m",
        ),
        (
            ("x", "y", "via1_x", "via1_y", "via1_blend_radius"),
            (0.1, 0.2, 0.3, 0.4, -0.01),
            "blend_radius -0.01 at via point 1",
        ),
    ],
)
def test_a_malformed_message_is_refused(names: Sequence[str], values: Sequence[float], why: str) -> None:
    with pytest.raises(GoalRefused, match=why):
        read_goal(names, values)


def test_via_points_are_read_with_their_blend_radii_and_passed_to_the_planner(queue: MotionQueue) -> None:
    """One radius for all, but where a point has its own, of which 0 is a rest."""
    names = ("via2_y", "x", "y", "via1_x", "via1_y", "via2_x", "blend_radius", "via2_blend_radius", "via1_blend_radius")
    goal = read_goal(names, (0.14, 0.0, 0.12, 0.03, 0.13, 0.02, 0.01, 0.0, math.nan))
    assert (goal.via, goal.blend_radius) == (((0.03, 0.13), (0.02, 0.14)), (0.01, 0.0))
    order = queue.request(50, goal)
    assert (order.via, order.blend_radius) == (goal.via, goal.blend_radius)
    rests = read_goal(("x", "y", "via1_x", "via1_y"), (0.0, 0.12, 0.03, 0.13))
    assert (rests.via, rests.blend_radius) == (((0.03, 0.13),), (0.0,))


@pytest.mark.parametrize("count", [0, 1, MOST_VIA])
def test_via_points_come_out_of_a_message_as_they_went_in(count: int) -> None:
    via = tuple((0.001 * number, 0.1 + 0.001 * number) for number in range(count))
    radii = tuple(0.001 * (number % 3) for number in range(count))
    fields = {"x": 0.0, "y": 0.12, **via_fields(via, radii)}
    goal = read_goal(tuple(fields), tuple(fields.values()))
    assert (goal.via, goal.blend_radius) == (via, radii)
    more = fields | via_fields(((0.0, 0.1),) * (MOST_VIA + 1), (0.0,) * (MOST_VIA + 1))
    with pytest.raises(GoalRefused, match=f"at most {MOST_VIA}"):
        read_goal(tuple(more), tuple(more.values()))
