# SPDX-License-Identifier: Apache-2.0
"""The same mechanism in MuJoCo: speed reference of the compiled loop, and a third implementation of the dynamics."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from typing import Any

import mujoco

from fivebar_control.model.state import State
from fivebar_description.parameters import FiveBar
from fivebar_mujoco.mujoco_model import mjcf_text
from fivebar_sim.effects.settings import PlantSettings

STEP = 1e-3
"""s, with the integrator RK4."""


class MujocoFiveBar:
    """The mechanism in motion, without torque and friction."""

    def __init__(self, robot: FiveBar, start: State) -> None:
        """Build the model and put it into a state."""
        self._model: Any = mujoco.MjModel.from_xml_string(mjcf_text(robot, PlantSettings(), STEP))
        self._data: Any = mujoco.MjData(self._model)
        one, two = start.leg1, start.leg2
        self._position = (one.q1, one.q2, two.q1, two.q2)
        self._velocity = (one.dq1, one.dtheta - one.dq1, two.dq1, two.dtheta - two.dq1)

    def tips(self, steps: int) -> Iterator[tuple[tuple[float, float], tuple[float, float]]]:
        """Give both tips (m) after each of so many steps from the start."""
        self._begin()
        for _ in range(steps):
            mujoco.mj_step(self._model, self._data)
            mujoco.mj_kinematics(self._model, self._data)
            (x1, y1, _), (x2, y2, _) = self._data.site_xpos.tolist()
            yield (x1, y1), (x2, y2)

    def seconds(self, steps: int) -> float:
        """Return how long (s) so many steps from the start take."""
        self._begin()
        step, model, data = mujoco.mj_step, self._model, self._data
        began = time.perf_counter()
        for _ in range(steps):
            step(model, data)
        return time.perf_counter() - began

    def _begin(self) -> None:
        mujoco.mj_resetData(self._model, self._data)
        self._data.qpos[:], self._data.qvel[:] = self._position, self._velocity


def loop_gap(mechanism: MujocoFiveBar, steps: int) -> float:
    """Return the largest gap (m) between the tips over so many steps."""
    return max(math.dist(one, other) for one, other in mechanism.tips(steps))
