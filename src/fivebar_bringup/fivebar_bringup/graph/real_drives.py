"""The real drives of a run: how they are reached, and who enables them."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from fivebar_bringup.graph.bridges import BRIDGE, bridge_of
from fivebar_bringup.graph.rehearsal import check_drivable, write_board_file
from fivebar_bringup.scenario import Scenario
from fivebar_control.hardware.configuration import MICROSECONDS, DriveFile, load_drives
from fivebar_description.strict_yaml import InputError, yaml_text
from fivebar_description.text_file import write_file

DEFAULT_DRIVES = "dextar_socketcan"
"""Configuration of the bridge to drives on a CAN bus."""


class RealDrives(NamedTuple):
    """Drives that move a real robot.

    Attributes:
        configuration: of their bridge, by name or path.
        port: of a motor board; None for two drives on a CAN bus.
        activate: whether they are enabled as soon as all nodes are ready, or by whoever stands at the robot.
    """

    configuration: str
    port: str | None
    activate: bool


def write_real_drives(scenario: Scenario, drives: RealDrives, path: Path) -> None:
    """Write the bridge's file of a run: of a motor board as the scenario has it, of drives on a bus as they are set up.

    Raises:
        InputError: the scenario cannot be run on these drives; the text says what to change.
    """
    if drives.port is not None:
        write_board_file(scenario, drives.port, path, drives.configuration)
        return
    file = drive_file(scenario, drives.configuration)
    write_file(path, yaml_text(file.model_dump(mode="json")))


def drive_file(scenario: Scenario, configuration: str) -> DriveFile:
    """Return the configuration, by name or path, of drives on a bus that a scenario can be run on.

    The shipped one is a template, whose period is that of the scenario; a file of one's own has to agree with it.

    Raises:
        InputError: it cannot; the text says what to change.
    """
    check_drivable(scenario)
    if bridge_of(scenario) != BRIDGE:
        raise InputError(f"{scenario.name}: robot {scenario.robot}: expected one whose drives are on a CAN bus")
    file = load_drives(configuration)
    period, rest = divmod(MICROSECONDS, scenario.rate_hz)
    if configuration == DEFAULT_DRIVES and not rest and period > file.gather_deadline_us:
        file = file.model_copy(update={"sync_period_us": period})
    if file.rate_hz != scenario.rate_hz:
        raise InputError(
            f"{configuration}: sync_period_us {file.sync_period_us}: expected that of the scenario's rate_hz"
            f" {scenario.rate_hz}"
        )
    return file
