# SPDX-License-Identifier: Apache-2.0
"""The robot in MuJoCo from sample to sample: a second plant, whose dynamics are not this project's equations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from fivebar_description.closed_loop import Vector
from fivebar_description.parameters import FiveBar
from fivebar_mujoco.mujoco_robot import MujocoRobot, mujoco_robot
from fivebar_sim.effects.cable import cable_force, stretched_energy
from fivebar_sim.effects.encoders import EncoderReading, read_at, seen
from fivebar_sim.effects.friction import friction
from fivebar_sim.effects.heating import heat_after, hot_share
from fivebar_sim.effects.loads import felt_weight, held, push_at
from fivebar_sim.effects.mechanism import Mechanism, longest_step, mechanism_of
from fivebar_sim.effects.motors import current_after, motor_torque
from fivebar_sim.effects.observation import ImuMotion
from fivebar_sim.effects.settings import PlantSettings
from fivebar_sim.effects.simulation import started_at
from fivebar_sim.effects.supply import supplied_share
from fivebar_sim.effects.timing import moments_after
from fivebar_sim.effects.transmission import transmitted

MAX_STEP = 1e-4
"""Longest integration step (s)."""

MAX_GAP, MAX_STRETCH = 1e-4, 0.01
"""Gap (m) between the tips beyond which the simulation has diverged: of a rigid loop, and of an elastic one."""

LINKS = ("q11", "q12", "q21", "q22")


class MujocoMotion:
    """The mechanism of some settings, from sample to sample.

    MuJoCo has the bodies, the springs of transmissions and loop, viscous friction, weight, and the closed loop as an
    equality constraint; it integrates by classical Runge-Kutta. What it has not is applied to it as forces, held over
    a step at their values in its middle: the motors' torque, friction by the robot file's tanh and the Stribeck curve,
    the dampers of flanks that touch, a constant force, a push and a cable. Over a step the base's vibration is added to
    the weight, and viscous friction is that of the motors' heat.
    """

    def __init__(self, robot: FiveBar, settings: PlantSettings, rate_hz: int, joints: Sequence[float]) -> None:
        """Put the robot where its motors' encoders read those of a posture (rad).

        Raises:
            InputError: the posture is malformed, its legs cannot meet, or effects contradict each other.
        """
        self._settings, self._rate_hz = settings, rate_hz
        self.mechanism: Mechanism = mechanism_of(robot, settings, rate_hz)
        steps = math.ceil(self.mechanism.period / min(MAX_STEP, longest_step(self.mechanism)) - 1e-9)
        self.step = self.mechanism.period / steps
        """Longest of the integration (s)."""
        self._robot: MujocoRobot = mujoco_robot(robot, settings, self.mechanism, self.step)
        self._model: Any = mujoco.MjModel.from_xml_string(self._robot.model)
        self._data: Any = mujoco.MjData(self._model)
        self._links = [self._address(name) for name in LINKS]
        self._motors = [self._address(name) for name in (("m1", "m2") if self.mechanism.elastic else ("q11", "q21"))]
        self._distal = [self._model.body(name).id for name in ("distal_1", "distal_2")]
        self._arms = self._arms_of_distal_links()
        self._sites = [self._model.site(name).id for name in ("tip_1", "tip_2")]
        self._heats = [0.0, 0.0]
        self._currents = [0.0, 0.0]
        self._wanted = (0.0, 0.0)
        self._number = 0
        at = started_at(self.mechanism, joints).at
        q = self._data.qpos
        q[self._links] = at.link1, at.distal1 - at.link1, at.link2, at.distal2 - at.link2
        q[self._motors] = at.rotor1, at.rotor2
        discs = self._robot.leg1.disc, self._robot.leg2.disc
        self._read: list[EncoderReading] = [
            seen(disc, angle, 0.0) for disc, angle in zip(discs, (at.rotor1, at.rotor2), strict=True)
        ]
        self._seen = self._see(-1.0)
        self._apply(self._currents, 0.0, 0.0)
        mujoco.mj_forward(self._model, self._data)

    def _address(self, name: str) -> int:
        return int(self._model.joint(name).qposadr[0])

    @property
    def joints(self) -> tuple[Vector, Vector]:
        """The actual angles (rad) and rates (rad/s) of the four joints, each (4,)."""
        return self._data.qpos[self._links], self._data.qvel[self._links]

    @property
    def seen(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """The same as encoders saw them when they were read, the motors' on the rotors."""
        return self._seen

    def _see(self, time: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Read the encoders for the sample at a time (s)."""
        (_, q12, _, q22), (_, v12, _, v22) = (values.tolist() for values in self.joints)
        angles, speeds = self._data.qpos[self._motors].tolist(), self._data.qvel[self._motors].tolist()
        discs = self._robot.leg1.disc, self._robot.leg2.disc
        reading1, reading2 = self._read = [
            read_at(disc, angle, speed, time, before)
            for disc, angle, speed, before in zip(discs, angles, speeds, self._read, strict=True)
        ]
        return (reading1.angle, q12, reading2.angle, q22), (reading1.speed, v12, reading2.speed, v22)

    def advance(self, applied: tuple[float, float]) -> float:
        """Move on by a sample under applied torques (Nm); return the loop's gap (m), infinite where that cannot be."""
        period = self.mechanism.period
        moments = moments_after(self._robot.delays, self._number, period)
        reached = 0.0
        for moment in sorted({*moments, period}):
            if moment > reached:
                self._move(self._number * period + reached, moment - reached)
                reached = moment
            if moment == moments.obeyed:
                self._wanted = applied
            if moment == moments.read:
                self._seen = self._see((self._number + 1) * period)
        self._number += 1
        self._apply(self._currents, self._number * period, 0.0)
        mujoco.mj_forward(self._model, self._data)
        tip1, tip2 = self._data.site_xpos[self._sites].tolist()
        gap = math.dist(tip1, tip2)
        return gap if gap <= (MAX_STRETCH if self.mechanism.compliant else MAX_GAP) else math.inf

    def _move(self, begin: float, length: float) -> None:
        """Integrate over a length (s) of a sample from a time (s) on."""
        steps = max(1, math.ceil(length / self.step - 1e-9))
        self._model.opt.timestep = step = length / steps
        for number in range(steps):
            middle = (number + 0.5) * step
            before = self._data.qpos[self._motors].tolist()
            self._apply(self._currents_after(middle), begin + middle, 0.5 * step)
            mujoco.mj_step(self._model, self._data)
            self._heat(before, step)
        self._currents = self._currents_after(length)

    def _heat(self, before: Sequence[float], time: float) -> None:
        """Heat the motors, which were at some angles (rad) a time (s) ago, by their friction since."""
        heating = self._robot.heating
        if heating.change == 0.0:
            return
        places = self._data.qpos[self._motors].tolist()
        for motor, leg in enumerate((self.mechanism.leg1, self.mechanism.leg2)):
            moved = places[motor] - before[motor]
            self._heats[motor] = heat_after(heating, leg.motor_friction, self._heats[motor], moved, time)

    def _currents_after(self, time: float) -> list[float]:
        band = self._robot.bandwidth
        return [
            current_after(current, wanted, band, time)
            for current, wanted in zip(self._currents, self._wanted, strict=True)
        ]

    def hold(self, x: float, y: float) -> None:
        """Hold a force (N) on the platform from now on, in place of any push, such as that of a hand."""
        self._robot = self._robot._replace(push=held(x, y))
        self._data.xfrc_applied[:] = 0.0

    def carry(self, robot: FiveBar) -> None:
        """Go on with another mass of the platform, that of a modelled robot."""
        self.mechanism = mechanism_of(robot, self._settings, self._rate_hz)
        loaded = mujoco_robot(robot, self._settings, self.mechanism, self.step)
        self._robot = loaded._replace(push=self._robot.push)
        self._model = mujoco.MjModel.from_xml_string(self._robot.model)
        self._arms = self._arms_of_distal_links()
        before, self._data = self._data, mujoco.MjData(self._model)
        self._data.qpos[:], self._data.qvel[:] = before.qpos, before.qvel
        self._data.time = before.time
        self._apply(self._currents, self._number * self.mechanism.period, 0.0)
        mujoco.mj_forward(self._model, self._data)

    def _arms_of_distal_links(self) -> list[float]:
        """Return the distance of each distal link's tip from its centre of mass (m)."""
        return [
            leg.distal - float(self._model.body_ipos[body][0])
            for leg, body in zip((self.mechanism.leg1, self.mechanism.leg2), self._distal, strict=True)
        ]

    def imu_motion(self) -> ImuMotion:
        """Return the motion of the link that carries the IMU."""
        mujoco.mj_rnePostConstraint(self._model, self._data)
        motion, (_, tip) = np.zeros(6), self._sites
        mujoco.mj_objectAcceleration(self._model, self._data, mujoco.mjtObj.mjOBJ_SITE, tip, motion, 1)
        _, _, rate_change, along, across, _ = motion.tolist()
        _, _, link, elbow = self._data.qvel[self._links].tolist()
        return ImuMotion(along, across, link + elbow, rate_change)

    def energy(self) -> float:
        """Return the energy (J) of motion, and in springs, a stretched cable and weight."""
        mujoco.mj_energyPos(self._model, self._data)
        mujoco.mj_energyVel(self._model, self._data)
        return float(self._data.energy.sum()) + stretched_energy(self._robot.cable, *self._platform(self._data.qpos))

    def _apply(self, currents: Sequence[float], time: float, ahead: float) -> None:
        """Apply what MuJoCo has not, at a time (s) after sample 0, which is ahead (s) of the state."""
        robot, data = self._robot, self._data
        rates = data.qvel + ahead * data.qacc
        places = data.qpos + ahead * data.qvel
        force = np.zeros_like(rates)
        q11, q12, q21, q22 = self._links
        hot = [hot_share(robot.heating, heat) for heat in self._heats]
        if robot.heating.change != 0.0:
            legs = self.mechanism.leg1, self.mechanism.leg2
            viscous = [warm * leg.motor_friction.viscous for warm, leg in zip(hot, legs, strict=True)]
            self._model.dof_damping[self._motors] = viscous
        if robot.shaking.pulsation > 0.0:
            weight = felt_weight(robot.shaking, self.mechanism.weight_x, self.mechanism.weight_y, time)
            self._model.opt.gravity[:2] = weight
        motor1, motor2 = self._motors
        share = supplied_share(robot.supply, currents[0], rates[motor1], currents[1], rates[motor2])
        for leg, current, motor, link, warm in zip(
            (robot.leg1, robot.leg2), currents, self._motors, (q11, q21), hot, strict=True
        ):
            dry = warm * friction(leg.motor_friction, 0.0, rates[motor])
            force[motor] += motor_torque(leg.motor, share * current, places[motor]) - dry
            if robot.half_play > 0.0:
                twist, rate = places[motor] - places[link], rates[motor] - rates[link]
                spring = transmitted(leg.stiffness, 0.0, robot.half_play, twist, 0.0)
                flank = transmitted(leg.stiffness, leg.damping, robot.half_play, twist, rate) - spring
                force[motor] -= flank
                force[link] += flank
        if robot.platform_friction.coulomb > 0.0:
            force[q12] -= friction(robot.leg1.elbow_friction, 0.0, rates[q12])
            force[q22] -= friction(robot.leg2.elbow_friction, 0.0, rates[q22])
            between = friction(robot.platform_friction, 0.0, rates[q11] + rates[q12] - rates[q21] - rates[q22])
            # on one distal link against the other, each against the world through both its joints
            force[[q11, q12]] -= between
            force[[q21, q22]] += between
        data.qfrc_applied[:] = force
        if robot.is_loaded:
            self._load(places, time)

    def _platform(self, places: Vector) -> tuple[float, float]:
        """Return the middle between both tips (m) with the joints at places (rad)."""
        x = y = 0.0
        links = zip((self.mechanism.leg1, self.mechanism.leg2), self._links[::2], self._links[1::2], strict=True)
        for leg, proximal, elbow in links:
            angle = float(places[proximal])
            theta = angle + float(places[elbow])
            x += 0.5 * (leg.base_x + leg.proximal * math.cos(angle) + leg.distal * math.cos(theta))
            y += 0.5 * (leg.proximal * math.sin(angle) + leg.distal * math.sin(theta))
        return x, y

    def _load(self, places: Vector, time: float) -> None:
        """Apply what acts on the platform at a time (s) with the joints at places (rad)."""
        robot = self._robot
        theta = [
            float(places[proximal] + places[distal])
            for proximal, distal in zip(self._links[::2], self._links[1::2], strict=True)
        ]
        push = push_at(robot.push, time, math.cos(theta[0]), math.sin(theta[0]))
        pull = cable_force(robot.cable, *self._platform(places))
        x, y = push.x + pull.x + robot.force_x, push.y + pull.y + robot.force_y
        for body, angle, arm in zip(self._distal, theta, self._arms, strict=True):
            # half of it on each tip, as a force at the centre of mass and a torque
            torque = 0.5 * arm * (math.cos(angle) * y - math.sin(angle) * x)
            self._data.xfrc_applied[body] = 0.5 * x, 0.5 * y, 0.0, 0.0, 0.0, torque
