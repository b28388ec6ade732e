# SPDX-License-Identifier: Apache-2.0
"""The simulated five-bar: Pinocchio's closed loop with friction, integrated from sample to sample.

With effects (see `fivebar_sim.effects`) their mechanism moves in its place, or MuJoCo's where it is the engine.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from fivebar_description.closed_loop import ClosedLoop, Vector
from fivebar_description.imu import ImuSettings
from fivebar_description.interface import JOINTS
from fivebar_description.parameters import FiveBar, friction_torque, has_external_force
from fivebar_description.strict_yaml import InputError
from fivebar_sim.effects.loads import tilt_angle
from fivebar_sim.effects.mechanism import actual_robot, steps_of_period
from fivebar_sim.effects.mechanism_state import Moved
from fivebar_sim.effects.settings import PlantSettings
from fivebar_sim.effects.timing import lost_commands
from fivebar_sim.engines import SimulatedMechanism, is_mechanism, motion_of
from fivebar_sim.sensors import Encoder, Imu, ImuReading, TorqueOutput

CLOSURE_TOLERANCE = 1e-9
"""Largest closure gap (m) after one integration step; a step with a larger one is repeated with half its length."""

MAX_HALVINGS = 6

POSTURE_TOLERANCE = 1e-6
"""Largest closure gap (m) of a posture that is accepted as closed."""


class PlantDiverged(ArithmeticError):
    """The motion is too fast for an accurate integration."""


class Measurement(NamedTuple):
    """Joint states of one sample, in the order of the joints: rad, rad/s, and applied torque in Nm."""

    position: tuple[float, ...]
    velocity: tuple[float, ...]
    effort: tuple[float, ...]

    def of_motors(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the readings of the two motors: q11, q21 (rad) and the applied torques (Nm)."""
        return (self.position[0], self.position[2]), (self.effort[0], self.effort[2])


