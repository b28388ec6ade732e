"""Settings that are changed for a run that is estimated again: single ones, or a file of sections."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fivebar_bringup.scenario import Scenario
from fivebar_description.strict_yaml import InputError, load_yaml, validate

SECTIONS = ("ekf", "tolerances")
"""Sections of a scenario that concern the estimator alone."""

EXPECTED = "expected SECTION.NAME=VALUE such as ekf.gyro_noise=0.02, of the sections " + " and ".join(SECTIONS)


def changed_scenario(recorded: Scenario, file: Path | None, settings: Sequence[str]) -> Scenario:
    """Return a scenario with the settings of a file, and then single ones, instead of those recorded.

    Args:
        recorded: as run.
        file: YAML with sections `ekf` and `tolerances`, or a whole scenario, of which it is these that count.
        settings: each `SECTION.NAME=VALUE`.

    Raises:
        InputError: a setting is unknown, malformed or out of range.
    """
    content = recorded.model_dump(mode="json")
    if file is not None:
        _merge(content, file)
    for text in settings:
        section, name, value = _parts(text)
        content[section][name] = value
    return validate(content, Scenario, "--set" if settings else str(file))


def _merge(content: dict[str, Any], file: Path) -> None:
    found = load_yaml(file)
    if not isinstance(found, Mapping) or not any(section in found for section in SECTIONS):
        raise InputError(f"{file}: expected the sections {' or '.join(SECTIONS)}")
    for section in SECTIONS:
        values = found.get(section, {})
        if not isinstance(values, Mapping):
            raise InputError(f"{file}: {section}: expected names with values")
        content[section] |= values


def _parts(text: str) -> tuple[str, str, float | bool]:
    key, equals, value = text.partition("=")
    section, dot, name = key.strip().partition(".")
    if not equals or not dot or section not in SECTIONS:
        raise InputError(f"--set: {text!r}: {EXPECTED}")
    word = value.strip()
    if word in ("true", "false"):
        return section, name, word == "true"
    try:
        return section, name, float(word)
    except ValueError as error:
        raise InputError(f"--set: {text!r}: expected a number, true or false after =") from error
