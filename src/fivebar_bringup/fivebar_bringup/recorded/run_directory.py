# SPDX-License-Identifier: Apache-2.0
"""The directory of a run and the files in it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from fivebar_bringup.recorded.results import FIGURES, new_directory, write_results
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_description.files import LARGEST_TABLE, is_yaml_path
from fivebar_description.modules import modules_unopened
from fivebar_description.optional import CAMERA_ON, CAMERA_OPTICS, optional_part
from fivebar_description.scenario_file import FILE_OF_RUN
from fivebar_description.strict_yaml import InputError, read_text

TRAJECTORY_FILE = "trajectory.csv"
"""The trajectory that was followed, where the scenario names one."""

CAMERA_FILE = "camera.yaml"
"""The calibration of the camera as it was, where the scenario names one."""


class RunDirectory(NamedTuple):
    """The directory of one run, with the path of every file in it."""

    path: Path

    @property
    def bag(self) -> Path:
        """The rosbag2 directory."""
        return self.path / "bag"

    @property
    def scenario(self) -> Path:
        """The scenario as run, with all defaults written out."""
        return self.path / FILE_OF_RUN

    @property
    def robot(self) -> Path:
        """The robot file as it was, where the scenario names one by its path."""
        return self.path / "robot.yaml"

    @property
    def timing(self) -> Path:
        """Facts that only the process that made the run knows: mode, wall time, latencies and detected faults."""
        return self.path / "timing.json"

    @property
    def odds(self) -> Path:
        """How likely the motion was to succeed, where its planner has found that out."""
        return self.path / "odds.json"

    @property
    def summary(self) -> Path:
        """The metrics of the run."""
        return self.path / "summary.json"

    @property
    def figures(self) -> Path:
        """The folder of the PNG figures."""
        return self.path / FIGURES

    @property
    def page(self) -> Path:
        """The report page."""
        return self.path / "report.html"

    @property
    def parameters(self) -> Path:
        """The folder of the parameter files that the nodes were started with."""
        return self.path / "parameters"

    @property
    def logs(self) -> Path:
        """The folder of each process's output."""
        return self.path / "logs"

    def files_of(self, scenario: Scenario) -> dict[tuple[str, ...], str]:
        """Return the names, in this directory, of the files that a scenario names by their paths, by their keys."""
        names: dict[tuple[str, ...], str] = {}
        if is_yaml_path(scenario.robot):
            names["robot",] = self.robot.name
        if scenario.trajectory:
            names["trajectory",] = TRAJECTORY_FILE
        if scenario.camera.on and scenario.camera.calibration:
            names["camera", "calibration"] = CAMERA_FILE
        return names

    def read_scenario(self) -> Scenario:
        """Return the scenario of a run made earlier; the module of a law from elsewhere is not imported.

        Raises:
            InputError: the directory does not hold a run.
        """
        if not self.scenario.is_file():
            raise InputError(f"{self.path}: is not a run directory: it has no {self.scenario.name}")
        with modules_unopened():
            return load_scenario(str(self.scenario))


def new_run_directory(out: Path | None, scenario: Scenario, odds: Mapping[str, Any] | None = None) -> RunDirectory:
    """Make the directory of a new run and write the scenario into it, with the files that it names by their paths.

    So the run stays what it was, whatever becomes of these files. The odds of its motion go with it, as `RunOdds` has
    them, where they are known.

    Raises:
        InputError: the directory is not empty, or cannot be made or written to, or a named file cannot be used.
    """
    # before anything is made or started, which it is not without its files
    files = {}
    camera = scenario.camera
    if camera.on and camera.calibration:
        optional_part(CAMERA_OPTICS, CAMERA_ON)(camera)
        files[CAMERA_FILE] = read_text(Path(camera.calibration))
        scenario = scenario.model_copy(update={"camera": camera._replace(calibration=CAMERA_FILE)})
    run = RunDirectory(new_directory(out, scenario.name))
    if is_yaml_path(scenario.robot):
        files[run.robot.name] = read_text(Path(scenario.robot))
        scenario = scenario.model_copy(update={"robot": run.robot.name})
    if scenario.trajectory:
        files[TRAJECTORY_FILE] = read_text(Path(scenario.trajectory), LARGEST_TABLE)
        scenario = scenario.model_copy(update={"trajectory": TRAJECTORY_FILE})
    if odds is not None:
        files[run.odds.name] = json.dumps(odds, indent=2) + "\n"
    write_results(run.path, {**files, run.scenario.name: scenario.to_yaml()})
    return run


def write_timing(run: RunDirectory, timing: dict[str, Any]) -> None:
    """Write what only the process that made the run knows.

    Raises:
        InputError: the directory cannot be written to.
    """
    write_results(run.path, {run.timing.name: json.dumps(timing, indent=2) + "\n"})
