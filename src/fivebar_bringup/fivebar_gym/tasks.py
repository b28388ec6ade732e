# SPDX-License-Identifier: Apache-2.0
"""The crossings of an environment's episodes: drawn as those of the benchmark are, and judged by its rules."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from gymnasium.spaces import Box

from fivebar_bringup.simulation.case import Case, FloatArray
from fivebar_bringup.simulation.observation import Observation
from fivebar_bringup.simulation.stepped_run import Seen, SteppedRun, columns_observed
from fivebar_control.loop.closed_loop import FAULT_NAMES
from fivebar_control.loop.sampled_plan import Sampled
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.errors import InputError
from fivebar_description.suggestion import expected_one_of
from fivebar_studies.benchmark.crossings import BenchmarkCrossing, drawn_crossing
from fivebar_studies.benchmark.running import BenchmarkSettings, outside, result_from
from fivebar_studies.benchmark.scoring import success
from fivebar_studies.rigs.declared import robot_name
from fivebar_studies.rigs.named import named_rig

DISTANCE, FAULT = Seen._fields.index("distance"), Seen._fields.index("fault")
TIME_LEFT, FARTHEST = Seen._fields.index("time_left"), Seen._fields.index("farthest")


class GymTask(NamedTuple):
    """The crossing of an episode, ready for the engine."""

    crossing: BenchmarkCrossing
    case: Case
    plan: Sampled


class Tasks:
    """So many crossings of a robot, each with the robot that a rig has for it, and how episodes are judged.

    Attributes:
        observation_space, action_space: of the environment.
    """

    def __init__(self, robot: str, rig: str, observation: str, crossings: int, crossings_seed: int) -> None:
        """Choose robot and rig; a crossing is drawn when it is first asked for.

        Raises:
            InputError: there is no such robot, rig or observation, or the rig cannot have the robot.
        """
        if observation not in [*Observation]:
            raise InputError(f"observation: {observation!r}: {expected_one_of(observation, [*Observation])}")
        if crossings < 1:
            raise InputError(f"crossings: {crossings}: expected at least 1")
        self._rig, self._seed, self._count = named_rig("rig", rig), crossings_seed, crossings
        self._robot = robot and robot_name(robot)
        settings = BenchmarkSettings(rigs=(self._rig,), controllers=(), robot=self._robot)
        try:
            self._make, self._limits = settings.make, settings.limits
        except InputError as error:
            # in words of the command
            raise InputError(str(error).replace("--", "")) from error
        self._columns, self._tasks = columns_observed(Observation(observation)), dict[int, GymTask]()
        self.observation_space = Box(-np.inf, np.inf, (len(self._columns),), np.float64)
        self.action_space = Box(-self._limits.torque, self._limits.torque, (2,), np.float64)

    def task(self, random: np.random.Generator, number: int | None = None) -> GymTask:
        """Return a crossing at random, or that of a number.

        Raises:
            InputError: there is none of that number, or none that the drives can make.
        """
        if number is None:
            number = int(random.integers(self._count))
        if not 0 <= number < self._count:
            raise InputError(f"crossing: {number}: expected 0 to {self._count - 1}")
        if number not in self._tasks:
            crossing = drawn_crossing(self._seed, self._make, number)
            case = crossing.on(self._rig, self._robot, self._seed)
            self._tasks[number] = GymTask(crossing, *outside(case))
        return self._tasks[number]

    def observed(self, seen: FloatArray) -> FloatArray:
        """Return observations, float64[..., n], of what is seen of samples, float64[..., columns of `Seen`]."""
        return seen[..., self._columns]

    def rewards(self, seen: FloatArray) -> FloatArray:
        """Return the rewards of steps, given what is seen after them, float64[..., columns of `Seen`]."""
        near = 1.0 / (1.0 + seen[..., DISTANCE] / self._limits.peak)
        rewards: FloatArray = np.where(seen[..., FAULT] == NO_FAULT, near, 0.0)
        return rewards

    def verdict(self, task: GymTask, run: SteppedRun) -> dict[str, Any]:
        """Return the information about an episode at its end, see `CrossingEnv`.

        A run that was not stopped is finished: the last torque answers the last sample.
        """
        made = False
        if run.fault == NO_FAULT:
            run.step()
            result = result_from(run.outcome(), task.crossing, self._rig, "", len(task.plan.rows))
            made = success(result, task.crossing, self._limits)
        return {"success": made, "fault": FAULT_NAMES[run.fault], "error_peak": float(run.seen[FARTHEST])}
