"""The same mechanism in MuJoCo: speed reference of the compiled loop, and a third implementation of the dynamics."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from typing import Any

import mujoco

from fivebar_control.model.state import State
from fivebar_description.parameters import FiveBar

STEP = 1e-3
"""s, with the integrator RK4."""

TINY_INERTIA = 1e-12
"""kg m^2. MuJoCo refuses bodies without inertia where the reduced model has none: 1e-10 of the motors'."""

TINY_MASS = 1e-9
"""kg, of the proximal links: their inertia about the motor axis is the joint's armature."""

STIFF = 'solref="0.002 1" solimp="0.9999 0.9999 0.001 0.5 2"'
"""The equality at the shortest time constant that MuJoCo takes at this step, nearly rigid: the loop is then closed to
some 1e-8 m, and the step costs no more than with MuJoCo's softer defaults, which leave it open by 0.4 mm."""


def mjcf_text(robot: FiveBar) -> str:
    """Return the mechanism as MJCF: two planar chains, each with half of the platform's mass, joined at their tips."""
    chains = "".join(
        f"""
    <body pos="{leg.base_x!r} 0 0">
      <joint name="q{number}1" axis="0 0 1" armature="{leg.inertia!r}"/>
      <inertial pos="0 0 0" mass="{TINY_MASS}" diaginertia="{TINY_INERTIA} {TINY_INERTIA} {TINY_INERTIA}"/>
      <body pos="{leg.proximal!r} 0 0">
        <joint name="q{number}2" axis="0 0 1"/>
        <inertial pos="{leg.distal!r} 0 0" mass="{robot.mass / 2.0!r}"
                  diaginertia="{TINY_INERTIA} {TINY_INERTIA} {TINY_INERTIA}"/>
        <site name="tip_{number}" pos="{leg.distal!r} 0 0"/>
      </body>
    </body>"""
        for number, leg in enumerate((robot.leg1, robot.leg2), start=1)
    )
    return f"""<mujoco>
  <option timestep="{STEP}" integrator="RK4" gravity="0 0 0"><flag contact="disable"/></option>
  <worldbody>{chains}
  </worldbody>
  <equality><connect site1="tip_1" site2="tip_2" {STIFF}/></equality>
</mujoco>
"""


class MujocoFiveBar:
    """The mechanism in motion, without torque and friction."""

    def __init__(self, robot: FiveBar, start: State) -> None:
        """Build the model and put it into a state."""
        self._model: Any = mujoco.MjModel.from_xml_string(mjcf_text(robot))
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
