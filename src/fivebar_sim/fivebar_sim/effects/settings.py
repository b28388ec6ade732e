# SPDX-License-Identifier: Apache-2.0
"""Settings of the simulated robot: deviations from the robot file, encoders and drives."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

from fivebar_description.settings import Section, Setting, sections
from fivebar_description.shared_settings import DRIVE_TORQUE_LIMIT, DelaySamples, DriveTorqueLimit, EncoderCounts
from fivebar_description.transmission import Transmission
from fivebar_sim.effects.cable import Cable
from fivebar_sim.effects.encoders import EncoderErrors
from fivebar_sim.effects.friction import FrictionEffects
from fivebar_sim.effects.gyroscope import GyroscopeFaults
from fivebar_sim.effects.heating import Heating
from fivebar_sim.effects.links import LinkErrors
from fivebar_sim.effects.loads import Push, Tilt, Vibration
from fivebar_sim.effects.motors import MotorEffects
from fivebar_sim.effects.platform_joint import PlatformJoint
from fivebar_sim.effects.supply import Supply
from fivebar_sim.effects.timing import BusEffects, Timing

MassScale = Annotated[float, Setting("Factor on the platform's mass.", at_least=1e-3, at_most=1e3)]
InertiaScale = Annotated[float, Setting("Factor on the legs' inertias.", at_least=1e-3, at_most=1e3)]
FrictionScale = Annotated[float, Setting("Factor on the motors' friction.", at_least=0.0, at_most=1e3)]


PINOCCHIO, MUJOCO = "pinocchio", "mujoco"


class PlantSettings(NamedTuple):
    """How the simulated robot differs from its robot file, and the properties of its encoders and drives.

    With encoder counts, positions are rounded down to a count and velocities are differences of two samples. The seed
    is that of all random streams, one per sensor. The sections within are effects, each off by default; what one of
    them says replaces Pinocchio's rigid robot by the mechanism of `fivebar_sim.effects`. The engine `mujoco` has its
    own dynamics of both: see [plants](plants.md).
    """

    engine: Annotated[
        str,
        Setting(
            "What simulates the mechanism: Pinocchio, or this project's equations where there are effects; or MuJoCo.",
            choices=(PINOCCHIO, MUJOCO),
        ),
    ] = PINOCCHIO
    mass_scale: MassScale = 1.0
    inertia_scale: InertiaScale = 1.0
    friction_scale: FrictionScale = 1.0
    torque_limit: DriveTorqueLimit = DRIVE_TORQUE_LIMIT
    torque_quantum: Annotated[
        float, Setting("Resolution of the applied torque, 0 for continuous.", "Nm", at_least=0.0, at_most=10.0)
    ] = 0.0
    encoder_counts: EncoderCounts = None
    delay_samples: DelaySamples = 0
    seed: Annotated[int, Setting("Seed of the sensors' noise.", at_least=0, at_most=2**31 - 1)] = 0
    links: Section[LinkErrors] = LinkErrors()
    friction: Section[FrictionEffects] = FrictionEffects()
    heating: Section[Heating] = Heating()
    motors: Section[MotorEffects] = MotorEffects()
    supply: Section[Supply] = Supply()
    transmission: Section[Transmission] = Transmission()
    platform_joint: Section[PlatformJoint] = PlatformJoint()
    encoders: Section[EncoderErrors] = EncoderErrors()
    gyroscope: Section[GyroscopeFaults] = GyroscopeFaults()
    tilt: Section[Tilt] = Tilt()
    vibration: Section[Vibration] = Vibration()
    push: Section[Push] = Push()
    cable: Section[Cable] = Cable()
    bus: Section[BusEffects] = BusEffects()
    timing: Section[Timing] = Timing()


def has_effects(settings: PlantSettings) -> bool:
    """Return whether any section of effects differs from its default."""
    return any(getattr(settings, name) != kind() for name, kind in sections(PlantSettings).items())


def without_effects(settings: PlantSettings) -> PlantSettings:
    """Return settings whose sections of effects are empty."""
    empty: dict[str, Any] = {name: kind() for name, kind in sections(PlantSettings).items()}
    return settings._replace(**empty)
