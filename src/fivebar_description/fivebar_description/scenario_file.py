# SPDX-License-Identifier: Apache-2.0
"""The file of a run: found by name or by path, and its content read before any package takes its sections from it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fivebar_description.errors import InputError
from fivebar_description.files import placed_beside, share_file, yaml_path
from fivebar_description.outside_text import one_line
from fivebar_description.robot_file import RobotFile, read_robot
from fivebar_description.settings import Setting, plain_keys
from fivebar_description.strict_yaml import parse_versioned, read_text
from fivebar_description.suggestion import expected_one_of
from fivebar_description.transmission import RIGID

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
    "trajectory",
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
    "extra_sensor",
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

CONSTANTS = {
    "safety": {"brake_time": 0.02, "brake_kappa": 0.1},
    "ekf": {"misfit_time": 0.02, "offset_time": 0.05, "camera_gate": 6.0, "camera_latency": 0.1},
    "risk": {"load_aim": 0.25, "wrong_mode": 1e-3},
}
"""Keys that are no settings, by section, with their values. Recorded scenarios may have them with these values."""

ESTIMATOR = Setting(
    "Which joint states the controllers take: those of the plant, or all four joints estimated from the two"
    " motors' encoders and the applied torques.",
    choices=("none", "ekf"),
)

FILE_OF_RUN = "scenario.yaml"
"""Name of the scenario of a run in its directory, beside its bag."""

FILES_NAMED = (("robot",), ("trajectory",), ("drives_file",), ("camera", "calibration"))
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
    refuse_robot_file(content, path)
    unknown = next((key for key in content if key not in KEYS), None)
    if unknown is not None:
        raise InputError(f"{path}: {one_line(str(unknown))}: unknown key: {expected_one_of(unknown, KEYS)}")
    return without_constants(content, path)


def without_constants(content: dict[str, Any], path: Path) -> dict[str, Any]:
    """Return the content of a scenario without keys that are constants.

    Raises:
        InputError: one has another value.
    """
    for section, constants in CONSTANTS.items():
        declared = content.get(section)
        if not isinstance(declared, Mapping):
            continue
        for key, value in constants.items():
            if key in declared and declared[key] != value:
                wrong = one_line(str(declared[key]))
                raise InputError(f"{path}: {section}.{key}: {wrong}: is no setting, but always {value:g}: leave it out")
        if constants.keys() & declared.keys():
            content = {**content, section: {key: setting for key, setting in declared.items() if key not in constants}}
    return content


def refuse_robot_file(content: Any, path: Path) -> None:
    """Refuse the content of a robot file in place of a scenario.

    Raises:
        InputError: it is one.
    """
    if isinstance(content, Mapping) and "lengths_m" in content and "waypoints" not in content:
        raise InputError(
            f"{path}: is a robot file: expected a scenario; `fivebar goto X Y --robot {path}` makes one of a motion"
        )


USUAL_COUNTS = 20_000
"""Counts of the motor encoders of a robot whose file says how its robots differ, but not what encoders they have."""


def with_parts_of_robot(content: Any) -> tuple[Any, RobotFile | None]:
    """Return a scenario's content with what it leaves out of estimator, drives and sensors, and its robot's file.

    A robot is estimated from the encoders of its motors where its file has them, or says how its robots differ from it;
    unless the scenario says otherwise or meets Type 1, where the estimator cannot follow. It has the sensors of its
    file where there is an estimator. A file that cannot be read is None: whoever needs it reports that.
    """
    robot = content.get("robot", DEFAULT_ROBOT) if isinstance(content, Mapping) else None
    if not isinstance(robot, str):
        return content, None
    try:
        file = read_robot(robot)
    except InputError:
        return content, None
    filled, counts = dict(content), encoder_counts(file)
    if counts is not None and content.get("working_modes") is None:
        filled.setdefault("estimator", "ekf")
    for section, values in parts_of_robot(file, filled.get("estimator") == "ekf").items():
        filled = with_defaults(filled, section, values)
    return filled, file


def encoder_counts(file: RobotFile) -> int | None:
    """Return the counts of a robot's motor encoders; None where neither they nor errors of the robot are declared."""
    return file.drives.encoder_counts or (USUAL_COUNTS if file.declares_errors else None)


def delay_samples(file: RobotFile) -> int:
    """Return the delay of a robot's drives (samples): at least one where its file says how its robots differ."""
    return max(int(file.declares_errors), file.drives.delay_samples)


def parts_of_robot(file: RobotFile, estimated: bool) -> dict[str, dict[str, Any]]:
    """Return what a robot's file says of drives, transmissions and sensors, by section and key of a scenario.

    Args:
        file: of the robot.
        estimated: whether there is an estimator, which uses encoders and sensors that the file declares.
    """
    plant: dict[str, Any] = {}
    parts: dict[str, dict[str, Any]] = {"plant": plant}
    if file.drives.torque_limit is not None:
        plant["torque_limit"] = file.drives.torque_limit
    if file.transmission != RIGID:
        plant["transmission"] = plain_keys(file.transmission)
    if not estimated:
        return parts
    counts = encoder_counts(file)
    if counts is not None:
        plant |= {"encoder_counts": counts, "delay_samples": delay_samples(file)}
    if file.imu is not None:
        parts["imu"] = plain_keys(file.imu)
    if file.passive_encoder is not None:
        parts["sensors"] = {"passive_encoder": plain_keys(file.passive_encoder)}
    if file.camera is not None:
        parts["camera"] = plain_keys(file.camera)
    parts["extra_sensor"] = file.extra_sensor
    return parts


def with_defaults(content: dict[str, Any], section: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return a scenario's content with defaults for keys of a section that it leaves out."""
    declared = content.get(section, {})
    return {**content, section: {**values, **declared}} if values and isinstance(declared, Mapping) else content
