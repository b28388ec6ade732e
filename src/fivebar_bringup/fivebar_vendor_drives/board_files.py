# SPDX-License-Identifier: Apache-2.0
"""Files of a run on a motor board, emulated on a port of this run only, or a real one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fivebar_bringup.drives.run_files import (
    GATHER_FRACTION,
    DriveFiles,
    check_drivable,
    emulated_robot,
    write_checked,
)
from fivebar_bringup.scenario import Scenario
from fivebar_control.hardware.configuration import MICROSECONDS
from fivebar_control.scenario.guard_settings import motor_torque_limit
from fivebar_control.scenario.start import initial_joints
from fivebar_control.scenario.stopping import stop_cycles
from fivebar_description.motors_file import BY_THE_CLOCK
from fivebar_motkin.board_file import BoardFile, load_board
from fivebar_motkin_emulation.configuration import BoardEmulationFile

SHIPPED = "motkin"
"""The interface, and the configuration of the bridge from which a run's own is made."""


class BoardRunFiles:
    """The `RunFiles` of a motor board."""

    real_drives = SHIPPED
    has_port = True

    def check(self, scenario: Scenario, configuration: str) -> None:
        """Refuse a scenario that cannot be run on a motor board.

        Raises:
            InputError: the text says what to change.
        """
        check_drivable(scenario)

    def write_real(self, scenario: Scenario, configuration: str, port: str | None, path: Path) -> None:
        """Write the bridge's file, as the scenario has it.

        Raises:
            InputError: the scenario cannot be run on a motor board; the text says what to change.
        """
        assert port is not None, "a board is behind a port"
        write_board_file(scenario, port, path, configuration)

    def write_rehearsal(self, scenario: Scenario, folder: Path, configuration: str | None) -> DriveFiles:
        """Write both files, on a port of this run only.

        Raises:
            InputError: the scenario cannot be rehearsed; the text says what to change.
        """
        check_drivable(scenario)
        files = DriveFiles.of(folder)
        port = str((folder / "board").absolute())
        emulation: dict[str, Any] = emulated_robot(scenario) | {
            "interface": SHIPPED,
            "port": port,
            "period_us": MICROSECONDS // scenario.rate_hz,
        }
        write_checked(files.emulation, emulation, BoardEmulationFile)
        write_board_file(scenario, port, files.drives, configuration or SHIPPED, pace="commands")
        return files


RUN_FILES = BoardRunFiles()


def write_board_file(scenario: Scenario, port: str, path: Path, board: str, pace: str = BY_THE_CLOCK) -> None:
    """Write the bridge's file of a motor board on a port, real or emulated: a named one, changed for this scenario.

    With the pace `commands` time waits for the bridge, as it can with an emulated board alone.

    Raises:
        InputError: the scenario cannot be run on a motor board; the text says what to change.
    """
    check_drivable(scenario)
    content = load_board(board).model_dump(mode="json")
    start, cycles = initial_joints(scenario), stop_cycles(scenario)
    period_us = MICROSECONDS // scenario.rate_hz
    content |= {
        "name": scenario.name,
        "port": port,
        "pace": pace,
        "period_us": period_us,
        "gather_deadline_us": int(GATHER_FRACTION * period_us),
        "watchdog_ms": max(1, cycles * period_us // 1000),
        "missing_limit": None,
        "posture": {"q11": start.q11, "q21": start.q21, "tolerance_rad": scenario.ekf.homing_tolerance},
    }
    crossings = scenario.plan().crossings
    content["inner_loop"] |= {
        "robot": scenario.robot,
        # no narrower than the plan's blending zones
        "epsilon": max([content["inner_loop"]["epsilon"], *(crossing.epsilon for crossing in crossings)]),
    }
    for motor in content["motors"].values():
        # the lesser one, so that a file for the first power-on holds whatever the scenario says
        motor["torque_limit_nm"] = min(motor["torque_limit_nm"], motor_torque_limit(scenario) or 0.0)
        motor["counts_per_revolution"] = scenario.drives().encoder_counts
    write_checked(path, content, BoardFile)
