# SPDX-License-Identifier: Apache-2.0
"""Motions on request over ROS: the trajectory generator plans beside its cycle, moves, arrives, or says why not."""

from __future__ import annotations

import json
import math
import os
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from builtin_interfaces.msg import Duration
from diagnostic_msgs.msg import DiagnosticStatus
from forked_node import ForkedNode
from geometry_msgs.msg import PoseStamped
from graph_probe import DEADLINE, RATE_HZ, Bench, Probe
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from fivebar_bringup.nodes.goal_client import GoalClient
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.planning.orders import TimedPoint
from fivebar_control.planning.timed_points import digest_of, read_points
from fivebar_control.trajectory.path import Path as PlannedPath
from fivebar_control.trajectory.planner import plan_motion
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.interface import (
    GOAL,
    GOAL_PATH,
    GOAL_POSE,
    GOAL_STATUS,
    GOAL_TARGET,
    GOAL_TRAJECTORY,
    JOINT_STATES,
    JOINTS,
    REFERENCE,
    VALUES,
    sample_stamp_ns,
)
from fivebar_description.robot_file import load_robot
from fivebar_description.ros.messages import joint_state, stamp_of

MOTION = {"waypoints": [0.0, 0.15, 0.0, 0.14], "segment_duration": [0.1]}
"""Samples 0 to 50."""

GOAL_REFERENCE = (0.0, 0.03, 0.0, 0.0)
HOME_REFERENCE = (0.0, 0.14, 0.0, 0.0)


class Driver:
    """Plays the rest of the graph: one sample after the other."""

    def __init__(self, probe: Probe) -> None:
        self.probe = probe
        self.sample = 0
        posture = inverse_geometry(load_robot("dextar"), (1, -1), 0.0, 0.14)
        self._posture = tuple(posture)
        probe.join("trajectory_generator", [JOINT_STATES, GOAL], [REFERENCE, GOAL_STATUS])
        probe.ask([(JOINT_STATES, self._message())], [REFERENCE], 1)

    def _message(self) -> JointState:
        still = (0.0,) * 4
        return joint_state(sample_stamp_ns(self.sample, RATE_HZ), JOINTS, self._posture, still, still)

    def step(self) -> tuple[float, ...]:
        """Go on by one sample and return the next one's reference x, y, vx, vy."""
        self.sample += 1
        self.probe.publish(JOINT_STATES, self._message())
        return tuple(self.probe.answer(REFERENCE, self.sample + 1).position)

    def references(self) -> dict[int, tuple[float, ...]]:
        """Return x, y, vx, vy of all samples so far."""
        numbers = self.probe.samples(REFERENCE)
        told = [tuple(message.position) for message in self.probe.got(REFERENCE)]
        return {number: at for number, at in zip(numbers, told, strict=True) if number is not None}

    def steps(self, count: int) -> list[tuple[float, ...]]:
        return [self.step() for _ in range(count)]

    def request(self, **fields: float) -> None:
        self.probe.publish(GOAL, JointState(name=list(fields), position=list(fields.values())))

    def statuses(self) -> list[dict[str, Any]]:
        return [json.loads(message.data) for message in self.probe.got(GOAL_STATUS)]

    def wait_for_status(self, state: str) -> dict[str, Any]:
        """Wait for the next status without going on; it has to be this one."""
        count = len(self._told)
        self.probe.wait_for(lambda: len(self.statuses()) > count, f"a status, expected {state}")
        found = self.statuses()[count]
        self._told.append(found)
        assert found["state"] == state
        return found

    def step_until_status(self, state: str) -> list[tuple[float, ...]]:
        """Go on until the next status has come, which may be some samples after the one at which it was told."""
        count, seen = len(self._told), []
        end = time.monotonic() + DEADLINE
        while len(self.statuses()) == count:
            assert time.monotonic() < end, f"no status {state}"
            seen.append(self.step())
        self._told.append(self.statuses()[count])
        assert self._told[-1]["state"] == state, self._told
        return seen

    @property
    def _told(self) -> list[dict[str, Any]]:
        return self.__dict__.setdefault("told", [])


def start(bench: Bench, takes_goals: bool = True, **settings: float) -> Driver:
    controller = "unified" if takes_goals else "multi_cartesian"
    bench.start("trajectory_generator", **MOTION, controller=controller, **settings)
    return Driver(bench.probe())


