"""Scenario files: found by name or path, read, and checked as a whole before anything starts."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from fivebar_bringup.scenario import SEEN, Scenario
from fivebar_control.estimation.homing import check_declared
from fivebar_control.planning.program import SCENARIO_FILES
from fivebar_description.file_format import read_versioned
from fivebar_description.share import placed_beside, share_file
from fivebar_description.strict_yaml import InputError
from fivebar_description.text_file import is_file
from fivebar_sim.engines import check_engine, check_plant


def scenario_directory() -> Path:
    """Return the folder of the shipped scenarios."""
    return share_file("fivebar_bringup", "config", "scenarios")


def shipped_scenarios() -> list[str]:
    """Return the names of the shipped scenarios."""
    return sorted(path.stem for path in scenario_directory().glob("*.yaml"))


def read_scenario(name_or_path: str) -> Scenario:
    """Read a scenario by the name of a shipped one or by path; one with `start: seen` begins where the camera sees it.

    Raises:
        InputError: there is no such scenario, it is malformed, or the camera does not see where the robot stands.
    """
    return _read(_path_of(name_or_path))


def _read(path: Path) -> Scenario:
    scenario = read_versioned(path, Scenario, partial(with_files_beside, path.parent))
    if scenario.start != SEEN:
        return scenario
    # OpenCV and the plant take time to load, which other scenarios need not
    from fivebar_bringup.simulation.seen_start import as_seen

    try:
        check_engine(scenario.plant)
        return as_seen(scenario)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def with_files_beside(folder: Path, content: Any) -> Any:
    """Return a scenario's content with the paths of files that it names and that lie beside it."""
    return placed_beside(folder, content, *SCENARIO_FILES)


def _path_of(name_or_path: str) -> Path:
    path = Path(name_or_path)
    if path.suffix not in (".yaml", ".yml"):
        path = scenario_directory() / f"{name_or_path}.yaml"
        if not is_file(path):
            raise InputError(
                f"scenario {name_or_path!r}: expected a path to a .yaml file or one of {', '.join(shipped_scenarios())}"
            )
    return path


def load_scenario(name_or_path: str) -> Scenario:
    """Read a scenario as `read_scenario` does, and check that its motion can be made.

    Raises:
        InputError: there is no such scenario, it is malformed, or its motion is refused.
    """
    path = _path_of(name_or_path)
    scenario = _read(path)
    try:
        scenario.plan()
        if scenario.estimated:
            check_declared(scenario.five_bar(), scenario.homing())
            if (scenario.ekf.camera or scenario.ekf.seen_start) and not scenario.camera.on:
                raise InputError("ekf.camera: there is no camera: expected camera: {on: true}")
        elif scenario.passive.leg:
            raise InputError("sensors.passive_encoder: only the estimator reads it: expected estimator ekf")
        check_plant(scenario.five_bar(), scenario.plant, scenario.rate_hz, scenario.initial_joints())
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    return scenario
