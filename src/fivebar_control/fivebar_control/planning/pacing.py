# SPDX-License-Identifier: Apache-2.0
"""How long a motion from rest to rest should take: not too quick for the motors, nor too slow on the locus."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from fivebar_control.estimation.settings import Sensing
from fivebar_control.laws.registry import CONTROLLERS, TunedController, default_tuning
from fivebar_control.model.state import WorkingMode
from fivebar_control.planning.advice import advice, concerns_tolerances, judge_of
from fivebar_control.planning.course import Course
from fivebar_control.planning.feasibility import displaced, screen, screen_run
from fivebar_control.planning.figures import Feasibility
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.planning.reference_scan import dwells_near_locus
from fivebar_control.trajectory.path import Path, Segment
from fivebar_control.trajectory.planner import Plan, PlanRefused, plan_motion
from fivebar_control.trajectory.rounded import RESTS, RoundedSegment
from fivebar_control.trajectory.time_laws import CRITERION
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.loads import Loads
from fivebar_description.parameters import FiveBar, has_external_force

LONGEST = 10.0
"""Duration (s) of the slowest segment that is tried."""

SHORTEST = 0.04
"""Duration (s) of the quickest segment that is tried."""

TOLERANCE = 0.01
"""Relative accuracy of the shortest duration."""

COMFORT = 2.0
"""A comfortable motion takes this much longer than the quickest: a quarter of the torque that accelerates."""

LOAD_STEP = 0.7
"""Factor between the durations that are tried first for the declared loads."""

LOAD_TOLERANCE = 0.04
"""Relative accuracy of the longest duration for the declared loads."""

SLOWEST_SHARE = 0.5
"""A comfortable motion takes at most this share of the slowest duration: long dwells near the locus let errors grow."""


LOAD_AIM = 0.25
"""Largest displacement by the declared loads, as a share of the tolerance, at crossings whose duration the planner
chooses, as far as the motors allow: the rest is for the errors of the estimate."""


class Task(NamedTuple):
    """The conditions that a motion is planned for.

    Attributes:
        robot, working_mode, rate_hz, follower, limits: robot, its working mode, the controllers' rate (Hz), which of
            them is to follow, and what the motion has to keep.
        sensing: what the estimator has, None without one.
    """

    robot: FiveBar
    working_mode: WorkingMode
    rate_hz: int
    follower: TunedController = default_tuning(CONTROLLERS["unified"])
    limits: MotionLimits = MotionLimits()
    sensing: Sensing | None = None

    def plan(self, course: Course, durations: Sequence[float]) -> Plan:
        """Return the plan of a course, with one duration (s) for each leg and ballistic zones.

        Raises:
            PlanRefused: the planner refuses it.
        """
        return plan_motion(
            self.robot,
            self.working_mode,
            course.waypoints,
            durations,
            self.rate_hz,
            ZoneRule(),
            course.time_law,
            self.follower.controller.min_authority,
            course.blend_radius or RESTS,
        )

    def judge(self, plan: Plan) -> Feasibility:
        """Return the verdict on a plan's reference."""
        return screen(self.robot, plan, self.rate_hz, self.follower, self.limits)

    def judge_run(self, plan: Plan) -> Feasibility:
        """Return the verdict on a plan's reference and predicted run, which takes longer."""
        return screen_run(self.robot, plan, self.rate_hz, self.limited(), self.limits, self.sensing)

    def advice(self, plan: Plan, verdict: Feasibility) -> str:
        """Return what would make a motion feasible that nothing but the robot's tolerances forbids; "" for nothing."""
        if self.sensing is None or not concerns_tolerances(verdict):
            return ""
        judge = judge_of(self.robot, plan, self.rate_hz, self.limited(), self.limits)
        return advice(verdict, plan.path, self.sensing, judge)

    def limited(self) -> TunedController:
        """Return the controller with the torque limit of the drives."""
        return self.follower.limited_to(self.limits.torque)


class Pace(NamedTuple):
    """The durations (s) that a segment may take: all from the fastest to the slowest, where the limits are kept.

    Attributes:
        fastest, slowest: s.
        calm: longest duration with which the declared loads displace the platform no more than aimed at, or as little
            as they can; infinite without loads.
    """

    fastest: float
    slowest: float
    calm: float = math.inf

    @property
    def comfortable(self) -> float:
        """A duration with room to both sides, as far as there is any."""
        room = max(self.fastest, SLOWEST_SHARE * self.slowest)
        unhurried = min(COMFORT * self.fastest, math.sqrt(self.fastest * self.slowest), room)
        return max(self.fastest, min(unhurried, self.calm))


class NoPace(NamedTuple):
    """A segment without a feasible duration, and the reason."""

    reason: str

    def __str__(self) -> str:
        """Return the reason."""
        return self.reason


def slowest_pace(task: Task, course: Course) -> Plan | NoPace:
    """Return a course without a rest in between, with its longest feasible duration, a whole number of samples.

    The dwell near the locus grows in proportion to the duration, which bounds it, and so does the displacement by the
    declared loads. All other figures only get better the slower the motion is: a limit that the slowest does not keep,
    none keeps.
    """
    try:
        slow = task.plan(course, course.shared(LONGEST))
    except PlanRefused as refusal:
        return NoPace(str(refusal))
    dwells = dwells_near_locus(task.robot, slow, task.rate_hz)
    share = max((dwell.end - dwell.start for dwell in dwells), default=0.0) / LONGEST
    slowest = min(LONGEST, task.limits.dwell / share) if share > 0.0 else LONGEST
    slowest = math.floor(slowest * task.rate_hz) / task.rate_hz
    if slowest <= SHORTEST:
        return NoPace(f"the segment stays near the Type 2 locus for {share:.0%} of any duration")
    try:
        slowed = retimed(task, slow, slowest / LONGEST)
    except PlanRefused as refusal:
        return NoPace(str(refusal))
    limits = task.limits
    borne = longest_bearing(task, slowed, limits.risk.load_share, limits.certain_loads)
    if not borne.enough:
        moved = displaced(task.robot, slowed, task.rate_hz, task.follower, limits, limits.certain_loads)
        return NoPace(f"in {slowest:.3g} s {moved}, and no shorter duration bears the loads")
    plan = retimed(task, slow, borne.duration / LONGEST)
    reasons = task.judge(plan).reasons
    if reasons:
        bound = "" if borne.duration == slowed.path.duration else " with the declared loads"
        return NoPace(f"even in {plan.path.duration:.3g} s, the longest possible duration{bound}, {'; '.join(reasons)}")
    return plan


