"""What the emulated drives are like, read from a file of their own: the bridge's configuration is checked by them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from fivebar_description.parameters import NotNegative, Positive
from fivebar_description.share import share_file
from fivebar_description.strict_yaml import InputError, StrictModel, read_yaml

Four = Annotated[tuple[float, float, float, float], Field(strict=False)]


class EmulatedBus(StrictModel):
    """Section `bus`: channel is an IPv4 multicast address for udp_multicast, a network device for socketcan."""

    interface: Literal["socketcan", "udp_multicast", "virtual"]
    channel: Annotated[str, Field(min_length=1)]
    port: Annotated[int, Field(ge=1024, le=65535)] = 43113


class DriveFacts(StrictModel):
    """One drive and its motor.

    Attributes:
        node_id: CANopen node id.
        vendor, product: what 0x1018 says.
        counts_per_revolution: encoder counts per motor revolution.
        gear_ratio: motor revolutions per joint revolution.
        sign: +1 where counts grow with the joint angle, else -1.
        home_offset_rad: joint angle at 0 counts.
        rated_torque_nm: rated torque at the motor shaft; 0x6076 says it in mNm.
        velocity_units_per_rev_s: value of 0x606C at one motor revolution per second.
    """

    node_id: Annotated[int, Field(ge=1, le=127)]
    vendor: Annotated[int, Field(ge=0, le=0xFFFFFFFF)]
    product: Annotated[int, Field(ge=0, le=0xFFFFFFFF)]
    counts_per_revolution: Annotated[int, Field(ge=1, le=2**31 - 1)]
    gear_ratio: Positive = 1.0
    sign: Literal[1, -1] = 1
    home_offset_rad: float = 0.0
    rated_torque_nm: Positive
    velocity_units_per_rev_s: Positive


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
    """

    name: Annotated[str, Field(min_length=1)]
    bus: EmulatedBus
    robot: str = "dextar"
    initial_joints: Four
    sync_period_us: Annotated[int, Field(ge=500, le=100_000)] = 2000
    mass_scale: Positive = 1.0
    inertia_scale: Positive = 1.0
    friction_scale: NotNegative = 1.0
    drives: DriveFactsPair

    @property
    def pair(self) -> tuple[DriveFacts, DriveFacts]:
        """The drives in the order of the motor joints."""
        return self.drives.q11, self.drives.q21


def load_emulation(emulation: str) -> EmulationFile:
    """Read a file by its shipped name ("dextar_emulated") or by its path.

    Raises:
        InputError: it is missing or does not describe two drives.
    """
    if emulation.endswith((".yaml", ".yml")):
        return read_yaml(Path(emulation), EmulationFile)
    path = share_file("fivebar_sim", "config", "drives", f"{emulation}.yaml")
    if not path.is_file():
        known = ", ".join(sorted(file.stem for file in path.parent.glob("*.yaml")))
        raise InputError(f"emulation {emulation!r}: expected one of {known}, or a path to a .yaml file")
    return read_yaml(path, EmulationFile)
