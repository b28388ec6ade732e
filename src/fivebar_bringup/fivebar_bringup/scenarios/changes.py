# SPDX-License-Identifier: Apache-2.0
"""Keys of a scenario that a command changes: `--set KEY=VALUE`, checked exactly as in a file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.without_effect import is_of_another_law, refuse_without_effect
from fivebar_control.laws.registry import find_controller
from fivebar_description.errors import InputError
from fivebar_description.settings import with_keys
from fivebar_description.strict_yaml import parse_yaml, validate

OPTION = "--set"

OF_ROBOT_FILE = {
    "drives.torque_limit": "plant.torque_limit",
    "drives.encoder_counts": "plant.encoder_counts",
    "drives.delay_samples": "plant.delay_samples",
    "drives.joint_speed_limit": "safety.joint_speed_limit",
    "transmission.": "plant.transmission.",
    "passive_encoder.": "sensors.passive_encoder.",
}
"""Keys of a robot file that a scenario has under another name; a name that ends in a dot stands for a section. The
sections `tolerances`, `loads`, `imu` and `camera` have the same name in both."""

GEOMETRY = ("lengths_m", "inertias_kg_m2", "mass_kg", "friction", "forces", "proximal_links", "distal_links", "tuning")
"""Sections that only a robot file has."""


def read_changes(words: Sequence[str] | None) -> dict[str, Any]:
    """Return keys with dots and their values, from words KEY=VALUE; a value is read as in a file (YAML).

    Raises:
        InputError: a word is malformed, a key is given twice, or only a robot file has it.
    """
    changes: dict[str, Any] = {}
    for word in words or ():
        name, sign, text = word.partition("=")
        key = _in_scenario(name.strip())
        if not sign or not all(key.split(".")):
            raise InputError(f"{OPTION} {word}: expected KEY=VALUE, such as unified.kp=900")
        if key.split(".")[0] in GEOMETRY:
            raise InputError(
                f"{OPTION} {key}: is a key of the robot's file: change a copy of that, and name it as the robot"
            )
        if key in changes:
            raise InputError(f"{OPTION} {key}: is given twice")
        changes[key] = parse_yaml(text, f"{OPTION} {key}")
    return changes


def _in_scenario(key: str) -> str:
    for own, name in OF_ROBOT_FILE.items():
        if key == own or (own.endswith(".") and key.startswith(own)):
            return name + key.removeprefix(own)
    return key


def with_changes(content: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of a scenario with changed keys.

    Raises:
        InputError: a key within what is no section.
    """
    for key in changes:
        inside: Any = content
        *sections, _ = key.split(".")
        for place, section in enumerate(sections, start=1):
            inside = inside.get(section) or {}
            if not isinstance(inside, Mapping):
                raise InputError(f"{OPTION} {key}: {'.'.join(sections[:place])} is no section and has no keys")
    return with_keys(content, changes)


def changed_scenario(content: Mapping[str, Any], changes: Mapping[str, Any]) -> Scenario:
    """Return the scenario of a content with changed keys, each of which has an effect.

    Raises:
        InputError: a key is unknown, its value does not fit, or it has no effect.
    """
    scenario = validate(with_changes(content, changes), Scenario, OPTION)
    refuse_changes_without_effect(changes, [scenario])
    return scenario


def changes_for(words: Sequence[str], controller: str) -> dict[str, Any]:
    """Return the changes of a study for one of its controllers: without settings of other laws.

    Raises:
        InputError: as `read_changes`.
    """
    scheme = find_controller(controller)
    return {key: value for key, value in read_changes(words).items() if not is_of_another_law(key, scheme)}


def refuse_changes_without_effect(changes: Mapping[str, Any], scenarios: Iterable[Scenario]) -> None:
    """Refuse a changed key that has an effect in none of some scenarios.

    Raises:
        InputError: there is one.
    """
    runs = list(scenarios)
    for key, value in changes.items():
        problems = []
        for scenario in runs:
            try:
                refuse_without_effect(with_keys({}, {key: value}), scenario)
            except InputError as error:
                problems.append(str(error))
        if runs and len(problems) == len(runs):
            raise InputError(f"{OPTION} {problems[0]}")


OF_STUDY = {
    "name": "--out",
    "robot": "--robot",
    "controller": "--controllers",
    "working_modes": "a scenario with `fivebar simulate`",
    "start": "a scenario with `fivebar simulate`",
    "stands": "a scenario with `fivebar simulate`",
    "drives_file": "`fivebar run --hardware`",
    "force": "a scenario with `fivebar simulate`",
}
"""Keys that a study of motions decides itself, and what to use in their place."""


def refuse_decided(changes: Mapping[str, Any], decided: Mapping[str, str]) -> None:
    """Refuse keys that a command decides itself.

    Args:
        changes: what is changed.
        decided: keys or sections, and what to use in their place.

    Raises:
        InputError: one of the keys is among them.
    """
    for key in changes:
        for name, instead in decided.items():
            if key == name or key.startswith(f"{name}."):
                raise InputError(f"{OPTION} {key}: has no effect here; use {instead}")