def test_a_goal_is_planned_beside_the_cycle_and_followed(bench: Bench) -> None:
    driver = start(bench)
    assert driver.steps(60)[-1] == HOME_REFERENCE
    driver.request(x=0.0, y=0.03, assembly_mode=-1.0, duration=math.nan)
    assert driver.wait_for_status("planning")["goal"] == [0.0, 0.03]
    requested = driver.sample
    driver.step_until_status("moving")
    moving = driver.statuses()[-1]
    first, last = moving["first_sample"], moving["last_sample"]
    driver.request(x=0.0, y=0.14)
    assert "moving for another" in driver.wait_for_status("refused")["reason"]
    assert driver.sample < last
    told = len(driver.statuses())
    driver.steps(last - 1 - driver.sample)
    assert len(driver.statuses()) == told
    driver.step()
    assert driver.wait_for_status("arrived")["goal"] == [0.0, 0.03]
    driver.steps(2)
    references = driver.references()
    # while it was planned the reference went on at rest, and what was told before the motion's first sample stays
    assert requested + 1 < first
    assert {references[number] for number in range(requested, first)} == {HOME_REFERENCE}
    places = [references[number][1] for number in range(first, last + 3)]
    assert places == sorted(places, reverse=True)
    assert references[last - 1] != GOAL_REFERENCE
    assert [references[number] for number in range(last, last + 3)] == [pytest.approx(GOAL_REFERENCE)] * 3
    # no step anywhere: from one sample to the next no further than the speed takes it
    assert max(abs(after - here) for here, after in pairwise(places)) < 2.0 / RATE_HZ


@pytest.mark.extra
def test_a_request_that_nobody_hears_is_made_again(bench: Bench) -> None:
    """As by a writer that the server has not discovered yet, here since it is not there."""
    with GoalClient(bench.domain) as client:
        client.request({"x": 0.0, "y": 0.5})
        assert client.next_status(0.0) is None
        start(bench).steps(60)
        status = client.next_status(DEADLINE)
    assert status is not None
    assert (status["state"], status["goal"]) == ("planning", [0.0, 0.5])


# ten seconds of a process that gives way to others: beside other tests it could wait for minutes
@pytest.mark.clock
@pytest.mark.extra
def test_the_status_says_by_which_time_law_loads_are_borne(bench: Bench) -> None:
    driver = start(bench, **{"loads.push": 1.0})
    driver.steps(60)
    driver.request(x=0.0, y=0.0, assembly_mode=-1.0)
    driver.wait_for_status("planning")
    driver.step_until_status("moving")
    moving = driver.statuses()[-1]
    assert (moving["time_law"], moving["payload_kg"]) == ("optimal", 0.0)
    assert "blend_radius" not in moving
    driver.step_until_status("arrived")
    ends, rule = [tuple(point) for point in moving["waypoints"]], ZoneRule()
    made = [
        plan_motion(load_robot("dextar"), (1, -1), ends, moving["durations_s"], RATE_HZ, rule, law, 0.0).path
        for law in ("optimal", "quintic")
    ]
    references = driver.references()
    first, last = moving["first_sample"], moving["last_sample"]
    shown = [references[number] for number in range(first, last)]
    optimal, quintic = ([path.at((n - first) / RATE_HZ)[:4] for n in range(first, last)] for path in made)
    assert shown == [pytest.approx(one, abs=1e-12) for one in optimal]
    assert max(math.dist(one[:2], other[:2]) for one, other in zip(shown, quintic, strict=True)) > 1e-3


def test_what_cannot_be_is_refused_and_moves_nothing(bench: Bench) -> None:
    driver = start(bench)
    driver.steps(60)
    for fields, reason in (
        ({"x": 0.3}, "expected x and y"),
        ({"x": math.nan, "y": 0.1}, "finite"),
        ({"x": 0.0, "y": 0.03, "mode1": -1.0}, "Type 1"),
        ({"x": 0.0, "y": 0.03, "blend_radius": 0.01}, "expected with via points"),
        ({"x": 0.0, "y": 0.03, "via1_x": 0.0}, "via point 1"),
    ):
        driver.request(**fields)
        assert reason in driver.wait_for_status("refused")["reason"]
    driver.request(x=0.3, y=0.1)
    driver.wait_for_status("planning")
    assert set(driver.step_until_status("refused")) == {HOME_REFERENCE}
    assert "out of reach" in driver.statuses()[-1]["reason"]
    assert driver.step() == HOME_REFERENCE


def test_without_the_parameter_no_goal_is_taken(bench: Bench) -> None:
    """A blended controller takes its path from its own parameters and would not follow."""
    driver = start(bench, takes_goals=False)
    driver.steps(60)
    driver.request(x=0.0, y=0.03)
    assert "they need controller unified" in driver.wait_for_status("refused")["reason"]
    assert driver.step() == HOME_REFERENCE


