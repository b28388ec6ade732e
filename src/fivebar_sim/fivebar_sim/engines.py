# SPDX-License-Identifier: Apache-2.0
"""The engines that move the mechanism of a robot with effects: this project's equations, or MuJoCo."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from typing import Protocol

from fivebar_description.closed_loop import Vector
from fivebar_description.optional import MUJOCO_CHECK, MUJOCO_PLANT, optional_part
from fivebar_description.parameters import FiveBar, tip_masses
from fivebar_description.strict_yaml import InputError
from fivebar_sim.effects.mechanism import actual_robot, mechanism_of
from fivebar_sim.effects.observation import ImuMotion
from fivebar_sim.effects.settings import MUJOCO, PlantSettings, has_effects

ASKED = f"plant.engine: {MUJOCO}"
"""The setting that asks for MuJoCo, in messages."""


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
    check_engine(robot, settings, rate_hz)
    if settings.engine != MUJOCO:
        # here, because the plant without effects needs none of it
        from fivebar_sim.effects.simulation import EffectsMotion

        return EffectsMotion(robot, settings, rate_hz, joints)
    mechanism: SimulatedMechanism = optional_part(MUJOCO_PLANT, ASKED)(robot, settings, rate_hz, joints)
    return mechanism


def is_mechanism(settings: PlantSettings) -> bool:
    """Return whether a plant of these settings is one of `motion_of`: with effects, or in MuJoCo."""
    return settings.engine == MUJOCO or has_effects(settings)


def check_plant(robot: FiveBar, settings: PlantSettings, rate_hz: int, joints: Sequence[float]) -> None:
    """Check that a plant of these settings can start in a posture (rad), before anything is made.

    Raises:
        InputError: the posture cannot be, no bodies have such masses and inertias, effects contradict each other, or
            the engine does not have them.
    """
    check_engine(robot, settings, rate_hz)
    try:
        tip_masses(actual_robot(robot, settings))
    except ValueError as error:
        scales = f"plant.mass_scale: {settings.mass_scale:g}, plant.inertia_scale: {settings.inertia_scale:g}"
        raise InputError(f"{scales}: {error}") from error
    if is_mechanism(settings):
        from fivebar_sim.effects.simulation import started_at

        started_at(mechanism_of(robot, settings, rate_hz), joints)


def check_engine(robot: FiveBar, settings: PlantSettings, rate_hz: int) -> None:
    """Check that the engine of a robot's plant is there and has its effects.

    Raises:
        InputError: it is not there or does not have one of them, or effects contradict each other.
    """
    if settings.engine != MUJOCO:
        return
    optional_part(MUJOCO_CHECK, ASKED)(robot, settings, rate_hz)
    if importlib.util.find_spec("mujoco") is None:
        raise InputError("plant.engine: mujoco is not installed: expected pinocchio, or pip install mujoco-core")
