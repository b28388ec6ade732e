# SPDX-License-Identifier: Apache-2.0
"""A run predicted before the robot moves: the control cycle on the robot that the controllers model, sensed exactly.

The figures of a reference alone do not show what a controller makes of it: feedback near the locus, a torque limit that
is met, timing that a virtual constraint leaves free. The model's direct dynamics is regular on the Type 2 locus, so the
same cycle as in a run shows. What goes wrong already on the perfect robot is refused; that it goes right there is no
promise for a real one, for which the other figures keep their margins.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fivebar_control.compiling import as_machine_code, bound
from fivebar_control.laws.registry import TunedController
from fivebar_control.laws.torque import Torque
from fivebar_control.loop.closed_loop import (
    Advanced,
    Answered,
    Known,
    LoopSettings,
    cycle_settings_of,
    first_memory,
    law_functions,
    run_loop,
)
from fivebar_control.loop.cycle import CycleSettings
from fivebar_control.loop.plan_sample import PlanSample, plan_sample, planned_references, reference_ahead
from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.model.state import State, WorkingMode
from fivebar_control.safety.brake import brake_of
from fivebar_control.safety.settings import SafetySettings
from fivebar_control.safety.stages import NO_FAULT, distance_from, guard_limits_of
from fivebar_control.trajectory.joint_segment import JointSegment
from fivebar_control.trajectory.path_distance import PATH, TIMED, path_distances
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar, lost_torque, with_floats, without_cogging

LONGEST_STEP = 1e-3
"""Integration step (s) at most, as that of the plant."""

HOLD = 0.1
"""Time (s) after the motion that is predicted too: a platform that has come to rest has to stay there."""

LOST = 0.05
"""Distance (m) from the reference at which a prediction ends."""


class Peak(NamedTuple):
    """The largest value of a quantity, when (s since sample 0) and where (m)."""

    value: float
    time: float
    x: float
    y: float

    def or_larger(self, value: float, time: float, x: float, y: float) -> Peak:
        """Return the larger one of this and another value; one that is undefined is the largest of all."""
        if value <= self.value or math.isnan(self.value):
            return self
        return Peak(value, time, x, y)


class PredictedSample(NamedTuple):
    """The predicted robot at a sample: platform (m, m/s), and the torques (Nm) that act until the next one."""

    x: float
    y: float
    vx: float
    vy: float
    tau1: float
    tau2: float


class PredictedRun(NamedTuple):
    """The prediction of a run.

    Attributes:
        error: largest distance from the reference (m), infinite where the run cannot go on.
        torque: largest torque requested of either motor before the limits (Nm).
        mode_changes: how often the assembly mode changes; its place is that of the last change.
        moments: the robot, sample by sample.
        path_error: largest distance from the path, and after the end of the motion from its goal (m), where the motion
            is judged by it; else None.
    """

    error: Peak
    torque: Peak
    mode_changes: Peak
    moments: tuple[PredictedSample, ...] = ()
    path_error: Peak | None = None

    @property
    def judged(self) -> Peak:
        """The largest of the distances by which the motion is judged (m)."""
        return self.error if self.path_error is None else self.path_error


def predict_run(
    robot: FiveBar, plan: Plan, rate_hz: int, follower: TunedController, torque_limit: float, judge: str = TIMED
) -> PredictedRun:
    """Return what becomes of a plan on the robot as modelled, without delay, from a rest at its beginning.

    The model is not regular at Type 1. Of a plan that may meet it each stretch between such motions is predicted for
    itself, from the rest at its beginning, and what is planned in the motors' angles is left out.

    Args:
        robot: of the controllers and, here, of the plant.
        plan: to be followed.
        rate_hz: of the controllers.
        follower: the controller.
        torque_limit: to which its torque is limited (Nm), infinite for none.
        judge: by which distance the motion is judged, `TIMED` or `PATH`.
    """
    # the plant of the prediction does not cog
    robot = without_cogging(robot)
    start = plan.path.at(0.0)
    none = Peak(0.0, 0.0, start.x, start.y)
    predicted = PredictedRun(none, none, none)
    for stretch in stretches_of(plan, rate_hz):
        settings = prediction_settings(robot, plan, rate_hz, follower, torque_limit, stretch.mode)
        predicted = _predict_stretch(robot, plan, stretch, follower, settings, predicted)
        if math.isinf(predicted.error.value):
            break
    return judged_by(judge, predicted, plan, rate_hz)


def prediction_settings(
    robot: FiveBar,
    plan: Plan,
    rate_hz: int,
    follower: TunedController,
    torque_limit: float,
    mode: WorkingMode | None = None,
) -> CycleSettings:
    """Return the constants of the control cycle in a prediction, by default in the working mode of the whole plan."""
    # the prediction ends at the first fault, so that nothing is braked
    safety = SafetySettings(torque_limit=torque_limit, request_ratio=math.inf, type1_margin=0.0, brake=False)
    limits, brake = guard_limits_of(safety, rate_hz)._replace(tracking_error=LOST), brake_of(safety, robot, rate_hz)
    mode = mode or plan.mode
    return cycle_settings_of(robot, mode, rate_hz, follower, plan.zone_time, limits, brake)


def judged_by(judge: str, predicted: PredictedRun, plan: Plan, rate_hz: int) -> PredictedRun:
    """Return a predicted run of a plan with its distance from the path, where the motion is judged by it."""
    if judge != PATH or math.isinf(predicted.error.value):
        return predicted
    instants = (plan.path.at(sample / rate_hz) for sample in range(plan.path.samples(rate_hz) + 1))
    places = np.array([(instant.x, instant.y) for instant in instants])
    numbers = [sample for stretch in stretches_of(plan, rate_hz) for sample in range(stretch.first, stretch.last + 1)]
    platform = np.full((numbers[-1] + 1, 2), math.nan)
    platform[numbers[: len(predicted.moments)]] = np.array(predicted.moments)[:, :2]
    last = len(places) - 1
    ends = np.hypot(*(platform[last:] - places[last]).T)
    distances = np.concatenate((path_distances(places, platform[:last]), ends))
    worst = int(np.nanargmax(distances))
    return predicted._replace(path_error=Peak(float(distances[worst]), worst / rate_hz, *platform[worst].tolist()))


class Stretch(NamedTuple):
    """Samples `first` to `last` of a motion in platform coordinates, from a rest, in a working mode."""

    first: int
    last: int
    mode: WorkingMode


def stretches_of(plan: Plan, rate_hz: int) -> list[Stretch]:
    """Return the stretches of a plan that are predicted; what follows the end, too, belongs to the last one."""
    stretches: list[Stretch] = []
    joined = False
    for index, segment in enumerate(plan.path.segments):
        if isinstance(segment, JointSegment):
            joined = False
            continue
        mode = plan.modes[index] if plan.modes else plan.mode
        first = stretches.pop().first if joined else math.ceil(segment.start_time * rate_hz - 1e-6)
        # the instant between two segments belongs to the later one
        last = math.ceil((segment.start_time + segment.duration) * rate_hz - 1e-6) - 1
        stretches.append(Stretch(first, last, mode))
        joined = True
    if joined:
        stretches[-1] = stretches[-1]._replace(last=plan.path.samples(rate_hz) + math.ceil(HOLD * rate_hz))
    return stretches


class _Stretch:
    """A stretch of a plan on the robot as modelled, as the closed loop runs it; ends at the first fault."""

    def __init__(
        self,
        robot: FiveBar,
        plan: Plan,
        stretch: Stretch,
        follower: TunedController,
        settings: CycleSettings,
        before: PredictedRun,
    ) -> None:
        """Begin with what was predicted of the stretches before."""
        self._robot, self._plan, self._mode, self._follower = with_floats(robot), plan, stretch.mode, follower
        self._rate_hz = round(1.0 / settings.period)
        self._steps = math.ceil(settings.period / LONGEST_STEP - 1e-9)
        self._step = settings.period / self._steps
        self._advanced = as_machine_code(advanced)
        start = plan.path.at(stretch.first / self._rate_hz)
        self._state = state_from_platform(robot, stretch.mode, start.x, start.y, 0.0, 0.0)
        self._error, self._torque, self._changes, self._moments = *before[:3], list(before.moments)
        self._side = 0.0

    def estimate(self, number: int) -> Known:
        return Known(True, self._state, 0.0, 0.0, NO_FAULT)

    def plan_at(self, moment: int) -> PlanSample:
        ahead = reference_ahead(self._plan, moment, self._rate_hz, self._follower.samples_ahead)
        return plan_sample(self._robot, self._plan, moment / self._rate_hz, ahead)

    def record(self, number: int, known: Known, planned: PlanSample, loop: Answered) -> None:
        t, state, desired, cycle = number / self._rate_hz, self._state, planned.platform, loop.cycle
        asked = cycle.requested
        self._error = self._error.or_larger(distance_from(state, desired.x, desired.y), t, state.x, state.y)
        determinant = det_a(state)
        if determinant * self._side < 0.0:
            self._changes = Peak(self._changes.value + 1.0, t, state.x, state.y)
        self._side = determinant or self._side
        self._torque = self._torque.or_larger(max(abs(asked.tau1), abs(asked.tau2)), t, state.x, state.y)
        if cycle.fault == NO_FAULT:
            moment = PredictedSample(state.x, state.y, state.vx, state.vy, cycle.command.tau1, cycle.command.tau2)
            self._moments.append(moment)
        else:
            self._error = Peak(math.inf, t, state.x, state.y)

    def ended(self, fault: int) -> bool:
        return fault != NO_FAULT

    def advance(self, number: int, command: Torque) -> Advanced:
        self._state = self._advanced(self._robot, self._mode, self._state, command, self._step, self._steps)
        return Advanced(False)

    def conclude(self) -> PredictedRun:
        return PredictedRun(self._error, self._torque, self._changes, tuple(self._moments))


def _predict_stretch(
    robot: FiveBar,
    plan: Plan,
    stretch: Stretch,
    follower: TunedController,
    settings: CycleSettings,
    before: PredictedRun,
) -> PredictedRun:
    """Return what becomes of a stretch together with those before it."""
    rate_hz = round(1.0 / settings.period)
    memory = first_memory(follower.controller, settings, lambda: planned_references(plan, rate_hz))
    loop = bound(run_loop, **law_functions(follower.controller))
    run = _Stretch(robot, plan, stretch, follower, settings, before)
    predicted: PredictedRun = loop(run, LoopSettings(settings, stretch.first, stretch.last, 0, False), memory)
    return predicted


def advanced(robot: FiveBar, mode: WorkingMode, state: State, torque: Torque, step: float, steps: int) -> State:
    """Return the state after some Runge-Kutta steps (s) under a torque (Nm)."""
    x, y, vx, vy = state.x, state.y, state.vx, state.vy
    for _ in range(steps):
        ax1, ay1 = _acceleration(robot, mode, x, y, vx, vy, torque)
        h = 0.5 * step
        vx2, vy2 = vx + h * ax1, vy + h * ay1
        ax2, ay2 = _acceleration(robot, mode, x + h * vx, y + h * vy, vx2, vy2, torque)
        vx3, vy3 = vx + h * ax2, vy + h * ay2
        ax3, ay3 = _acceleration(robot, mode, x + h * vx2, y + h * vy2, vx3, vy3, torque)
        vx4, vy4 = vx + step * ax3, vy + step * ay3
        ax4, ay4 = _acceleration(robot, mode, x + step * vx3, y + step * vy3, vx4, vy4, torque)
        x += step / 6.0 * (vx + 2.0 * vx2 + 2.0 * vx3 + vx4)
        y += step / 6.0 * (vy + 2.0 * vy2 + 2.0 * vy3 + vy4)
        vx += step / 6.0 * (ax1 + 2.0 * ax2 + 2.0 * ax3 + ax4)
        vy += step / 6.0 * (ay1 + 2.0 * ay2 + 2.0 * ay3 + ay4)
    return state_from_platform(robot, mode, x, y, vx, vy)


def _acceleration(
    robot: FiveBar, mode: WorkingMode, x: float, y: float, vx: float, vy: float, torque: Torque
) -> tuple[float, float]:
    """Return the platform's acceleration (m/s^2)."""
    here = state_from_platform(robot, mode, x, y, vx, vy)
    f1 = lost_torque(robot, robot.leg1, here.leg1.q1, here.leg1.dq1)
    f2 = lost_torque(robot, robot.leg2, here.leg2.q1, here.leg2.dq1)
    response = direct_dynamics(robot, here, torque.tau1, torque.tau2, f1, f2)
    return response.ax, response.ay
