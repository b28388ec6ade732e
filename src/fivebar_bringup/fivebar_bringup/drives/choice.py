# SPDX-License-Identifier: Apache-2.0
"""Choice of the drives that a run is on, emulated or real, and the files that it needs."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from fivebar_bringup.drives.hardware import Hardware
from fivebar_bringup.drives.run_files import DriveFiles, RunFiles
from fivebar_bringup.scenario import Scenario
from fivebar_control.hardware.connection import interface_of
from fivebar_description.drive_kinds import DriveKind, confirm_installed, drive_kind
from fivebar_description.errors import InputError
from fivebar_description.modules import load_part
from fivebar_description.optional import confirm_package
from fivebar_description.robot_file import read_robot


class RealDrives(NamedTuple):
    """Drives that move a real robot.

    Attributes:
        configuration: of their bridge, by name or path.
        port: serial port where they are behind one, else None.
        activate: whether they are enabled as soon as all nodes are ready, or by whoever stands at the robot.
    """

    configuration: str
    port: str | None
    activate: bool


def configuration_of_run(scenario: Scenario, configuration: str | None) -> str | None:
    """Return the configuration of a run's drives: the one that is asked for, else that of the scenario, if any."""
    return configuration or scenario.drives_file or None


def interface_of_run(scenario: Scenario, configuration: str | None = None) -> str:
    """Return the name of the interface of a run's drives: that in a configuration file, else that of the robot.

    Raises:
        InputError: there is no such file.
    """
    configuration = configuration_of_run(scenario, configuration)
    named = None if configuration is None else interface_of(configuration)
    return named or read_robot(scenario.robot).drives.interface


def kind_of(scenario: Scenario, configuration: str | None = None) -> DriveKind:
    """Return the interface of a run's drives.

    Raises:
        InputError: there is no such file or interface, it cannot be loaded, or what it needs is not installed.
    """
    kind = drive_kind(interface_of_run(scenario, configuration))
    confirm_installed(kind)
    return kind


def run_files_of(kind: DriveKind) -> RunFiles:
    """Return what writes the files of a run on drives of an interface.

    Raises:
        InputError: it cannot be loaded.
    """
    files: RunFiles = load_part(kind.run_files)
    return files


def write_drive_files(scenario: Scenario, folder: Path, configuration: str | None = None) -> DriveFiles:
    """Write the files of a rehearsal into a folder; the bridge's begins as a named configuration, or the shipped one.

    Raises:
        InputError: the scenario cannot be rehearsed on emulated drives; the text says what to change.
    """
    configuration = configuration_of_run(scenario, configuration)
    kind = kind_of(scenario, configuration)
    confirm_package(kind.emulation, f"--hardware emulated: {kind.name}")
    return run_files_of(kind).write_rehearsal(scenario, folder, configuration)


def write_real_drives(scenario: Scenario, drives: RealDrives, path: Path) -> None:
    """Write the bridge's file of a run on real drives.

    Raises:
        InputError: the scenario cannot be run on these drives; the text says what to change.
    """
    files = run_files_of(kind_of(scenario, drives.configuration))
    files.write_real(scenario, drives.configuration, drives.port, path)


def real_drives(
    scenario: Scenario, kind: DriveKind, hardware: Hardware, drives: str | None, port: str | None
) -> RealDrives:
    """Return the real drives of a run, which nobody has asked to be enabled yet.

    Raises:
        InputError: the scenario cannot be run on them, or an option is missing or too many.
    """
    if hardware not in (Hardware.REAL, kind.hardware):
        expected = " or ".join(filter(None, (kind.hardware, Hardware.REAL)))
        raise InputError(f"--hardware {hardware}: the drives are {kind.name}: expected {expected}: {scenario.robot}")
    files = run_files_of(kind)
    if (port is not None) is not files.has_port:
        raise InputError("--port: expected together with --hardware usb, and only there")
    configuration = configuration_of_run(scenario, drives) or files.real_drives
    if not configuration:
        raise InputError(f"--drives: expected the configuration of the {kind.name} drives")
    files.check(scenario, configuration)
    return RealDrives(configuration, port, activate=False)