def planners_of(node: ForkedNode) -> list[int]:
    """Return the ids of the processes that a node's threads have started."""
    lists = Path(f"/proc/{node.pid}/task").glob("*/children")
    return [int(word) for one in lists for word in one.read_text().split()]


@pytest.mark.extra
def test_by_the_clock_the_planner_is_there_before_the_run_begins(bench: Bench) -> None:
    """To start a process takes longer than a cycle, and while it loads its modules it takes a processor."""
    node = bench.start(
        "trajectory_generator", **MOTION, controller="unified", mode="realtime", **{"safety.stop_cycles": 3}
    )
    driver = Driver(bench.probe())
    (planner,) = planners_of(node)
    assert os.getpriority(os.PRIO_PROCESS, planner) > os.getpriority(os.PRIO_PROCESS, node.pid)
    driver.steps(60)
    driver.request(x=0.0, y=0.12)
    driver.wait_for_status("planning")
    driver.step_until_status("moving")
    assert planners_of(node) == [planner]


def test_a_pose_is_a_request(bench: Bench) -> None:
    """As RViz publishes it, in any frame that is fixed to the base; each step is told in standard messages, too."""
    driver = start(bench)
    probe = driver.probe
    probe.listen(GOAL_PATH, GOAL_TARGET, VALUES[GOAL_STATUS])
    probe.advertise(GOAL_POSE)
    probe.wait_for(lambda: probe.listeners(GOAL_POSE) > 0, "the node to hear poses")
    driver.steps(60)
    base_x = load_robot("dextar").leg1.base_x
    for frame, place, word in (
        ("odom", (0.0, 0.03, 0.0), "frame 'odom': expected one that is fixed to the base: base_link, "),
        ("platform", (0.0, 0.03, 0.0), "tf2_ros, which finds others, is not installed"),
        ("base_link", (0.0, 0.03, 0.2), "expected a place in the robot's plane"),
        ("base_link", (math.nan, 0.03, 0.0), "expected finite coordinates"),
        ("camera_optical", (0.0, 0.0, 0.0), "expected a place in the robot's plane"),
    ):
        probe.publish(GOAL_POSE, pose(frame, *place))
        assert word in driver.wait_for_status("refused")["reason"]
    probe.publish(GOAL_POSE, pose("left_motor", -base_x, 0.03, 0.0))
    assert driver.wait_for_status("planning")["goal"] == pytest.approx([0.0, 0.03])
    driver.step_until_status("moving")
    moving = driver.statuses()[-1]
    driver.step_until_status("arrived")
    probe.wait_for(lambda: len(probe.got(VALUES[GOAL_STATUS])) == len(driver.statuses()), "the twins of all statuses")
    (path,), (target,) = probe.got(GOAL_PATH), probe.got(GOAL_TARGET)
    rests = [stamp_of(path.poses[0]), stamp_of(path.poses[-1])]
    assert rests == [sample_stamp_ns(moving[key], RATE_HZ) for key in ("first_sample", "last_sample")]
    assert stamp_of(target) == rests[1]
    assert (target.header.frame_id, target.pose.position.y) == ("base_link", pytest.approx(0.03))
    assert [path.poses[index].pose.position.y for index in (0, -1)] == pytest.approx([0.14, 0.03])
    twins = probe.got(VALUES[GOAL_STATUS])
    assert [twin.message.partition(":")[0] for twin in twins] == [status["state"] for status in driver.statuses()]
    assert {twin.level for twin in twins[:5]} == {DiagnosticStatus.WARN}
    assert {twin.level for twin in twins[5:]} == {DiagnosticStatus.OK}
    values = {value.key: value.value for value in twins[-2].values}
    assert values["first_sample"] == str(moving["first_sample"])
    assert float(values["waypoints.1.1"]) == pytest.approx(0.03)


def trajectory(joints: tuple[str, ...], *points: tuple[float, tuple[float, ...]], frame: str = "") -> JointTrajectory:
    message = JointTrajectory(joint_names=list(joints))
    message.header.frame_id = frame
    for t, positions in points:
        since = Duration(sec=int(t), nanosec=round(t % 1.0 * 1e9))
        message.points.append(JointTrajectoryPoint(positions=positions, time_from_start=since))
    return message


