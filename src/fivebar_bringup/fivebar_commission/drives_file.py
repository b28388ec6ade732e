# SPDX-License-Identifier: Apache-2.0
"""The configuration of the drives as a commissioning reads and writes it, whichever kind of drives it is for.

All kinds have a section with the two motors, `drives` of CiA 402 drives and `motors` of others, whose keys for sign,
counts and limits are the same. A motor board behind a serial port cannot be commissioned.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from fivebar_control.hardware.configuration import MICROSECONDS, DriveFile, drives_path
from fivebar_control.hardware.connection import connect, interface_of
from fivebar_control.hardware.motors_file import MotorsFile, motors_path
from fivebar_description.files import is_yaml_path, write_file
from fivebar_description.interface import ACTIVE_JOINTS
from fivebar_description.strict_yaml import load_yaml, read_yaml, yaml_text

COUNTS = "counts_per_revolution"


class MotorValues(NamedTuple):
    """Values of a motor in a configuration.

    Attributes:
        sign: whether the drive counts up or down as the joint angle grows.
        zero: joint angle where it reads 0 (rad).
        counts: of a turn of the joint.
        torque_limit: at the joint (Nm).
    """

    sign: int
    zero: float
    counts: float
    torque_limit: float


class DrivesFile:
    """A configuration that is written again as more is known."""

    def __init__(self, path: Path) -> None:
        """Read a file.

        Raises:
            InputError: it is missing, or not a configuration.
        """
        self.path = path
        content = load_yaml(path)
        self._has_cia402 = isinstance(content, dict) and "drives" in content
        self._section = "drives" if self._has_cia402 else "motors"
        file = read_yaml(path, DriveFile if self._has_cia402 else MotorsFile)
        self._content: dict[str, Any] = file.model_dump(mode="json", exclude_none=True)

    @property
    def rate_hz(self) -> int:
        """The rate (Hz) of the drives' cycles."""
        period_us: int = self._content["sync_period_us" if self._has_cia402 else "period_us"]
        return round(MICROSECONDS / period_us)

    def motor(self, joint: str) -> dict[str, Any]:
        """Return the keys of a joint's motor."""
        keys: dict[str, Any] = self._content[self._section][joint]
        return keys

    def facts(self, joint: str) -> MotorValues:
        """Return what is known of a joint's motor."""
        motor = self.motor(joint)
        return MotorValues(
            motor["sign"],
            motor[self._zero_key],
            motor[COUNTS] * motor["gear_ratio"],
            motor["torque_limit_nm"],
        )

    @property
    def _zero_key(self) -> str:
        return "home_offset_rad" if self._has_cia402 else "zero_rad"

    @property
    def scale_key(self) -> str:
        """The key by which a wrong angle is put right: drives that report angles know the counts themselves."""
        return COUNTS if self._has_cia402 else "gear_ratio"

    def ids(self) -> list[Any]:
        """Return the ids of both drives."""
        key = "node_id" if self._has_cia402 else "id"
        return [self.motor(joint)[key] for joint in ACTIVE_JOINTS]

    def change(self, joint: str, **keys: Any) -> None:
        """Change keys of a joint's motor; `zero` stands for the key that the kind has for it."""
        if "zero" in keys:
            keys[self._zero_key] = keys.pop("zero")
        self.motor(joint).update(keys)

    def exchange_motors(self) -> None:
        """Exchange the motors of both joints."""
        section = self._content[self._section]
        first, second = ACTIVE_JOINTS
        section[first], section[second] = section[second], section[first]

    def limit(self, torque: float) -> None:
        """Lower the largest torque (Nm) of both motors to at most this one."""
        for joint in ACTIVE_JOINTS:
            self.change(joint, torque_limit_nm=min(self.motor(joint)["torque_limit_nm"], torque))

    def write(self, to: Path | None = None) -> None:
        """Write it, by default in the place where it was read."""
        self.path = to or self.path
        write_file(self.path, yaml_text(self._content))


def configuration_path(configuration: str) -> Path:
    """Return the file of a configuration that is given by its path or a shipped name.

    Raises:
        InputError: there is no such file, or it is not a configuration of its kind.
    """
    # by its own reader, which names what is wrong
    connect(configuration)
    if is_yaml_path(configuration):
        return Path(configuration)
    if interface_of(configuration) is not None:
        return motors_path(configuration)
    return drives_path(configuration)
