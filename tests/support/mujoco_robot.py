"""A five-bar with effects in MuJoCo: its own dynamics, transmissions and loop, for comparison with ours."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import mujoco

from fivebar_description.parameters import FiveBar
from fivebar_sim.effects.loads import weight_of
from fivebar_sim.settings import PlantSettings

STEP = 5e-5
TINY = 1e-12
STIFF = 'solref="0.0001 1" solimp="0.9999 0.9999 0.001 0.5 2"'


def mjcf_text(robot: FiveBar, plant: PlantSettings) -> str:
    """Return the mechanism: hinges for rotors and links, springs as tendons, half of the mass at each tip."""
    weight = weight_of(plant.tilt)
    share = plant.transmission.rotor_share if plant.transmission.frequency > 0.0 else 0.0
    bodies, springs = "", ""
    for number, leg in enumerate((robot.leg1, robot.leg2), start=1):
        link = (1.0 - share) * leg.inertia
        mass = f'<inertial pos="0 0 0" mass="{1e-9}" diaginertia="{TINY} {TINY} {TINY}"/>'
        if share > 0.0:
            bodies += f"""
    <body pos="{leg.base_x!r} 0 0">
      <joint name="m{number}" axis="0 0 1" armature="{share * leg.inertia!r}"/>{mass}
    </body>"""
            pulsation = 2.0 * math.pi * plant.transmission.frequency
            springs += f"""
    <fixed name="t{number}" stiffness="{leg.inertia * pulsation**2!r}" springlength="0"
           damping="{2.0 * plant.transmission.damping * leg.inertia * pulsation!r}">
      <joint joint="m{number}" coef="1"/><joint joint="q{number}1" coef="-1"/>
    </fixed>"""
        # an inertia of the distal link, as it is without the two points
        inertia = TINY + plant.links.distal_inertia
        bodies += f"""
    <body pos="{leg.base_x!r} 0 0">
      <joint name="q{number}1" axis="0 0 1" armature="{link!r}"/>{mass}
      <body pos="{leg.proximal!r} 0 0">
        <joint name="q{number}2" axis="0 0 1"/>
        <inertial pos="{leg.distal!r} 0 0" mass="{robot.mass / 2.0!r}" diaginertia="{inertia} {inertia} {inertia}"/>
        <site name="tip_{number}" pos="{leg.distal!r} 0 0"/>
      </body>
    </body>"""
    loop = f'<equality><connect site1="tip_1" site2="tip_2" {STIFF}/></equality>'
    if plant.platform_joint.stiffness > 0.0:
        loop = ""
        springs += f"""
    <spatial name="loop" stiffness="{plant.platform_joint.stiffness!r}" springlength="0">
      <site site="tip_1"/><site site="tip_2"/>
    </spatial>"""
    return f"""<mujoco>
  <option timestep="{STEP}" integrator="RK4" gravity="{weight.x!r} {weight.y!r} 0"><flag contact="disable"/></option>
  <worldbody>{bodies}
  </worldbody>
  <tendon>{springs}
  </tendon>
  {loop}
</mujoco>
"""


class MujocoRobot:
    """The mechanism in motion under constant motor torques, with friction in the passive joints and none elsewhere."""

    def __init__(self, robot: FiveBar, plant: PlantSettings, joints: tuple[float, ...]) -> None:
        """Build it in a posture (rad) at rest."""
        self._model: Any = mujoco.MjModel.from_xml_string(mjcf_text(robot, plant))
        self._data: Any = mujoco.MjData(self._model)
        self._passive, self._width = plant.friction.passive, robot.leg1.width
        names = ("q11", "q12", "q21", "q22")
        self._links = [self._model.joint(name).qposadr[0] for name in names]
        elastic = plant.transmission.frequency > 0.0
        self._motors = [self._model.joint(name).qposadr[0] for name in (("m1", "m2") if elastic else ("q11", "q21"))]
        q = self._data.qpos
        q[self._links] = joints
        q[self._motors] = joints[0], joints[2]

    def moved(self, torques: tuple[float, float], time: float, every: float) -> Iterator[list[float]]:
        """Give the four joints (rad) after each period (s)."""
        steps = round(every / STEP)
        for _ in range(round(time / every)):
            for _ in range(steps):
                self._push(torques)
                mujoco.mj_step(self._model, self._data)
            yield [float(self._data.qpos[place]) for place in self._links]

    def _push(self, torques: tuple[float, float]) -> None:
        force, rate = self._data.qfrc_applied, self._data.qvel
        force[:] = 0.0
        force[self._motors] = torques
        q11, q12, q21, q22 = self._links
        for elbow in (q12, q22):
            force[elbow] -= self._passive * math.tanh(rate[elbow] / self._width)
        between = rate[q11] + rate[q12] - rate[q21] - rate[q22]
        torque = self._passive * math.tanh(between / self._width)
        # on the distal link of leg 1 against that of leg 2, each against the world through both its joints
        force[[q11, q12]] -= torque
        force[[q21, q22]] += torque