def test_a_trajectory_is_followed_at_its_times(bench: Bench) -> None:
    """Of the platform, then of the motors; what is none is refused, and moves nothing."""
    driver = start(bench)
    probe = driver.probe
    probe.advertise(GOAL_TRAJECTORY)
    probe.wait_for(lambda: probe.listeners(GOAL_TRAJECTORY) > 0, "the node to hear trajectories")
    driver.steps(60)
    late = trajectory(("x", "y"), (0.5, (0.0, 0.13)))
    late.header.stamp.sec = 1
    with_effort = trajectory(("x", "y"), (0.5, (0.0, 0.13)))
    with_effort.points[0].effort = [1.0, 1.0]
    for message, word in (
        (trajectory(("x", "y"), (0.5, (0.0, 0.13)), frame="map"), "header.frame_id 'map': expected 'base_link'"),
        (late, "header.stamp: expected 0"),
        (with_effort, "points[0].effort: expected none"),
        (trajectory(("x", "y")), "0 points: expected 1 to 100000"),
        (trajectory(("q1", "q2"), (0.5, (0.0, 0.13))), "joint_names [q1, q2]: expected x and y"),
    ):
        probe.publish(GOAL_TRAJECTORY, message)
        driver.wait_for_status("planning")
        assert set(driver.step_until_status("refused")) == {HOME_REFERENCE}
        assert word in driver.statuses()[-1]["reason"]
    probe.publish(GOAL_TRAJECTORY, trajectory(("x", "y"), (5e-3, (0.0, 0.1)), frame="request/abc"))
    assert driver.wait_for_status("planning")["id"] == "abc"
    assert set(driver.step_until_status("refused")) == {HOME_REFERENCE}
    assert "the trajectory is not feasible" in driver.statuses()[-1]["reason"]
    assert "after points[0]" in driver.statuses()[-1]["reason"]

    probe.publish(GOAL_TRAJECTORY, trajectory(("y", "x"), (0.5, (0.13, 0.01)), (1.0, (0.14, 0.02))))
    # what is in a message is read where it is planned
    assert driver.wait_for_status("planning")["goal"] == [None, None]
    driver.step_until_status("moving")
    moving = driver.statuses()[-1]
    assert moving["goal"] == [0.02, 0.14]
    first, last = moving["first_sample"], moving["last_sample"]
    assert last - first == RATE_HZ
    asked = read_points(("y", "x"), [TimedPoint(0.5, (0.13, 0.01)), TimedPoint(1.0, (0.14, 0.02))])
    assert moving["trajectory"] == digest_of(asked)
    driver.step_until_status("arrived")
    references = driver.references()
    assert references[first] == pytest.approx(HOME_REFERENCE)
    assert references[first + RATE_HZ // 2][:2] == pytest.approx((0.01, 0.13))
    assert references[last] == pytest.approx((0.02, 0.14, 0.0, 0.0))

    angles = inverse_geometry(load_robot("dextar"), (1, -1), 0.0, 0.14)
    probe.publish(GOAL_TRAJECTORY, trajectory(("q11", "q21"), (0.5, (angles.q11, angles.q21))))
    driver.wait_for_status("planning")
    driver.step_until_status("moving")
    assert driver.statuses()[-1]["goal"] == pytest.approx([0.0, 0.14])
    driver.step_until_status("arrived")
    assert driver.step() == pytest.approx(HOME_REFERENCE)


@pytest.mark.clock
def test_ten_thousand_points_cross_twice_by_the_clock_and_delay_no_sample(bench: Bench) -> None:
    """They are read where they are planned: in the node that would take a third of a second."""
    bench.start("trajectory_generator", **MOTION, controller="unified", mode="realtime", **{"safety.stop_cycles": 3})
    driver = Driver(bench.probe())
    probe = driver.probe
    probe.advertise(GOAL_TRAJECTORY)
    probe.wait_for(lambda: probe.listeners(GOAL_TRAJECTORY) > 0, "the node to hear trajectories")
    driver.steps(60)
    ends = [(0.0, 0.14), (0.0, 0.02), (0.0, 0.14)]
    way = PlannedPath.through(ends, [0.6, 0.6])
    rows = [(1e-3 * n, (0.0, way.at(1e-3 * min(n, 1200)).y)) for n in range(10_001)]
    probe.publish(GOAL_TRAJECTORY, trajectory(("x", "y"), *rows))
    driver.wait_for_status("planning")
    longest, count = 0.0, len(driver.statuses())
    while len(driver.statuses()) == count:
        begun = time.monotonic()
        driver.step()
        longest = max(longest, time.monotonic() - begun)
    moving = driver.statuses()[-1]
    assert moving["state"] == "moving"
    assert longest < 0.15
    while driver.sample < moving["first_sample"] + 700:
        driver.step()
    references = driver.references()
    assert references[moving["first_sample"] + 300][:2] == pytest.approx((0.0, 0.02), abs=1e-6)
    assert references[moving["first_sample"] + 600][:2] == pytest.approx((0.0, 0.14), abs=1e-6)


def test_a_motion_is_cancelled_within_the_limits(bench: Bench) -> None:
    driver = start(bench)
    cancel = "/trajectory_generator/cancel"

    def ask() -> Trigger.Response:
        return driver.probe.call(Trigger, cancel, Trigger.Request())

    driver.steps(60)
    assert (ask().success, ask().message) == (False, "no motion is under way")
    driver.request(x=0.0, y=0.03, duration=2.0)
    driver.wait_for_status("planning")
    driver.step_until_status("moving")
    moving = driver.statuses()[-1]
    driver.steps(200)
    assert ask().success
    asked = driver.sample
    driver.step_until_status("stopping")
    stopping = driver.statuses()[-1]
    driver.step_until_status("cancelled")
    rest = driver.steps(3)
    assert asked < stopping["first_sample"] < stopping["last_sample"] < moving["last_sample"]
    assert rest[0] == rest[-1]
    assert rest[0][2:] == (0.0, 0.0)
    assert 0.03 < rest[0][1] < 0.14
    references = driver.references()
    places = [references[number] for number in range(moving["first_sample"], driver.sample)]
    # neither place nor speed leaps
    assert max(abs(after[1] - here[1]) for here, after in pairwise(places)) < 1.0 / RATE_HZ
    assert max(abs(after[3] - here[3]) for here, after in pairwise(places)) < 20.0 / RATE_HZ
    # and the robot takes the next request from there
    driver.request(x=0.0, y=0.14)
    driver.wait_for_status("planning")
    driver.step_until_status("moving")


def test_a_motion_pauses_and_goes_on(bench: Bench) -> None:
    driver = start(bench)

    def ask(name: str) -> tuple[bool, str]:
        answer = driver.probe.call(Trigger, f"/trajectory_generator/{name}", Trigger.Request())
        return answer.success, answer.message

    driver.steps(60)
    assert ask("pause") == (False, "no motion is under way")
    assert ask("resume") == (False, "no motion has paused")
    driver.request(x=0.0, y=0.03, duration=2.0)
    driver.wait_for_status("planning")
    driver.step_until_status("moving")
    moving = driver.statuses()[-1]
    driver.steps(100)
    assert ask("pause")[0]
    assert ask("pause")[0]
    driver.step_until_status("pausing")
    assert ask("resume") == (False, "the motion is still slowing down")
    pausing = driver.statuses()[-1]
    driver.step_until_status("paused")
    rest = driver.steps(3)
    assert rest[0] == rest[-1]
    assert 0.03 < rest[0][1] < 0.14
    driver.request(x=0.0, y=0.14)
    assert "expected resume or cancel first" in driver.wait_for_status("refused")["reason"]
    assert ask("resume") == (True, "the motion goes on")
    resumed = driver.wait_for_status("resumed")
    driver.step_until_status("arrived")
    driver.step()
    references = driver.references()
    first, last = moving["first_sample"], resumed["last_sample"]
    assert references[last] == pytest.approx(GOAL_REFERENCE)
    places = [references[number] for number in range(first, last + 1)]
    assert max(abs(after[1] - here[1]) for here, after in pairwise(places)) < 1.0 / RATE_HZ
    assert max(abs(after[3] - here[3]) for here, after in pairwise(places)) < 20.0 / RATE_HZ
    # the same way at the same pace once it is as quick again
    shift = resumed["first_sample"] - first + round((0.5 * resumed["rising_s"] - resumed["path_time_s"]) * RATE_HZ)
    assert shift == last - moving["last_sample"]
    assert pausing["last_sample"] <= resumed["first_sample"]

    driver.request(x=0.0, y=0.14, duration=2.0)
    driver.wait_for_status("planning")
    driver.step_until_status("moving")
    driver.steps(600)
    assert ask("pause")[0]
    driver.step_until_status("pausing")
    driver.step_until_status("paused")
    assert ask("cancel") == (True, "the motion that has paused is dropped")
    driver.wait_for_status("cancelled")
    assert ask("resume") == (False, "no motion has paused")
    driver.request(x=0.0, y=0.14)
    driver.wait_for_status("planning")


def pose(frame: str, x: float, y: float, z: float) -> PoseStamped:
    message = PoseStamped()
    message.header.frame_id = frame
    message.pose.position.x, message.pose.position.y, message.pose.position.z = x, y, z
    return message
