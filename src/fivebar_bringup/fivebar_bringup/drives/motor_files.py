# SPDX-License-Identifier: Apache-2.0
"""Files of a run on two motors whose configuration is a `MotorsFile`, whatever their interface."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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
from fivebar_control.hardware.motors_file import MotorsFile, load_motors
from fivebar_control.scenario.guard_settings import motor_torque_limit
from fivebar_control.scenario.start import initial_joints
from fivebar_control.scenario.stopping import stop_cycles
from fivebar_description.errors import unwrapped
from fivebar_description.files import write_file
from fivebar_description.strict_yaml import InputError, yaml_text
from fivebar_sim.motors.configuration import MotorFacts, MotorsEmulationFile


class MotorRunFiles:
    """The `RunFiles` of motors that a `MotorDriver` reaches. For real drives a configuration is always given."""

    real_drives = ""
    has_port = False

    def __init__(
        self,
        private_link: Callable[[Mapping[str, Any], Path], dict[str, Any]],
        shipped: str = "",
        of_scenario: Callable[[Mapping[str, Any], Scenario], dict[str, Any]] = lambda link, scenario: dict(link),
        least_parts: Callable[[Mapping[str, Any]], int] = lambda link: 1,
    ) -> None:
        """Write files for one interface.

        Args:
            private_link: returns the section `link` of a rehearsal, on a bus or port of this run only, from that of the
                configuration and the folder of the run.
            shipped: name of the configuration that a rehearsal begins from where none is given; empty for none.
            of_scenario: returns a section `link` with what a scenario decides of it.
            least_parts: returns in how many parts of a period, at least, emulated drives of a section `link` act anew.
        """
        self._shipped = shipped
        self._private_link, self._for_scenario, self._least_parts = private_link, of_scenario, least_parts

    def check(self, scenario: Scenario, configuration: str) -> None:
        """Refuse a scenario that cannot be run on real drives of a configuration.

        Raises:
            InputError: the text says what to change.
        """
        self._of_scenario(scenario, configuration)

    def write_real(self, scenario: Scenario, configuration: str, port: str | None, path: Path) -> None:
        """Write the bridge's file, as the drives are set up.

        Raises:
            InputError: the scenario cannot be run on these drives; the text says what to change.
        """
        content = self._of_scenario(scenario, configuration).model_dump(mode="json")
        content["link"] = self._for_scenario(content["link"], scenario)
        write_file(path, yaml_text(content))

    def write_rehearsal(self, scenario: Scenario, folder: Path, configuration: str | None) -> DriveFiles:
        """Write both files, on a bus or port of this run only, at the scenario's rate and counts.

        Raises:
            InputError: the scenario cannot be rehearsed; the text says what to change.
        """
        check_drivable(scenario)
        begun = configuration or self._shipped
        if not begun:
            raise InputError("--drives: expected the configuration of the drives, which the rehearsal begins from")
        files = DriveFiles.of(folder)
        content = load_motors(begun).model_dump(mode="json")
        start, cycles = initial_joints(scenario), stop_cycles(scenario)
        period_us = MICROSECONDS // scenario.rate_hz
        common = {
            "name": scenario.name,
            "interface": content["interface"],
            "pace": "commands",
            "period_us": period_us,
            "watchdog_ms": max(1, cycles * period_us // 1000),
            "link": self._for_scenario(self._link_of_run(content, folder), scenario),
        }
        content |= common | {
            "gather_deadline_us": int(GATHER_FRACTION * period_us),
            "missing_limit": None,
            "posture": {"q11": start.q11, "q21": start.q21, "tolerance_rad": scenario.ekf.homing_tolerance},
        }
        counts = scenario.drives().encoder_counts or 0
        for motor in content["motors"].values():
            motor["torque_limit_nm"] = min(motor["torque_limit_nm"], motor_torque_limit(scenario) or 0.0)
            motor["counts_per_revolution"] = max(1, round(counts / motor["gear_ratio"]))
        facts = {
            joint: {key: value for key, value in motor.items() if key in MotorFacts.model_fields}
            for joint, motor in content["motors"].items()
        }
        emulated = {"motors": facts, "least_parts": self._least_parts(content["link"])}
        write_checked(files.emulation, emulated_robot(scenario) | common | emulated, MotorsEmulationFile)
        write_checked(files.drives, content, MotorsFile)
        return files

    def _link_of_run(self, content: Mapping[str, Any], folder: Path) -> dict[str, Any]:
        """Return the section `link` of a rehearsal, and name an interface whose own function fails."""
        try:
            return self._private_link(content["link"], folder)
        except InputError:
            # what it refuses, in its own words
            raise
        except Exception as error:  # whatever a function of somebody else raises
            words = unwrapped(error) or "without a word"
            raise InputError(
                f"interface {content['interface']!r}: its function for a private link fails with"
                f" {type(error).__name__}: {words}; it was given link: {dict(content['link'])}"
            ) from error

    def _of_scenario(self, scenario: Scenario, configuration: str) -> MotorsFile:
        check_drivable(scenario)
        file = load_motors(configuration)
        if file.period_us * scenario.rate_hz != MICROSECONDS:
            raise InputError(
                f"{configuration}: period_us {file.period_us}: expected that of the scenario's rate_hz"
                f" {scenario.rate_hz}"
            )
        return file
