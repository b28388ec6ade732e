# SPDX-License-Identifier: Apache-2.0
"""Files of a run on two drives on a CAN bus: the shipped ones with the scenario's rate, encoders and limits."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from fivebar_bringup.drives.run_files import (
    GATHER_FRACTION,
    DriveFiles,
    check_drivable,
    emulated_robot,
    private_bus,
    write_checked,
)
from fivebar_bringup.scenario import Scenario
from fivebar_control.hardware.configuration import MICROSECONDS, DriveFile, load_drives
from fivebar_control.scenario.guard_settings import motor_torque_limit
from fivebar_control.scenario.start import initial_joints
from fivebar_control.scenario.stopping import stop_cycles
from fivebar_description.files import share_file, write_file
from fivebar_description.interface import ACTIVE_JOINTS
from fivebar_description.strict_yaml import InputError, load_yaml, yaml_text
from fivebar_sim.drives.configuration import EmulationFile

TEMPLATE = "dextar_socketcan"
"""Configuration of the bridge to real drives, whose period is that of the scenario."""

SHIPPED = "dextar_emulated.yaml"

TORQUE_STEPS = 1000
"""Resolution of 0x6071: steps per rated torque."""


class CanRunFiles:
    """The `RunFiles` of drives on a CAN bus."""

    real_drives = TEMPLATE
    has_port = False

    def check(self, scenario: Scenario, configuration: str) -> None:
        """Refuse a scenario that cannot be run on real drives of a configuration.

        Raises:
            InputError: the text says what to change.
        """
        drive_file(scenario, configuration)

    def write_real(self, scenario: Scenario, configuration: str, port: str | None, path: Path) -> None:
        """Write the bridge's file, as the drives are set up.

        Raises:
            InputError: the scenario cannot be run on these drives; the text says what to change.
        """
        write_file(path, yaml_text(drive_file(scenario, configuration).model_dump(mode="json")))

    def write_rehearsal(self, scenario: Scenario, folder: Path, configuration: str | None) -> DriveFiles:
        """Write both files, on a bus of this run only.

        Raises:
            InputError: the scenario cannot be rehearsed; the text says what to change.
        """
        check_drivable(scenario)
        if configuration is not None:
            raise InputError(f"{configuration}: a rehearsal of drives on a CAN bus has a configuration of its own")
        files = DriveFiles.of(folder)
        emulation, drives = _contents(scenario)
        write_checked(files.emulation, emulation, EmulationFile)
        write_checked(files.drives, drives, DriveFile)
        return files


RUN_FILES = CanRunFiles()


def drive_file(scenario: Scenario, configuration: str) -> DriveFile:
    """Return the configuration, by name or path, of drives on a bus that a scenario can be run on.

    The shipped one is a template, whose period is that of the scenario; a file of one's own has to agree with it.

    Raises:
        InputError: it cannot; the text says what to change.
    """
    check_drivable(scenario)
    file = load_drives(configuration)
    period, rest = divmod(MICROSECONDS, scenario.rate_hz)
    if configuration == TEMPLATE and not rest and period > file.gather_deadline_us:
        file = file.model_copy(update={"sync_period_us": period})
    if file.rate_hz != scenario.rate_hz:
        raise InputError(
            f"{configuration}: sync_period_us {file.sync_period_us}: expected that of the scenario's rate_hz"
            f" {scenario.rate_hz}"
        )
    return file


def _contents(scenario: Scenario) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the contents of the files of emulated drives and of their bridge, on a bus of their own."""
    emulation, drives = _shipped("fivebar_sim"), _shipped("fivebar_control")
    plant, cycles, start = scenario.plant, stop_cycles(scenario), initial_joints(scenario)
    period_us = MICROSECONDS // scenario.rate_hz
    period_ms = max(1, -(-period_us // 1000))
    # half a period, so that every cycle sends one even if it starts slightly early
    beat_ms = max(1, period_ms // 2)
    counts = plant.encoder_counts or 0
    common = {"bus": private_bus(), "sync_period_us": period_us}
    motor: dict[str, Any] = {"counts_per_revolution": counts, "velocity_units_per_rev_s": counts}
    if plant.torque_quantum:
        motor["rated_torque_nm"] = TORQUE_STEPS * plant.torque_quantum
    emulation |= common | emulated_robot(scenario)
    drives |= common | {
        "name": scenario.name,
        "gather_deadline_us": int(GATHER_FRACTION * period_us),
        "missing_limit": None,
        "posture": {"q11": start.q11, "q21": start.q21, "tolerance_rad": scenario.ekf.homing_tolerance},
        "master": {"node_id": 127, "heartbeat_ms": beat_ms, "timeout_ms": cycles * period_ms},
    }
    for joint in ACTIVE_JOINTS:
        emulation["drives"][joint] |= motor
        monitored = motor | {
            "torque_limit_nm": motor_torque_limit(scenario),
            "heartbeat_ms": beat_ms,
            "heartbeat_timeout_ms": (cycles + 2) * period_ms,
        }
        drives["drives"][joint] |= monitored
        if drives["drives"][joint]["sign"] < 0:
            # counts are rounded down in the motor's direction, which is up in the joint's
            drives["drives"][joint]["home_offset_rad"] = -math.tau / counts
    return emulation, drives


def _shipped(package: str) -> dict[str, Any]:
    content = load_yaml(share_file(package, "config", "drives", SHIPPED))
    assert isinstance(content, dict)
    return content
