# SPDX-License-Identifier: Apache-2.0
"""The node of the pictures over DDS: markers where the joint states say, a map for latecomers, a bounded trail."""

from __future__ import annotations

import math

from graph_probe import Bench
from visualization_msgs.msg import Marker, MarkerArray

from fivebar_control.model.geometry import elbow_position
from fivebar_control.model.kinematics import det_a, state_from_joints, state_from_platform
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    JOINT_STATES,
    JOINTS,
    REFERENCE,
    SCENE,
    SCENE_MAP,
    SCENE_TRAIL,
    TORQUE_COMMAND,
    sample_stamp_ns,
)
from fivebar_description.robot_file import load_robot
from fivebar_description.ros.messages import joint_state, stamp_of

EVERY = 40
"""Samples between two states of the test, more than there are between two pictures."""


def by_group(message: MarkerArray, group: str) -> list[Marker]:
    return [marker for marker in message.markers if marker.ns == group]


def test_pictures_follow_the_joint_states(bench: Bench) -> None:
    robot = load_robot("dextar")
    node = bench.start("scene", "/robot1", trail_points=5, pictures_per_second=20.0)
    probe = bench.probe("/robot1")
    probe.join("scene", (JOINT_STATES, REFERENCE, TORQUE_COMMAND), (SCENE, SCENE_MAP, SCENE_TRAIL))
    still = (0.0,) * 4
    for number in range(12):
        at = state_from_platform(robot, (1, -1), 0.0, 0.15 - 0.008 * number, 0.0, 0.0)
        position = (at.leg1.q1, at.leg1.q2, at.leg2.q1, at.leg2.q2)
        stamp = sample_stamp_ns(EVERY * number, 500)

        def shown(stamp: int = stamp, position: tuple[float, ...] = position) -> MarkerArray | None:
            # again and again: the node asks for no acknowledgement
            probe.publish(TORQUE_COMMAND, joint_state(stamp, ACTIVE_JOINTS, effort=(0.5, -0.5)))
            probe.publish(JOINT_STATES, joint_state(stamp, JOINTS, position, still))
            pictures = probe.got(SCENE)
            return pictures[-1] if pictures and stamp_of(pictures[-1].markers[0]) == stamp else None

        picture = probe.wait_for(shown, f"picture {number}")
    links, state = by_group(picture, "links"), state_from_joints(robot, *position, *still)
    ends = [[(point.x, point.y) for point in link.points] for link in links]
    assert math.dist(ends[0][0], (robot.leg1.base_x, 0.0)) == 0.0
    assert math.dist(ends[2][1], elbow_position(robot.leg2, state.leg2.q1)) < 1e-15
    assert all(math.dist(ends[number][1], (state.x, state.y)) < 1e-12 for number in (1, 3))
    assert {marker.header.frame_id for marker in picture.markers} == {"robot1/base_link"}
    # with every fourth picture, so with the last one too
    drawn = probe.wait_for(
        lambda: [found for found in probe.got(SCENE_TRAIL) if stamp_of(found.markers[0]) == stamp], "the trail"
    )
    (trail,) = by_group(drawn[-1], "trail")
    assert len(trail.points) == len(trail.colors) == 5
    assert all(len(arc.points) > 2 for arc in by_group(picture, "torques"))

    late = bench.probe("/robot1")
    late.listen(SCENE_MAP)
    (plan,) = late.wait_for(lambda: late.got(SCENE_MAP), "the map, for a latecomer")
    (locus,), (path,) = by_group(plan, "type2_locus"), by_group(plan, "path")
    clear = [(point.x, point.y) for point in locus.points if abs(point.x) < 0.02]
    assert len(clear) > 10
    assert max(abs(det_a(state_from_platform(robot, (1, -1), *place, 0.0, 0.0))) for place in clear) < 1e-9
    assert (path.points[0].x, path.points[0].y) == (0.0, 0.15)
    assert node.status is None
