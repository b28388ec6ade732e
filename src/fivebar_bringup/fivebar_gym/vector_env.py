# SPDX-License-Identifier: Apache-2.0
"""Many crossings side by side as a vector environment of gymnasium, on one core."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from fivebar_bringup.simulation.case import BoolArray, FloatArray
from fivebar_bringup.simulation.stepped_run import Seen, SteppedRun
from fivebar_control.safety.stages import NO_FAULT
from fivebar_gym.crossing_env import CrossingEnv
from fivebar_gym.tasks import FAULT, TIME_LEFT, GymTask, Tasks


class CrossingVectorEnv(VectorEnv[FloatArray, FloatArray, np.ndarray[Any, Any]]):
    """As many episodes of `CrossingEnv` at a time; an episode begins in the step after the end of the one before."""

    metadata = CrossingEnv.metadata | {"autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        num_envs: int = 1,
        robot: str = "",
        rig: str = "ideal",
        observation: str = "all",
        crossings: int = 1000,
        crossings_seed: int = 1,
        render_mode: None = None,
    ) -> None:
        """Make `num_envs` environments, which share their crossings; all else is as in `CrossingEnv`.

        Raises:
            InputError: as in `CrossingEnv`.
        """
        self.num_envs, self._tasks = num_envs, Tasks(robot, rig, observation, crossings, crossings_seed)
        self.single_observation_space = self._tasks.observation_space
        self.single_action_space = self._tasks.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._torques, self._seen = np.zeros((num_envs, 2)), np.zeros((num_envs, len(Seen._fields)))
        self._episodes: list[tuple[GymTask, SteppedRun]] = []
        self._ended = np.zeros(num_envs, dtype=np.bool_)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Begin all episodes; the option `crossing` is one number for all, or a list with one for each."""
        super().reset(seed=seed)
        chosen = np.broadcast_to(np.asarray((options or {}).get("crossing")), self.num_envs)
        self._episodes = [self._begun(place, number) for place, number in enumerate(chosen.tolist())]
        self._ended = np.zeros(self.num_envs, dtype=np.bool_)
        return self._tasks.observed(self._seen), self._info()

    def step(self, actions: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray, BoolArray, dict[str, Any]]:
        """Apply torques (Nm), float64[num_envs, 2], for a sample.

        Raises:
            ValueError: the shape of the actions is another one.
            ResetNeeded: no episodes have begun.
        """
        if not self._episodes:
            raise ResetNeeded("step: expected reset before")
        if np.shape(actions) != (self.num_envs, 2):
            raise ValueError(f"actions of shape {np.shape(actions)}: expected {(self.num_envs, 2)}")
        self._torques[:] = actions
        for _, run in self._episodes:
            next(run.samples, None)
        for place in np.flatnonzero(self._ended).tolist():
            self._episodes[place] = self._begun(place)
        rewards = np.where(self._ended, 0.0, self._tasks.rewards(self._seen))
        terminated = self._seen[:, FAULT] != NO_FAULT
        truncated = (self._seen[:, TIME_LEFT] == 0.0) & ~terminated
        observations, self._ended, info = self._tasks.observed(self._seen), terminated | truncated, self._info()
        for place in np.flatnonzero(self._ended).tolist():
            info = self._add_info(info, self._tasks.verdict(*self._episodes[place]), place)
        return observations, rewards, terminated, truncated, info

    def _begun(self, place: int, number: int | None = None) -> tuple[GymTask, SteppedRun]:
        task = self._tasks.task(self.np_random, number)
        return task, SteppedRun(task.case, task.plan, self._torques[place], self._seen[place])

    def _info(self) -> dict[str, Any]:
        return {"crossing": np.array([task.crossing.crossing for task, _ in self._episodes])}