class Borne(NamedTuple):
    """The longest duration (s) in which the loads are borne, or that of the least excess (m) where there is none."""

    duration: float
    excess: float

    @property
    def enough(self) -> bool:
        """Whether the loads are borne."""
        return self.excess <= 0.0


def longest_bearing(task: Task, plan: Plan, share: float, loads: Loads) -> Borne:
    """Return the longest duration of a segment, at most that of its plan, with which it bears loads.

    A whole number of samples where it is shorter than that of the plan.

    Args:
        task: for which it is planned.
        plan: one segment under a ballistic zone rule.
        share: of the error tolerance by which they may displace the platform.
        loads: to be borne.
    """
    limits = task.limits
    longest = plan.path.duration
    if not (loads.declared and plan.crossings):
        return Borne(longest, -math.inf)
    bound = share * limits.error_tolerance

    def excess(duration: float) -> float:
        try:
            quicker = retimed(task, plan, duration / longest)
        except PlanRefused:
            return math.inf
        return displaced(task.robot, quicker, task.rate_hz, task.follower, limits, loads).value - bound

    borne = longest_within(excess, longest)
    if borne.duration == longest:
        return borne
    return borne._replace(duration=max(1.0, math.floor(borne.duration * task.rate_hz + 1e-6)) / task.rate_hz)


def longest_within(excess: Callable[[float], float], longest: float) -> Borne:
    """Return the longest duration (s) up to `longest` whose excess is not positive, else that of the least found.

    The search goes from long to short over all durations. A quicker crossing is often moved less by a load, but not
    always: where the controller loses the platform in a slow one, a somewhat quicker one is moved farther, and only a
    much quicker one bears the load.
    """
    best = last = Borne(longest, excess(longest))
    while not last.enough and LOAD_STEP * last.duration >= SHORTEST:
        shorter = Borne(LOAD_STEP * last.duration, excess(LOAD_STEP * last.duration))
        if shorter.enough:
            return _refined(excess, shorter, last.duration)
        best, last = shorter if shorter.excess < best.excess else best, shorter
    return best


def _refined(excess: Callable[[float], float], low: Borne, high: float) -> Borne:
    """Return the longest duration between one that does and one that does not (s), by bisection."""
    while high > (1.0 + LOAD_TOLERANCE) * low.duration:
        middle = math.sqrt(low.duration * high)
        between = Borne(middle, excess(middle))
        if between.enough:
            low = between
        else:
            high = middle
    return low


def pace_of(task: Task, slowest: Plan) -> Pace:
    """Return the feasible durations of one segment between rests, given the slowest; whole numbers of samples.

    The torque that accelerates falls with the square of the duration. Friction does not, so the quickest is found by
    bisection.
    """
    longest = slowest.path.duration
    low, high = max(1, math.floor(SHORTEST * task.rate_hz)), round(longest * task.rate_hz)
    while high - low > max(1.0, TOLERANCE * high):
        middle = min(max(round(math.sqrt(low * high)), low + 1), high - 1)
        if feasible_in(task, slowest, middle / task.rate_hz):
            high = middle
        else:
            low = middle
    fastest = high / task.rate_hz
    if not task.limits.loads.declared:
        return Pace(fastest, longest)
    return Pace(fastest, longest, longest_bearing(task, slowest, LOAD_AIM, task.limits.loads).duration)


def feasible_in(task: Task, plan: Plan, duration: float) -> bool:
    """Return whether a segment's reference is feasible in another duration (s)."""
    try:
        return task.judge(retimed(task, plan, duration / plan.path.duration)).feasible
    except PlanRefused:
        return False


def retimed(task: Task, plan: Plan, factor: float) -> Plan:
    """Return a plan of one segment under a ballistic zone rule, made `factor` times as slow.

    A time law does not depend on the duration, but where forces act all the time: there it is found anew.

    Raises:
        PlanRefused: there is none for that duration.
    """
    (segment,) = plan.path.segments
    assert isinstance(segment, Segment | RoundedSegment)
    if plan.crossings and has_external_force(task.robot):
        course = course_of(segment)
        return task.plan(course, course.shared(segment.duration * factor))
    crossings = tuple(
        crossing._replace(
            time=crossing.time * factor,
            kappa_rate=crossing.kappa_rate / factor,
            epsilon=crossing.epsilon / factor,
        )
        for crossing in plan.crossings
    )
    return plan._replace(path=Path([segment._replace(duration=segment.duration * factor)]), crossings=crossings)


def course_of(segment: Segment | RoundedSegment) -> Course:
    """Return the course of a segment that meets the dynamic criterion."""
    if isinstance(segment, RoundedSegment):
        return Course(segment.curve.points, segment.curve.radii[1:-1], CRITERION)
    return Course(((segment.start_x, segment.start_y), (segment.end_x, segment.end_y)), (), CRITERION)
