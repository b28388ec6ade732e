# SPDX-License-Identifier: Apache-2.0
"""A run of the engine whose torques come from outside, sample by sample: for policies in place of laws.

Robot, drives, encoders, guard and metrics are those of every compiled run. There is no estimator: the guard knows all
joints, as the sensors of the scenario read them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import Case, EngineRun, FloatArray, case_of
from fivebar_bringup.simulation.engine import IDEAL, WITH_EFFECTS, planned_at
from fivebar_bringup.simulation.engine_estimator import measured, state_of, unmeasured
from fivebar_bringup.simulation.engine_robot import Robot, moved_ideal, started_ideal
from fivebar_bringup.simulation.engine_table import RunEnd, TraceRow, metrics_of_table
from fivebar_bringup.simulation.observation import Observation
from fivebar_bringup.simulation.run_metrics import RunMetrics
from fivebar_bringup.simulation.table_rows import concluded, empty_table, recorded
from fivebar_control.compiling import bound, compiled_and_kept
from fivebar_control.laws.law import Instant, Law, no_step, unchanged
from fivebar_control.laws.torque import Torque
from fivebar_control.loop.closed_loop import PLANT_DIVERGED, Known, LoopSettings, answer, first_memory, unanswered
from fivebar_control.loop.cycle import CycleMemory
from fivebar_control.loop.sampled_plan import AX, AY, VX, VY, Sampled, X, Y
from fivebar_control.model.state import Joints, Platform, WorkingMode
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.parameters import FiveBar


class Seen(NamedTuple):
    """A sample as it is seen from outside.

    Attributes:
        q11, q12, q21, q22, dq11, dq12, dq21, dq22: what encoders on all joints read (rad, rad/s).
        x, y, vx, vy, ax, ay: the reference of the platform (m, m/s, m/s^2).
        goal_x, goal_y: its end (m).
        time_left: until then (s).
        mode1, mode2: working mode, 1 or -1 for each leg.
        distance, farthest: of the actual platform from the reference (m), now and until now.
        fault: number of the fault that has stopped the robot, 0 for none.
    """

    q11: float
    q12: float
    q21: float
    q22: float
    dq11: float
    dq12: float
    dq21: float
    dq22: float
    x: float
    y: float
    vx: float
    vy: float
    ax: float
    ay: float
    goal_x: float
    goal_y: float
    time_left: float
    mode1: float
    mode2: float
    distance: float
    farthest: float
    fault: float


FARTHEST, FAULT = Seen._fields.index("farthest"), Seen._fields.index("fault")

PASSIVE = ("q12", "q22", "dq12", "dq22")


def observed(observation: Observation) -> list[str]:
    """Return the names of the values that a policy observes: what its encoders read, and its task."""
    task_and_joints = Seen._fields[: Seen._fields.index("distance")]
    return [name for name in task_and_joints if observation == Observation.ALL or name not in PASSIVE]


def columns_observed(observation: Observation) -> list[int]:
    """Return their columns in `Seen`."""
    return [Seen._fields.index(name) for name in observed(observation)]


class NoSettings(NamedTuple):
    """The settings of a law that has none."""


def step(robot: FiveBar, instant: Instant, memory: FloatArray, settings: NoSettings) -> tuple[Torque, FloatArray]:
    """Return the torque that was put into the memory."""
    return Torque(memory[0], memory[1]), memory


def no_torque(
    robot: FiveBar, mode: WorkingMode, references: Sequence[Platform], period: float, settings: NoSettings
) -> FloatArray:
    """Return the memory before the first sample, float64[2]."""
    return np.zeros(2)


LAW = Law(name="outside", title="torques from outside", settings=NoSettings, step=step, prepare=no_torque)

OUTSIDE = f"{__name__}:LAW"
"""The controller of a scenario whose torques come from outside."""


def outside_case(scenario: Scenario) -> Case:
    """Return the case of a scenario with the controller `OUTSIDE`, without its estimator."""
    return case_of(scenario.model_copy(update={"estimator": "none"}))


begin: Callable[[EngineRun], Robot] = started_ideal
advance: Callable[[EngineRun, Robot, int, Torque], Robot] = moved_ideal
"""The robot, to be bound to one with effects before."""


def stepping(
    run: EngineRun, settings: LoopSettings, first: CycleMemory, seen: FloatArray, end: FloatArray
) -> Iterator[int]:
    """Run the closed loop, and stop at each sample until its torque is there.

    Args:
        run: of the engine.
        settings: constants.
        first: memory before the first sample, with the torque to be filled before each step of the iterator.
        seen: float64[columns of `Seen`], filled at each sample.
        end: float64[fields of `RunEnd`], filled at the end.
    """
    robot = begin(run)
    known, log = unmeasured(run, robot), empty_table(run)
    loop = unanswered(first, 0)
    fault, fault_sample, farthest = NO_FAULT, -1, 0.0
    for number in range(settings.last + 1):
        known = measured(run, known, robot, number)
        now = seen_at(run, robot, known.joints, number, settings.last, farthest, fault)
        farthest = now.farthest
        for column, value in enumerate(now):
            seen[column] = value
        yield number
        planned, all_joints = planned_at(run, number), Known(True, known.state, 0.0, 0.0, NO_FAULT)
        loop = answer(step, no_step, unchanged, unchanged, settings, loop, number, all_joints, planned)
        fault, fault_sample = loop.fault, loop.fault_sample
        log = recorded(run, log, number, robot, known, planned, loop)
        if number < settings.last:
            robot = advance(run, robot, number, loop.cycle.command)
            if robot.diverged:
                if fault == NO_FAULT:
                    fault, fault_sample = PLANT_DIVERGED, number
                break
    seen[FAULT] = fault
    end[0], end[1], end[2], end[3], end[4] = concluded(run, log, robot, fault, fault_sample)


def seen_at(run: EngineRun, robot: Robot, joints: Joints, number: int, last: int, farthest: float, fault: int) -> Seen:
    """Return a sample as it is seen from outside.

    Args:
        run: of the engine.
        robot: at the sample.
        joints: as they are read.
        number, last: of the sample, and of the last one.
        farthest: distance of the platform from its reference (m) until the sample before.
        fault: number of the fault that has stopped the robot.
    """
    control, rows = run.case.control, run.plan.rows
    there = state_of(run.case.actual, robot.exact)
    off_x, off_y = there.x - rows[number, X], there.y - rows[number, Y]
    distance = math.sqrt(off_x * off_x + off_y * off_y)
    return Seen(
        q11=joints.q11,
        q12=joints.q12,
        q21=joints.q21,
        q22=joints.q22,
        dq11=joints.dq11,
        dq12=joints.dq12,
        dq21=joints.dq21,
        dq22=joints.dq22,
        x=rows[number, X],
        y=rows[number, Y],
        vx=rows[number, VX],
        vy=rows[number, VY],
        ax=rows[number, AX],
        ay=rows[number, AY],
        goal_x=rows[last, X],
        goal_y=rows[last, Y],
        time_left=(last - number) * control.period,
        mode1=float(control.mode[0]),
        mode2=float(control.mode[1]),
        distance=distance,
        farthest=max(farthest, distance),
        fault=float(fault),
    )


@cache
def _stepping(effects: bool, compiled: bool) -> Any:
    robot = WITH_EFFECTS if effects else IDEAL
    return (compiled_and_kept if compiled else bound)(stepping, **robot)


class SteppedRun:
    """A run along a sampled plan (`loop.sampled_plan`) that waits at each sample for its torque."""

    def __init__(
        self,
        case: Case,
        plan: Sampled,
        torque: FloatArray | None = None,
        seen: FloatArray | None = None,
        compiled: bool = True,
    ) -> None:
        """Begin at sample 0. The first run in an installation compiles for some seconds.

        Args:
            case: of `outside_case`.
            plan: its sampled plan.
            torque: float64[2], from which the torques (Nm) are taken; a new one by default.
            seen: float64[columns of `Seen`], which is filled at each sample; a new one by default.
            compiled: whether it is machine code; without, a sample takes a hundred times as long.
        """
        self.torque = np.zeros(2) if torque is None else torque
        self.seen = np.zeros(len(Seen._fields)) if seen is None else seen
        numbers, self._case, self._plan = case.numbers, case, plan
        self._trace, self._end = np.empty((len(plan.rows), len(TraceRow._fields))), np.full(len(RunEnd._fields), -1.0)
        first = first_memory(case.controller, numbers.control, list)._replace(nominal=self.torque)
        settings = LoopSettings(numbers.control, 0, len(plan.rows) - 1, 0, False)
        run = EngineRun(numbers, plan, self._trace)
        stepped = _stepping(numbers.mechanism is not None, compiled)
        self.samples: Iterator[int] = stepped(run, settings, first, self.seen, self._end)
        """Iterator whose steps answer a sample each by the torque, and see the next one."""
        self.step()

    def step(self) -> None:
        """Answer the present sample by the torque, under the guard, and see the next one; nothing after the last."""
        next(self.samples, None)

    @property
    def finished(self) -> bool:
        """Whether the last sample has been answered, or the robot could be moved no further."""
        return bool(self._end[0] >= 0.0)

    @property
    def fault(self) -> int:
        """Number of the fault that has stopped the robot, `NO_FAULT` for none."""
        return int(self.seen[FAULT])

    def outcome(self) -> RunMetrics:
        """Return the metrics of the finished run."""
        samples, fault, fault_sample, *applied = self._end.tolist()
        ended = RunEnd(int(samples), int(fault), int(fault_sample), *applied)
        return metrics_of_table(self._case, self._plan, self._trace[: ended.samples], ended)
