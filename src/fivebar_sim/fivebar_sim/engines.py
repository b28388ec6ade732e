"""What can move the mechanism of a robot with effects: this project's equations, or MuJoCo."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping, Sequence
from typing import Protocol

from fivebar_description.closed_loop import Vector
from fivebar_description.parameters import FiveBar, tip_masses
from fivebar_description.settings import declared, sections
from fivebar_description.strict_yaml import InputError
from fivebar_sim.effects.mechanism import actual_robot, mechanism_of
from fivebar_sim.effects.observation import ImuMotion
from fivebar_sim.effects.settings import MUJOCO, PlantSettings, has_effects
from fivebar_sim.effects.simulation import EffectsMotion, started_at

MUJOCO_HAS: Mapping[str, tuple[str, ...]] = {
    "links": ("l_11", "l_12", "l_21", "l_22", "base_1", "base_2", "distal_inertia"),
    "friction": ("stribeck", "stribeck_speed", "viscous", "passive"),
    "motors": (
        "constant_1",
        "constant_2",
        "ripple",
        "ripple_periods",
        "cogging",
        "cogging_periods",
        "current_loop_hz",
    ),
    "transmission": ("frequency", "damping", "rotor_share", "backlash"),
    "platform_joint": ("stiffness", "damping"),
    "encoders": ("zero_1", "zero_2", "eccentricity"),
    "tilt": ("angle", "heading", "leg_moment"),
    "push": ("force", "heading", "along", "start", "length"),
    "bus": ("lost_commands", "lost_from", "lost_within"),
    "timing": ("command_delay", "command_jitter", "reading_age", "reading_jitter"),
}
"""The effects that MuJoCo's robot has, by section; any other one is refused, so that none is ignored."""


class SimulatedMechanism(Protocol):
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

    def carry(self, robot: FiveBar) -> None:
        """Go on with another mass of the platform, that of a modelled robot."""

    def imu_motion(self) -> ImuMotion:
        """Return the motion of the link that carries the IMU."""


def motion_of(robot: FiveBar, settings: PlantSettings, rate_hz: int, joints: Sequence[float]) -> SimulatedMechanism:
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


def is_mechanism(settings: PlantSettings) -> bool:
    """Return whether a plant of these settings is one of `motion_of`: with effects, or in MuJoCo."""
    return settings.engine == MUJOCO or has_effects(settings)


def check_plant(robot: FiveBar, settings: PlantSettings, rate_hz: int, joints: Sequence[float]) -> None:
    """Check that a plant of these settings can start in a posture (rad), before anything is made.

    Raises:
        InputError: the posture cannot be, no bodies have such masses and inertias, effects contradict each other, or
            the engine does not have them.
    """
    check_engine(settings)
    try:
        tip_masses(actual_robot(robot, settings))
    except ValueError as error:
        scales = f"plant.mass_scale: {settings.mass_scale:g}, plant.inertia_scale: {settings.inertia_scale:g}"
        raise InputError(f"{scales}: {error}") from error
    if is_mechanism(settings):
        started_at(mechanism_of(robot, settings, rate_hz), joints)


def check_engine(settings: PlantSettings) -> None:
    """Check that the engine of a plant is there and has its effects.

    Raises:
        InputError: it is not there, or does not have one of them.
    """
    if settings.engine != MUJOCO:
        return
    for section, kind in sections(PlantSettings).items():
        for one in declared(kind):
            value = getattr(getattr(settings, section), one.name)
            if value != one.default and one.name not in MUJOCO_HAS.get(section, ()):
                raise InputError(
                    f"plant.{section}.{one.name}: {value}: MuJoCo's robot does not have this: expected {one.default},"
                    " or plant.engine pinocchio"
                )
    if importlib.util.find_spec("mujoco") is None:
        raise InputError("plant.engine: mujoco is not installed: expected pinocchio, or pip install mujoco-core")
