# SPDX-License-Identifier: Apache-2.0
"""Settings that are changed for a run that is estimated again: single ones, or a file of sections."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.changes import OPTION, read_changes, with_changes
from fivebar_description.strict_yaml import InputError, load_yaml, validate

SECTIONS = ("ekf", "tolerances")
"""Sections of a scenario that concern the estimator alone."""


def changed_scenario(recorded: Scenario, file: Path | None, settings: Sequence[str]) -> Scenario:
    """Return a scenario with the settings of a file, and then single ones, instead of those recorded.

    Args:
        recorded: as run.
        file: YAML with sections `ekf` and `tolerances`, or a whole scenario, of which it is these that count.
        settings: each KEY=VALUE.

    Raises:
        InputError: a setting is unknown, malformed or out of range.
    """
    content, changes = recorded.model_dump(mode="json"), read_changes(settings)
    for key in changes:
        if key.partition(".")[0] not in SECTIONS:
            words = " and ".join(SECTIONS)
            raise InputError(f"{OPTION} {key}: expected a key of the sections {words}, such as ekf.gyro_noise=0.02")
    if file is not None:
        _merge(content, file)
    return validate(with_changes(content, changes), Scenario, OPTION if settings else str(file))


def _merge(content: dict[str, Any], file: Path) -> None:
    settings = load_yaml(file)
    if not isinstance(settings, Mapping) or not any(section in settings for section in SECTIONS):
        raise InputError(f"{file}: expected the sections {' or '.join(SECTIONS)}")
    for section in SECTIONS:
        values = settings.get(section, {})
        if not isinstance(values, Mapping):
            raise InputError(f"{file}: {section}: expected names with values")
        content[section] |= values