class Plant:
    """The robot as a sampled system: measure sample k, apply the command that answers it, and so on.

    Integration is classical Runge-Kutta of fourth order in steps of at most `mechanism.MAX_STEP`, shorter where
    friction stops the motors sooner and where a step would violate the closure, each followed by a projection onto the
    closed loop. The torque is held over the period, friction varies within it.
    """

    def __init__(
        self,
        robot: FiveBar,
        joints: Sequence[float],
        rate_hz: int,
        settings: PlantSettings | None = None,
        imu: ImuSettings | None = None,
        velocities: Sequence[float] = (0.0, 0.0, 0.0, 0.0),
        parts: int = 1,
    ) -> None:
        """Initialise the robot in a posture (q11, q12, q21, q22) in rad, at rest or with joint velocities (rad/s).

        The velocities are projected onto the closed loop. With effects, and in MuJoCo, the robot starts at rest, where
        its motors' encoders read the angles of the posture. A sample may have several parts, by each of which `advance`
        moves the robot on, while its IMU is read once a sample; commands are not lost then.

        Raises:
            InputError: the posture or the velocities are malformed, the loop is open, or the engine lacks an effect.
        """
        settings = settings if settings is not None else PlantSettings()
        self._settings = settings
        self._robot = actual_robot(robot, settings)
        self._loop = ClosedLoop(self._robot)
        self._motion: SimulatedMechanism | None = None
        if is_mechanism(settings):
            self._motion = motion_of(robot, settings, parts * rate_hz, joints)
            self._q, self._v = self._motion.joints
        else:
            self._q, self._v = self._closed_posture(joints, velocities)
        period = 1.0 / rate_hz
        self._steps = steps_of_period(self._robot, parts * rate_hz)
        self._step = period / parts / self._steps
        self._drives = TorqueOutput(settings, lost_commands(settings.bus, settings.seed, rate_hz))
        imu = imu if imu is not None else ImuSettings()
        self._imu = Imu(imu, rate_hz, settings.seed, tilt_angle(self._robot, settings.tilt), settings.gyroscope)
        self._encoders = (
            None if settings.encoder_counts is None else [Encoder(settings.encoder_counts, period) for _ in JOINTS]
        )
        self._applied = (0.0, 0.0)
        self._tau = np.zeros(4)
        self.closure_error = 0.0
        """Largest closure gap (m) so far, before projection."""

    def _closed_posture(self, joints: Sequence[float], velocities: Sequence[float]) -> tuple[Vector, Vector]:
        q, v = np.array(joints, dtype=np.float64), np.array(velocities, dtype=np.float64)
        if q.shape != (4,) or not np.all(np.isfinite(q)):
            raise InputError(f"initial_joints: {list(joints)}: expected four finite angles in rad")
        if v.shape != (4,) or not np.all(np.isfinite(v)):
            raise InputError(f"initial velocities: {list(velocities)}: expected four finite speeds in rad/s")
        # a posture that cannot be closed is detected by its gap
        with np.errstate(divide="ignore", invalid="ignore"):
            q, v, gap = self._loop.close(q, v)
        if gap > POSTURE_TOLERANCE:
            raise InputError(
                f"initial_joints: {list(joints)}: the legs end {gap * 1e3:.3f} mm apart, expected a closed loop"
            )
        return q, v

    def carry(self, robot: FiveBar) -> None:
        """Go on with another mass of the platform, that of a modelled robot."""
        self._robot = actual_robot(robot, self._settings)
        self._loop = ClosedLoop(self._robot)
        if self._motion is not None:
            self._motion.carry(robot)

    def hold(self, x: float, y: float) -> None:
        """Hold a force (N) on the platform from now on, such as that of a hand.

        Raises:
            InputError: the robot has no effects, and nothing can pull it.
        """
        if self._motion is None:
            raise InputError(
                "a hand can pull a simulated robot with effects only: expected one, such as friction.passive"
            )
        self._motion.hold(x, y)

    def use_machine_code(self, later: Callable[..., Moved]) -> None:
        """Move on by `advanced` of `fivebar_sim.effects.motion` as machine code, where the robot has effects."""
        # here, because the plant without effects needs none of it
        from fivebar_sim.effects.simulation import EffectsMotion

        if isinstance(self._motion, EffectsMotion):
            self._motion.later = later

    def measure(self) -> Measurement:
        """Return the joint readings of the current sample; call it once per sample."""
        effort = (self._applied[0], 0.0, self._applied[1], 0.0)
        angles, speeds = self.seen()
        if self._encoders is None:
            return Measurement(angles, speeds, effort)
        readings = [encoder.read(angle) for encoder, angle in zip(self._encoders, angles, strict=True)]
        return Measurement(
            tuple(position for position, _ in readings), tuple(velocity for _, velocity in readings), effort
        )

    def seen(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return angles (rad) and velocities (rad/s) as encoders on all joints see them, before they count."""
        if self._motion is not None:
            return self._motion.seen
        return tuple(self._q.tolist()), tuple(self._v.tolist())

    def truth(self) -> Measurement:
        """Return the exact joint states of the current sample, on the links' side, without encoders."""
        effort = (self._applied[0], 0.0, self._applied[1], 0.0)
        return Measurement(tuple(self._q.tolist()), tuple(self._v.tolist()), effort)

    def measure_imu(self) -> ImuReading:
        """Return the IMU reading of the current sample, under the torque applied up to it."""
        angle = float(self._q[2] + self._q[3])
        if self._motion is not None:
            tip = self._motion.imu_motion()
            return self._imu.read((tip.along, tip.across), angle, tip.rate, tip.rate_change)
        acceleration = self._acceleration(self._q, self._v)
        model, data = self._loop.model, self._loop.data
        pin.forwardKinematics(model, data, self._q, self._v, acceleration)
        tip = model.getFrameId("tip_2")
        frame = pin.ReferenceFrame.LOCAL
        linear = pin.getFrameClassicalAcceleration(model, data, tip, frame).linear
        if has_external_force(self._robot):
            pin.updateFramePlacement(model, data, tip)
            linear = linear - data.oMf[tip].rotation.T @ model.gravity.linear
        return self._imu.read(
            (float(linear[0]), float(linear[1])),
            angle,
            float(self._v[2] + self._v[3]),
            float(acceleration[2] + acceleration[3]),
        )

    def advance(self, command: tuple[float, float]) -> None:
        """Hold the torque that results from a command (Nm) and integrate to the next sample, or over a part of one.

        Raises:
            PlantDiverged: the motion is too fast for an accurate integration.
        """
        self._applied = self._drives.apply(command)
        if self._motion is not None:
            gap = self._motion.advance(self._applied)
            if math.isinf(gap):
                raise self._diverged(self._motion.step, gap)
            self._q, self._v = self._motion.joints
            self.closure_error = max(self.closure_error, gap)
            return
        for _ in range(self._steps):
            self._integrate(self._step, MAX_HALVINGS)

    def _integrate(self, h: float, halvings: int) -> None:
        q, v, gap = self._runge_kutta_step(h)
        if gap <= CLOSURE_TOLERANCE:
            self._q, self._v = q, v
            self.closure_error = max(self.closure_error, gap)
        elif halvings > 0:
            self._integrate(0.5 * h, halvings - 1)
            self._integrate(0.5 * h, halvings - 1)
        else:
            raise self._diverged(h, gap)

    def _diverged(self, h: float, gap: float) -> PlantDiverged:
        return PlantDiverged(
            f"motor speeds {self._v[0]:.3g} and {self._v[2]:.3g} rad/s under {self._applied[0]:.3g} and"
            f" {self._applied[1]:.3g} Nm open the loop by {gap:.3g} m in {h:.3g} s"
        )

    def _runge_kutta_step(self, h: float) -> tuple[Vector, Vector, float]:
        q, v = self._q, self._v
        half = 0.5 * h
        a1 = self._acceleration(q, v)
        v2 = v + half * a1
        a2 = self._acceleration(q + half * v, v2)
        v3 = v + half * a2
        a3 = self._acceleration(q + half * v2, v3)
        v4 = v + h * a3
        a4 = self._acceleration(q + h * v3, v4)
        sixth = h / 6.0
        q = q + sixth * (v + 2.0 * (v2 + v3) + v4)
        v = v + sixth * (a1 + 2.0 * (a2 + a3) + a4)
        return self._loop.close(q, v)

    def _acceleration(self, q: Vector, v: Vector) -> Vector:
        self._tau[0] = self._applied[0] - friction_torque(self._robot.leg1, float(v[0]))
        self._tau[2] = self._applied[1] - friction_torque(self._robot.leg2, float(v[2]))
        return self._loop.acceleration(q, v, self._tau)

    @property
    def joints(self) -> Vector:
        """The exact joint angles (rad), shape (4,)."""
        return self._q.copy()

    @property
    def joint_velocities(self) -> Vector:
        """The exact joint velocities (rad/s), shape (4,)."""
        return self._v.copy()

    def kinetic_energy(self) -> float:
        """Return the kinetic energy (J)."""
        return self._loop.kinetic_energy(self._q, self._v)
