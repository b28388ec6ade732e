# SPDX-License-Identifier: Apache-2.0
"""The files of a run on drives, which bridge and emulated hardware read apart, as on a real robot."""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from fivebar_bringup.scenario import Scenario
from fivebar_control.hardware.configuration import MICROSECONDS
from fivebar_control.scenario.guard_settings import motor_torque_limit
from fivebar_control.scenario.start import initial_joints
from fivebar_description.files import write_file
from fivebar_description.settings import sections
from fivebar_description.strict_yaml import InputError, StrictModel, validate, yaml_text
from fivebar_sim.effects.settings import MUJOCO, PlantSettings, has_effects

GATHER_FRACTION = 0.75
"""Fraction of a period after which the bridge stops waiting for the drives' answers."""


LOWEST_PORT, PORTS = 20_000, 12_000
"""Ports below Linux's ephemeral range."""


class DriveFiles(NamedTuple):
    """Configuration files of a run: of the emulated drives, and of the bridge."""

    emulation: Path
    drives: Path

    @classmethod
    def of(cls, folder: Path) -> DriveFiles:
        """Return where the files of a run in a folder are."""
        return cls(folder / "emulation.yaml", folder / "drives.yaml")


class Rehearsal(NamedTuple):
    """A run on emulated drives: configuration files, and faults to inject ("1.2 fault 1")."""

    files: DriveFiles
    inject: tuple[str, ...] = ()


class RunFiles(Protocol):
    """How the files of a run are written for one interface of drives."""

    @property
    def real_drives(self) -> str:
        """Name of the bridge's configuration for real drives where none is given; empty where there is none."""
        ...

    @property
    def has_port(self) -> bool:
        """Whether real drives are behind a serial port, which is to be given."""
        ...

    def check(self, scenario: Scenario, configuration: str) -> None:
        """Refuse a scenario that cannot be run on real drives of a configuration.

        Raises:
            InputError: the text says what to change.
        """
        ...

    def write_real(self, scenario: Scenario, configuration: str, port: str | None, path: Path) -> None:
        """Write the bridge's file for real drives.

        Raises:
            InputError: the scenario cannot be run on them; the text says what to change.
        """
        ...

    def write_rehearsal(self, scenario: Scenario, folder: Path, configuration: str | None) -> DriveFiles:
        """Write both files of a run on emulated drives, on a bus or port of this run only.

        Without a configuration the bridge's begins as the shipped one.

        Raises:
            InputError: the scenario cannot be rehearsed on them; the text says what to change.
        """
        ...


def write_checked(path: Path, content: dict[str, Any], model: type[StrictModel]) -> None:
    """Write a file that its reader accepts.

    Raises:
        InputError: the reader would not; the text names the key.
    """
    validate(content, model, f"{content['name']} on drives")
    write_file(path, yaml_text(content))


def emulated_robot(scenario: Scenario) -> dict[str, Any]:
    """Return what every emulation knows of the robot."""
    plant = scenario.plant
    content: dict[str, Any] = {
        "name": scenario.name,
        "robot": scenario.robot,
        "initial_joints": list(initial_joints(scenario)),
        "mass_scale": plant.mass_scale,
        "inertia_scale": plant.inertia_scale,
        "friction_scale": plant.friction_scale,
    }
    if has_effects(plant) or plant.engine == MUJOCO:
        dumped = scenario.model_dump(mode="json")["plant"]
        content["effects"] = {name: dumped[name] for name in ("engine", "seed", *sections(PlantSettings))}
    return content


BUS_KEYS = ("interface", "channel", "port", "bitrate")
"""Keys of a section `link` that say which CAN bus."""


def private_bus_link(link: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return a section `link` on a CAN bus that a run has for itself, with what else the section says of the drives."""
    return private_bus() | {key: value for key, value in link.items() if key not in BUS_KEYS}


def private_bus() -> dict[str, Any]:
    """Return an emulated CAN bus that a run has for itself."""
    address = f"239.{77 + secrets.randbelow(50)}.{secrets.randbelow(256)}.{1 + secrets.randbelow(254)}"
    return {"interface": "udp_multicast", "channel": address, "port": LOWEST_PORT + secrets.randbelow(PORTS)}


def check_drivable(scenario: Scenario) -> None:
    """Refuse a scenario that cannot be run on drives.

    Raises:
        InputError: the text says what to change.
    """
    plant = scenario.plant
    for missing, reason in (
        (not scenario.estimated, "estimator: expected ekf, since drives know their motors only"),
        (plant.delay_samples != 1, "plant.delay_samples: expected 1, since drives obey from the next cycle on"),
        (plant.encoder_counts is None, "plant.encoder_counts: expected a number, since drives count"),
        (motor_torque_limit(scenario) is None, "plant.torque_limit: expected a number, which the drives are given"),
        (
            MICROSECONDS % scenario.rate_hz != 0,
            "rate_hz: expected a divisor of 1000000, since drives count microseconds",
        ),
    ):
        if missing:
            raise InputError(f"{scenario.name} on two drives: {reason}")
