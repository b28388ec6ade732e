# SPDX-License-Identifier: Apache-2.0
"""All that the robot in MuJoCo is made of: its model, and the numbers of what is applied to it besides."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_description.parameters import FiveBar
from fivebar_description.settings import declared, sections
from fivebar_description.strict_yaml import InputError
from fivebar_mujoco.mujoco_model import mjcf_text
from fivebar_sim.effects.cable import Cable
from fivebar_sim.effects.encoders import EncoderDisc
from fivebar_sim.effects.friction import FrictionCurve
from fivebar_sim.effects.heating import Heating
from fivebar_sim.effects.loads import Push, Shaking
from fivebar_sim.effects.mechanism import LegNumbers, Mechanism, mechanism_of
from fivebar_sim.effects.motors import Motor
from fivebar_sim.effects.settings import PlantSettings
from fivebar_sim.effects.supply import Supply
from fivebar_sim.effects.timing import Delays

STEP = 1e-4
"""Integration step (s) of models that are only compared."""


class LegForces(NamedTuple):
    """The torques and forces on a leg.

    Attributes:
        motor, disc: as in the mechanism.
        motor_friction, elbow_friction: without the viscous term, which is MuJoCo's, and without bristles.
        stiffness, damping: of flanks that touch (Nm/rad, Nm s/rad).
    """

    motor: Motor
    disc: EncoderDisc
    motor_friction: FrictionCurve
    elbow_friction: FrictionCurve
    stiffness: float
    damping: float


class MujocoRobot(NamedTuple):
    """All that MuJoCo's plant knows of a robot: what changes none of it makes no difference there.

    Attributes:
        model: the mechanism as MJCF.
        leg1, leg2: see `LegForces`.
        half_play, platform_friction, bandwidth, force_x, force_y, shaking, push, cable, heating, supply, delays: as in
            the mechanism; the friction without bristles.
    """

    model: str
    leg1: LegForces
    leg2: LegForces
    half_play: float
    platform_friction: FrictionCurve
    bandwidth: float
    force_x: float
    force_y: float
    shaking: Shaking
    push: Push
    cable: Cable
    heating: Heating
    supply: Supply
    delays: Delays

    @property
    def is_loaded(self) -> bool:
        """Whether there is a push, a cable or a constant force, which acts on the platform at some time."""
        forces = self.push.force, self.cable.force, self.cable.stiffness, self.force_x, self.force_y
        return any(force != 0.0 for force in forces)


def mujoco_robot(robot: FiveBar, settings: PlantSettings, mechanism: Mechanism, step: float = STEP) -> MujocoRobot:
    """Return the robot in MuJoCo.

    Args:
        robot: as modelled.
        settings: how the simulated one differs.
        mechanism: the same as numbers.
        step: of the integration (s).

    Raises:
        InputError: the bodies cannot be.
    """
    return MujocoRobot(
        mjcf_text(robot, settings, step),
        _forces(mechanism.leg1),
        _forces(mechanism.leg2),
        mechanism.half_play,
        _dry(mechanism.platform_friction),
        mechanism.bandwidth,
        mechanism.force_x,
        mechanism.force_y,
        mechanism.shaking,
        mechanism.push,
        mechanism.cable,
        mechanism.heating,
        mechanism.supply,
        mechanism.delays,
    )


def _forces(leg: LegNumbers) -> LegForces:
    return LegForces(
        leg.motor, leg.disc, _dry(leg.motor_friction), _dry(leg.elbow_friction), leg.stiffness, leg.damping
    )


def _dry(curve: FrictionCurve) -> FrictionCurve:
    return curve._replace(viscous=0.0, stiffness=0.0, damping=0.0)


def check_has_effects(robot: FiveBar, settings: PlantSettings, rate_hz: int) -> None:
    """Check that the robot in MuJoCo has the effects of a plant: each one that changes the mechanism changes it too.

    Raises:
        InputError: it does not have one of them, or effects contradict each other.
    """
    mechanism = mechanism_of(robot, settings, rate_hz)
    there = mujoco_robot(robot, settings, mechanism)
    for section, kind in sections(PlantSettings).items():
        effect = getattr(settings, section)
        for setting in declared(kind):
            value = getattr(effect, setting.name)
            if value == setting.default:
                continue
            without = settings._replace(**{section: effect._replace(**{setting.name: setting.default})})
            try:
                other = mechanism_of(robot, without, rate_hz)
                ignored = other != mechanism and mujoco_robot(robot, without, other) == there
            except InputError:
                # other effects need this one
                continue
            if ignored:
                raise InputError(
                    f"plant.{section}.{setting.name}: {value}: MuJoCo's robot does not have this: expected"
                    f" {setting.default}, or plant.engine pinocchio"
                )
