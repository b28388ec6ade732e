# SPDX-License-Identifier: Apache-2.0
"""A crossing of the Type 2 singular locus as an environment of gymnasium."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

from fivebar_bringup.simulation.case import FloatArray
from fivebar_bringup.simulation.stepped_run import SteppedRun
from fivebar_control.safety.stages import NO_FAULT
from fivebar_gym.tasks import FAULT, TIME_LEFT, Tasks


class CrossingEnv(gymnasium.Env[FloatArray, FloatArray]):
    """A robot that is to follow a straight segment into its other assembly mode; a step is a sample of 2 ms.

    A seed draws the crossing of an episode, as the benchmark draws its own, together with the robot and its errors that
    a rig has for it. `reset(options={"crossing": number})` chooses one.

    - Observation: float64, the values that `fivebar_bringup.simulation.stepped_run.Seen` names: angles and rates of the
      joints (rad, rad/s), place, velocity and acceleration of the reference (m, m/s, m/s^2), its goal (m), the time
      left (s), and the working mode. With `observation="encoders"` the passive joints are left out. Encoders read as
      those of the rig do.
    - Action: the torques of both motors (Nm), at most those of the drives. The guard limits them, as it does a law's.
    - Reward: 1 / (1 + d / d_max) after each step, for a distance d of the actual platform from its reference, where
      d_max is the limit of the benchmark: 2 mm, or in proportion to the robot's size; 0 after the guard has stopped it.
    - Terminated: the guard has stopped the robot, or it moves too fast to be simulated.
    - Truncated: the reference is at its goal.
    - Info: `crossing`, its number; at the end `success` by the rules of the benchmark, `fault`, the name of what has
      stopped the robot or "", and `error_peak`, the largest d (m).
    """

    def __init__(
        self,
        robot: str = "",
        rig: str = "ideal",
        observation: str = "all",
        crossings: int = 1000,
        crossings_seed: int = 1,
        render_mode: None = None,
    ) -> None:
        """Make an environment.

        Args:
            robot: by name, or the path of its file, on the rigs `ideal` and `encoders`; "" for that of the rig.
            rig: whose robots cross, by name or path.
            observation: "all" or "encoders".
            crossings: how many different ones are drawn. Each takes some hundredths of a second when it comes first.
            crossings_seed: of crossings and robots; 1914 is that of the benchmark.
            render_mode: there is none.

        Raises:
            InputError: there is no such robot, rig or observation, or the rig cannot have the robot.
        """
        self._tasks = Tasks(robot, rig, observation, crossings, crossings_seed)
        self.observation_space, self.action_space = self._tasks.observation_space, self._tasks.action_space
        self._run: SteppedRun | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Begin an episode, with a robot at rest where the reference begins."""
        super().reset(seed=seed)
        self._task = self._tasks.task(self.np_random, (options or {}).get("crossing"))
        self._run = SteppedRun(self._task.case, self._task.plan)
        return self._tasks.observed(self._run.seen), {"crossing": self._task.crossing.crossing}

    def step(self, action: FloatArray) -> tuple[FloatArray, float, bool, bool, dict[str, Any]]:
        """Apply torques (Nm), float64[2], for a sample.

        Raises:
            ValueError: the shape of the action is another one.
            ResetNeeded: no episode has begun.
        """
        if self._run is None:
            raise gymnasium.error.ResetNeeded("step: expected reset before")
        if np.shape(action) != (2,):
            raise ValueError(f"action of shape {np.shape(action)}: expected (2,)")
        run = self._run
        run.torque[:] = action
        run.step()
        terminated, truncated = bool(run.seen[FAULT] != NO_FAULT), bool(run.seen[TIME_LEFT] == 0.0)
        observation, reward = self._tasks.observed(run.seen), float(self._tasks.rewards(run.seen))
        info: dict[str, Any] = {"crossing": self._task.crossing.crossing}
        if terminated or truncated:
            info |= self._tasks.verdict(self._task, run)
        return observation, reward, terminated, truncated and not terminated, info
