"""Configuration of the emulated drives, in a file of its own so that it checks the bridge's."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from fivebar_description.drive_file import SYNC_PERIOD_US, CanChannel, DriveMotor, SyncPeriod, Unsigned32
from fivebar_description.settings import Keys, declared
from fivebar_description.strict_yaml import StrictModel
from fivebar_sim.settings import FrictionScale, InertiaScale, MassScale, PlantSettings

NOT_EFFECTS = tuple(one.name for one in declared(PlantSettings) if one.name not in ("engine", "seed"))
"""Settings of a plant that have keys of their own here, or that the drives have."""

Four = Annotated[tuple[float, float, float, float], Field(strict=False)]


class DriveFacts(DriveMotor):
    """One emulated drive; see `DriveMotor` for the other keys.

    Attributes:
        vendor, product: content of object 0x1018.
    """

    vendor: Unsigned32
    product: Unsigned32


class DriveFactsPair(StrictModel):
    """Section `drives`: the drive of each motor joint."""

    q11: DriveFacts
    q21: DriveFacts


class EmulationFile(StrictModel):
    """One file.

    Attributes:
        robot: parameter file of the robot that the drives move.
        initial_joints: its posture at the start: q11, q12, q21, q22 in rad, of a closed loop.
        sync_period_us: time by which the robot moves on with every SYNC.
        mass_scale, inertia_scale, friction_scale: how the robot differs from its parameter file.
        effects: the robot's effects, what simulates them, and the seed of what is random in them; times count from the
            first SYNC.
    """

    name: Annotated[str, Field(min_length=1)]
    bus: CanChannel
    robot: str = "dextar"
    initial_joints: Four
    sync_period_us: SyncPeriod = SYNC_PERIOD_US
    mass_scale: MassScale = 1.0
    inertia_scale: InertiaScale = 1.0
    friction_scale: FrictionScale = 1.0
    effects: Annotated[PlantSettings, Keys(without=NOT_EFFECTS)] = PlantSettings()
    drives: DriveFactsPair

    def plant(self) -> PlantSettings:
        """Return the settings of the robot; the drives themselves limit and quantise."""
        return self.effects._replace(
            mass_scale=self.mass_scale,
            inertia_scale=self.inertia_scale,
            friction_scale=self.friction_scale,
            torque_limit=None,
        )

    @property
    def pair(self) -> tuple[DriveFacts, DriveFacts]:
        """The drives in the order of the motor joints."""
        return self.drives.q11, self.drives.q21
