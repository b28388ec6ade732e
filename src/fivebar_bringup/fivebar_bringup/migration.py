"""Scenarios, robot files and programs in the newest format."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenario_format import SCENARIO_RULES
from fivebar_control.planning.program import PROGRAM_FILES, PROGRAM_RULES, SCENARIO_FILES, Program
from fivebar_description.file_format import UNNAMED, Migrated, Rule, format_in
from fivebar_description.file_format import migrate as migrated_text
from fivebar_description.robot_file import ROBOT_RULES, RobotFile
from fivebar_description.share import placed_beside
from fivebar_description.strict_yaml import InputError, StrictModel, parse_yaml, validate

KINDS: dict[str, tuple[type[StrictModel], Sequence[Sequence[Rule]], Sequence[tuple[str, ...]]]] = {
    "waypoints": (Scenario, SCENARIO_RULES, SCENARIO_FILES),
    "lengths_m": (RobotFile, ROBOT_RULES, ()),
    "steps": (Program, PROGRAM_RULES, PROGRAM_FILES),
}
"""Model, rules and the keys of names of other files, by a key that only files of that kind have."""


def migrated_file(text: str, source: str, number: int | None) -> Migrated:
    """Return a scenario, robot file or program in the newest format; `number` is the format of a file that names none.

    Raises:
        InputError: it is none of them, or not valid in the newest format either.
    """
    content = parse_yaml(text, source)
    kind = next((kind for key, kind in KINDS.items() if isinstance(content, dict) and key in content), None)
    if kind is None:
        raise InputError(
            f"{source}: expected a scenario, which has waypoints, a robot file, which has lengths_m, or a program with"
            " steps"
        )
    model, rules, files = kind
    named = format_in(content, source)
    if named is None:
        named = UNNAMED if number is None else number
    elif number not in (None, named):
        raise InputError(f"{source}: format: {named}: --from {number} says otherwise")
    migrated = migrated_text(text, source, named, rules)
    placed = placed_beside(Path(source).parent, parse_yaml(migrated.text, source), *files)
    validate(placed, model, source)
    return migrated
