# SPDX-License-Identifier: Apache-2.0
"""Accepts requests for motions as goals, poses and trajectories, and reports their status on `goal/status`."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from functools import partial
from typing import Any

from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from fivebar_control.laws.registry import goal_controllers
from fivebar_control.planning.motion_queue import (
    Goal,
    GoalRefused,
    MotionQueue,
    ScheduledPath,
    StandingStill,
    read_goal,
)
from fivebar_control.planning.orders import Planned, StopRequest, TrajectoryMessage
from fivebar_control.planning.planning_process import PlanningProcess
from fivebar_control.planning.trajectory_messages import request_id_of
from fivebar_control.ros.placed_frames import PlacedFrames
from fivebar_control.ros.shown_motions import ShownMotions
from fivebar_control.ros.trajectory_requests import frame_of, read_trajectory
from fivebar_control.ros.transform_lookup import TransformLookup
from fivebar_control.scenario.goal_conditions import conditions_of
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_control.trajectory.path import Path
from fivebar_control.trajectory.stopped import ResumedSegment
from fivebar_control.trajectory.time_laws import QUINTIC
from fivebar_description.interface import GOAL, GOAL_POSE, GOAL_STATUS, GOAL_TRAJECTORY
from fivebar_description.outside_text import one_line
from fivebar_description.ros.messages import qos_profile
from fivebar_description.ros.node import GraphNode
from fivebar_description.static_frames import Vector

LONGEST_ID = 64
"""Largest number of characters of a request's id, which `goal/status` names."""

LOCKSTEP_WAIT = 0.1
"""Time (s) for which each sample waits for a plan in lockstep, so that few of them pass while the robot rests: less
than the time after which the plant publishes a sample again."""

STOP_NOTICE = 0.3
"""Time (s) from a request to stop until the motion may begin to slow down: how long a stop takes to be planned."""

LOOKUP_TIME = 2.0
"""Time (s) within which tf2 has to know the frame of a request: longer than static transforms take to be heard."""

STOPS = "the motion stops as soon as the limits allow, which goal/status tells"

NOTICE = 2
"""Samples from the current one to the first that may belong to a new motion: the next is already published."""


