"""The file of a run: found by name or by path, and its content read before any package takes its sections from it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fivebar_description.errors import InputError
from fivebar_description.files import placed_beside, share_file, yaml_path
from fivebar_description.outside_text import one_line
from fivebar_description.robot_file import RobotFile, read_robot
from fivebar_description.settings import Setting
from fivebar_description.strict_yaml import parse_versioned, read_text
from fivebar_description.suggestion import expected_one_of

DEFAULT_ROBOT = "dextar"

DEFAULT_SCENARIO = "middle"
"""Scenario of a node that is told of none."""

KEYS = (
    "format",
    "name",
    "controller",
    "robot",
    "working_mode",
    "working_modes",
    "waypoints",
    "start",
    "stands",
    "segment_duration",
    "time_law",
    "blend_radius",
    "rate_hz",
    "zone",
    "vhc_resolution",
    "gains",
    "unified",
    "adaptive_gain",
    "law",
    "drives_file",
    "plant",
    "imu",
    "sensors",
    "camera",
    "estimator",
    "ekf",
    "tolerances",
    "loads",
    "safety",
    "tracking_error_limit",
    "error_tolerance",
    "judge",
    "risk",
    "force",
)
"""The keys and sections of a scenario; each package declares those that it reads."""

ESTIMATOR = Setting(
    "Which joint states the controllers take: those of the plant, or all four joints estimated from the two"
    " motors' encoders and the applied torques.",
    choices=("none", "ekf"),
)

FILE_OF_RUN = "scenario.yaml"
"""Name of the scenario of a run in its directory, beside its bag."""

FILES_NAMED = (("robot",), ("drives_file",), ("camera", "calibration"))
"""Keys of a scenario whose values may be names of files."""


def scenario_directory() -> Path:
    """Return the folder of the shipped scenarios."""
    return share_file("fivebar_description", "config", "scenarios")


def shipped_scenarios() -> list[str]:
    """Return the names of the shipped scenarios."""
    return sorted(path.stem for path in scenario_directory().glob("*.yaml"))


def scenario_path(name_or_path: str) -> Path:
    """Return the file of a scenario, by the name of a shipped one or by path.

    Raises:
        InputError: it is neither.
    """
    return yaml_path("scenario", name_or_path, scenario_directory())


def read_content(path: Path) -> dict[str, Any]:
    """Return the keys and sections of a scenario file, names of files beside it as paths; values are not checked.

    Raises:
        InputError: the file is missing, not YAML, of another format, holds no keys, or one that no scenario has.
    """
    content = placed_beside(path.parent, parse_versioned(read_text(path), str(path)), *FILES_NAMED)
    if not isinstance(content, dict):
        raise InputError(f"{path}: expected keys with values, found {type(content).__name__}")
    unknown = next((key for key in content if key not in KEYS), None)
    if unknown is not None:
        raise InputError(f"{path}: {one_line(str(unknown))}: unknown key: {expected_one_of(unknown, KEYS)}")
    return content


def with_drives_of_robot(content: Any) -> tuple[Any, RobotFile | None]:
    """Return a scenario's content with what it leaves out of `estimator` and `plant`, and the file of its robot.

    A robot whose file has the encoders of its motors is estimated from these, unless the scenario says otherwise or
    meets Type 1, where the estimator cannot follow. A file that cannot be read is None: whoever needs it reports that.
    """
    robot = content.get("robot", DEFAULT_ROBOT) if isinstance(content, Mapping) else None
    if not isinstance(robot, str):
        return content, None
    try:
        file = read_robot(robot)
    except InputError:
        return content, None
    filled, drives = dict(content), file.drives
    found: dict[str, Any] = {} if drives.torque_limit is None else {"torque_limit": drives.torque_limit}
    if drives.encoder_counts is not None:
        if content.get("working_modes") is None:
            filled.setdefault("estimator", "ekf")
        if filled.get("estimator") == "ekf":
            found |= {"encoder_counts": drives.encoder_counts, "delay_samples": drives.delay_samples}
    return with_defaults(filled, "plant", found), file


def with_defaults(content: dict[str, Any], section: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return a scenario's content with defaults for keys of a section that it leaves out."""
    given = content.get(section, {})
    return {**content, section: {**values, **given}} if values and isinstance(given, Mapping) else content
