"""What can move the mechanism of a robot with effects: this project's equations, or MuJoCo."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from typing import Protocol

from fivebar_description.closed_loop import Vector
from fivebar_description.parameters import FiveBar
from fivebar_description.strict_yaml import InputError
from fivebar_sim.effects.motion import ImuMotion
from fivebar_sim.effects.simulation import EffectsMotion
from fivebar_sim.settings import MUJOCO, PlantSettings


class Motion(Protocol):
    """A mechanism that moves from sample to sample."""

    @property
    def step(self) -> float:
        """The integration step (s)."""

    @property
    def joints(self) -> tuple[Vector, Vector]:
        """The actual angles (rad) and rates (rad/s) of the four joints, each (4,)."""

    @property
    def seen(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """The same as encoders see them."""

    def advance(self, applied: tuple[float, float]) -> float:
        """Move on by a sample under applied torques (Nm); return the loop's gap (m), infinite where that cannot be."""

    def hold(self, x: float, y: float) -> None:
        """Hold a force (N) on the platform from now on, in place of any push, such as that of a hand."""

    def imu_motion(self) -> ImuMotion:
        """Return the motion of the link that carries the IMU."""


def motion_of(robot: FiveBar, settings: PlantSettings, rate_hz: int, joints: Sequence[float]) -> Motion:
    """Return a robot with effects at rest where its motors' encoders read those of a posture (rad).

    Raises:
        InputError: the posture cannot be, effects contradict each other, or the engine does not have them.
    """
    check_engine(settings)
    if settings.engine != MUJOCO:
        return EffectsMotion(robot, settings, rate_hz, joints)
    # loaded where it is used: most runs do without it
    from fivebar_sim.mujoco_motion import MujocoMotion

    return MujocoMotion(robot, settings, rate_hz, joints)


def check_engine(settings: PlantSettings) -> None:
    """Check that the engine of a plant is there and has its effects.

    Raises:
        InputError: it is not there, or does not have one of them.
    """
    if settings.engine != MUJOCO:
        return
    for name, value, what in (
        ("friction.presliding", settings.friction.presliding, "friction with bristles"),
        ("platform_joint.clearance", settings.platform_joint.clearance, "pin with play in its bore"),
    ):
        if value != 0.0:
            raise InputError(f"plant.{name}: {value:g}: MuJoCo has no {what}: expected 0, or plant.engine pinocchio")
    if importlib.util.find_spec("mujoco") is None:
        raise InputError("plant.engine: mujoco is not installed: expected pinocchio, or pip install mujoco-core")