class GoalServer:
    """Passes requests to a planning process and the planned motions to the queue.

    The node calls `update` at every sample, which blocks for at most `LOCKSTEP_WAIT` in lockstep, where time waits too.
    """

    def __init__(
        self,
        node: GraphNode,
        scenario: ControlScenario,
        by_the_clock: bool,
        queue: MotionQueue,
        stamp: Callable[[int], int],
        planner: tuple[str, str] = ("", ""),
    ) -> None:
        """Join the topics on behalf of a node, and judge requests as a scenario says.

        Args:
            node: the node.
            scenario: by which requests are judged.
            by_the_clock: whether no sample waits for a plan.
            queue: of the motions.
            stamp: returns the stamp (ns) of a sample.
            planner: as in `Conditions`, with the run's file.
        """
        self._open = scenario.scheme().takes_goals
        self._wait = 0.0 if by_the_clock else LOCKSTEP_WAIT
        self._rate_hz = scenario.rate_hz
        self._queue = queue
        name, file = planner
        conditions = conditions_of(scenario, by_the_clock and self._open)._replace(
            planner=name,
            file=file if name else "",
            # in lockstep time waits for plans
            odds_time=scenario.risk.odds_time if name and by_the_clock else math.inf,
        )
        self._planning = PlanningProcess(conditions, gives_way=by_the_clock)
        if self._open and by_the_clock:
            # by the clock no cycle can wait until a process has been started, or while it loads
            self._planning.start()
        self._stamp = stamp
        self._sample = -1
        self._held = False
        self._goal: Goal | None = None
        self._id = ""
        self._arrival: int | None = None
        self._stopping: ScheduledPath | None = None
        """The motion that is to stop, while that is being planned."""
        self._notice = STOP_NOTICE
        self._cancelled = self._pauses = self._paused = False
        self._rest: ResumedSegment | None = None
        """The rest of the motion that pauses, or is to."""
        self._rest_references: tuple[float, ...] = ()
        """References of the rest, where the law has to know them."""
        self._payload = self._planned_payload = 0.0
        self._status = node.advertise(GOAL_STATUS)
        self._shown = ShownMotions(node)
        self._frames = PlacedFrames(node, scenario.robot)
        self._lookup = TransformLookup(node)
        self._looked_up: PoseStamped | None = None
        """A request in a frame that is being looked up."""
        self._look_until = 0.0
        self._angles = (math.nan, math.nan)
        """The trajectory that is followed, as its status tells it."""
        # not required for readiness: a run needs no requests
        node.create_subscription(JointState, GOAL.name, self._on_goal, qos_profile(GOAL.qos))
        node.listen(GOAL_POSE, self._on_pose, awaited=False)
        # not read here: many points take seconds
        node.listen(GOAL_TRAJECTORY, self._on_trajectory, awaited=False, raw=True)
        for name, ask in (("cancel", self._cancel), ("pause", self._pause), ("resume", self._resume)):
            node.create_service(Trigger, f"~/{name}", partial(_answered, ask))
        node.listen_to_payload(self._carry)

    def restart(self, queue: MotionQueue) -> None:
        """Discard all requests for a new run."""
        self._planning.forget()
        self._queue = queue
        self._sample, self._goal, self._arrival = -1, None, None
        self._looked_up = None
        self._lookup.end()
        self._settle()

    def prepared(self) -> bool:
        """Return whether a request would be planned at once, as far as that matters."""
        return not self._planning.loading()

    def close(self) -> None:
        """Stop the planning process."""
        self._planning.close()

    def update(self, sample: int, held: bool, angles: tuple[float, float]) -> None:
        """Advance to a sample of the reference.

        Args:
            sample: its number.
            held: whether a fault holds the robot.
            angles: of the motors as measured (rad).
        """
        self._sample, self._held, self._angles = sample, held, angles
        if self._looked_up is not None:
            self._look_up(self._looked_up)
        if self._goal is None:
            return
        if held:
            self._end("stopped", "a fault holds the robot")
        elif self._arrival is None:
            self._take_answer(self._goal)
        elif sample >= self._arrival:
            self._rest_here()
        elif self._stopping is not None:
            self._take_stop(self._stopping)

    def _rest_here(self) -> None:
        """Report that the motion has come to rest: at its end, or where it was to stop."""
        if self._rest is None:
            self._end("cancelled" if self._cancelled else "arrived")
        elif not self._paused:
            self._paused = True
            self._report("paused", self._target, self._id)

    def _cancel(self) -> tuple[bool, str]:
        """Stop the motion under way as soon as that is possible within the limits, or drop the one being planned."""
        refused = self._unable("cancelled")
        if refused:
            return False, refused
        if self._goal is not None and self._arrival is None:
            self._planning.forget()
            self._end("cancelled", "before it began")
            return True, "the motion that was being planned is dropped"
        if self._paused:
            self._end("cancelled")
            return True, "the motion that has paused is dropped"
        if self._rest is not None or self._stopping is not None:
            # it slows down already, or is about to
            self._pauses, self._cancelled, self._rest = False, self._rest is not None, None
            return True, STOPS
        return self._slow_down(pauses=False)

    def _pause(self) -> tuple[bool, str]:
        """Stop the motion under way as soon as that is possible within the limits, and keep what is left of it."""
        refused = self._unable("paused")
        if refused:
            return False, refused
        if self._rest is not None:
            return True, "the motion has paused" if self._paused else STOPS
        if self._cancelled or (self._stopping is not None and not self._pauses):
            return False, "the motion is being cancelled"
        return self._slow_down(pauses=True)

    def _resume(self) -> tuple[bool, str]:
        """Go on with what is left of the motion that has paused."""
        refused = self._unable("resumed")
        if refused:
            return False, refused
        if not self._paused or self._rest is None:
            slows = self._rest is not None or (self._stopping is not None and self._pauses)
            return False, "the motion is still slowing down" if slows else "no motion has paused"
        left, first = self._rest, self._sample + NOTICE
        self._queue.reserve()
        self._queue.begin(first, left.as_path(), self._rest_references)
        self._arrival = self._queue.resting_from()
        self._settle()
        target = (self._target[0], self._target[1])
        self._shown.show_goal(left.as_path(), self._rate_hz, self._stamp(first), target)
        timing = {"first_sample": first, "last_sample": self._arrival}
        self._report("resumed", self._target, self._id, **timing, path_time_s=left.begin, rising_s=left.rising)
        return True, "the motion goes on"

    def _unable(self, done: str) -> str:
        """Return why no motion can be `done`, "" where it can."""
        if not self._open:
            return f"motions are not {done}: that needs controller {' or '.join(goal_controllers())}"
        return "a fault holds the robot where it stands" if self._held else ""

    def _slow_down(self, pauses: bool) -> tuple[bool, str]:
        motion = self._queue.under_way(self._sample + NOTICE)
        if self._sample < 0 or motion is None or isinstance(motion.path, StandingStill):
            return False, "no motion is under way"
        if self._stopping is None and not self._cancelled:
            self._notice, self._pauses = STOP_NOTICE, pauses
            self._ask_to_stop(motion)
        return True, STOPS

    def _settle(self) -> None:
        """Forget that the motion was to stop."""
        self._stopping = self._rest = None
        self._cancelled = self._pauses = self._paused = False

    @property
    def _target(self) -> list[float]:
        """Where the motion goes (m)."""
        assert self._goal is not None
        return [self._goal.x, self._goal.y]

    def _ask_to_stop(self, motion: ScheduledPath) -> None:
        assert isinstance(motion.path, Path)
        if self._goal is None:
            # the plan of the run
            rest = motion.path.at(motion.path.duration)
            self._goal, self._id, self._arrival = Goal(rest.x, rest.y), "", self._queue.resting_from()
        self._stopping = motion
        earliest = self._sample + round(self._notice * self._rate_hz) - motion.first
        segments, mode = motion.path.segments, self._queue.working_mode
        order = StopRequest(segments, mode, earliest / self._rate_hz, self._planned_payload, self._pauses)
        self._planning.ask(order)

    def _take_stop(self, motion: ScheduledPath) -> None:
        """Take the plan of a stop; one that comes too late is asked for again, with more notice."""
        planned = self._planning.answer(self._wait)
        if planned is None:
            return
        self._stopping = None
        stop = planned.stop
        if stop is not None and motion.first + stop.stop.begin * self._rate_hz < self._sample + NOTICE:
            self._notice *= 2.0
            self._ask_to_stop(motion)
            return
        if stop is None:
            reason = one_line(planned.refused)
            self._pauses = False
            self._report("moving", self._target, self._id, last_sample=self._arrival, reason=reason)
            return
        self._queue.stop(stop.stop.as_path(), self._sample + NOTICE, planned.references)
        self._rest_references = planned.resumed
        self._arrival = self._queue.resting_from()
        self._rest, self._cancelled = (stop.resumed, False) if self._pauses else (None, True)
        first = motion.first + round(stop.stop.begin * self._rate_hz)
        state = "pausing" if self._pauses else "stopping"
        timing = {"first_sample": first, "last_sample": self._arrival, "slowing_s": stop.stop.slowing}
        self._report(state, self._target, self._id, **timing)

    def _carry(self, payload: float) -> None:
        self._payload = payload

    def _on_goal(self, message: JointState) -> None:
        request_id = one_line(message.header.frame_id, LONGEST_ID)
        if request_id and request_id == self._id:
            # published again because no status has arrived yet: one is on its way
            return
        values = list(message.position)
        self._take(lambda: read_goal(list(message.name), values), values[:2], request_id)

    def _on_pose(self, message: PoseStamped) -> None:
        """Take a request by the place alone; the platform has no direction, so that of the pose says nothing."""
        if self._frames.knows(message.header.frame_id):
            self._take_place(message, message.header.frame_id, _place_of(message))
        elif self._lookup.begin():
            self._looked_up = message
            self._look_until = time.monotonic() + LOOKUP_TIME
        else:
            self._refuse_frame(message, "tf2_ros, which finds others, is not installed")

    def _take_place(self, message: PoseStamped, frame: str, place: Vector) -> None:
        def read() -> Goal:
            return read_goal(("x", "y"), self._frames.in_plane(frame, place))

        self._take(read, list(_place_of(message)[:2]), "")

    def _look_up(self, message: PoseStamped) -> None:
        """Take a request in a frame of others once tf2 knows it, or refuse it after some time."""
        frame = message.header.frame_id.removeprefix("/")
        place = self._lookup.found(self._frames.base, frame, _place_of(message))
        if place is None and time.monotonic() < self._look_until:
            return
        self._looked_up = None
        self._lookup.end()
        if place is None:
            self._refuse_frame(message, f"tf2 knows no transform to {self._frames.base}")
        else:
            self._take_place(message, self._frames.base, place)

    def _refuse_frame(self, message: PoseStamped, reason: str) -> None:
        def read() -> Goal:
            raise self._frames.unknown(message.header.frame_id, reason)

        self._take(read, list(_place_of(message)[:2]), "")

    def _on_trajectory(self, data: bytes) -> None:
        """Take a request for a motion through points at given times, in a serialised JointTrajectory."""
        try:
            request_id = one_line(request_id_of(frame_of(data)), LONGEST_ID)
        except GoalRefused as refusal:
            self._report("refused", [], "", reason=one_line(str(refusal)))
            return
        if request_id and request_id == self._id:
            return
        self._take(lambda: data, [], request_id)

    def _take(self, read: Callable[[], Goal | bytes], asked: list[float], request_id: str) -> None:
        """Hand a request to the planner, or say why it is refused."""
        try:
            wanted = read()
            if not self._open:
                able = " or ".join(goal_controllers())
                raise GoalRefused(f"requests are not taken: they need controller {able}")
            if self._sample < 0:
                raise GoalRefused("the run has not begun")
            if self._held:
                raise GoalRefused("a fault holds the robot where it stands: reset it first")
            if self._rest is not None:
                raise GoalRefused("the motion has paused: expected resume or cancel first")
            goal = self._ask_for(wanted)
            self._planned_payload = self._payload
        except GoalRefused as refusal:
            self._report("refused", asked, request_id, reason=one_line(str(refusal)))
            return
        self._goal, self._id = goal, request_id
        self._report("planning", [goal.x, goal.y], request_id)

    def _ask_for(self, wanted: Goal | bytes) -> Goal:
        """Ask the planner for a motion; return where it ends, which is not known of points in a message.

        Raises:
            GoalRefused: none can begin, or not this one.
        """
        begin = self._sample + NOTICE
        if isinstance(wanted, Goal):
            self._planning.ask(self._queue.request(begin, wanted)._replace(payload=self._payload))
            return wanted
        place, mode = self._queue.resting_place(begin), self._queue.working_mode
        self._queue.reserve()
        self._planning.ask(
            TrajectoryMessage(read_trajectory, wanted, self._frames.base, place, mode, self._angles, self._payload)
        )
        return Goal(math.nan, math.nan)

    def _take_answer(self, goal: Goal) -> None:
        planned = self._planning.answer(self._wait)
        if planned is None:
            return
        if planned.refused:
            self._end("refused", planned.refused)
            return
        first = self._sample + NOTICE
        if planned.followed is not None:
            self._goal = goal = Goal(*planned.course.waypoints[-1])
        self._queue.begin(first, planned.path(), planned.references)
        self._arrival = self._queue.resting_from()
        self._shown.show_goal(planned.path(), self._rate_hz, self._stamp(first), (goal.x, goal.y))
        self._report(
            "moving",
            [goal.x, goal.y],
            self._id,
            first_sample=first,
            last_sample=self._arrival,
            waypoints=[list(point) for point in planned.course.waypoints],
            durations_s=list(planned.durations),
            **({} if planned.odds is None else {"odds": dict(planned.odds)}),
            **self._beyond_waypoints(planned),
        )

    def _beyond_waypoints(self, planned: Planned) -> dict[str, Any]:
        """Return what else decides where a motion is at which time, unless it is the polynomial between rests."""
        course = planned.course
        if planned.followed is not None:
            return dict(planned.followed)
        if not course.rounded and course.time_law == QUINTIC:
            return {}
        return {
            **({"blend_radius": list(course.blend_radius)} if course.rounded else {}),
            "time_law": course.time_law,
            "payload_kg": self._planned_payload,
        }

    def _end(self, state: str, reason: str = "") -> None:
        target, self._goal, self._arrival = self._target, None, None
        if self._stopping is not None:
            self._planning.forget()
        self._settle()
        self._queue.cancel()
        self._report(state, target, self._id, **({"reason": reason} if reason else {}))

    def _report(self, state: str, goal: list[float], request_id: str, **more: Any) -> None:
        content = {"state": state, "goal": [value if abs(value) < 1e6 else None for value in goal], **more}
        if request_id:
            content["id"] = request_id
        self._status.publish(String(data=json.dumps(content)))


def _place_of(message: PoseStamped) -> Vector:
    position = message.pose.position
    return position.x, position.y, position.z


def _answered(ask: Callable[[], tuple[bool, str]], request: Trigger.Request, response: Trigger.Response) -> Any:
    """Answer a trigger with what was done, or why nothing was."""
    response.success, response.message = ask()
    return response
