# SPDX-License-Identifier: Apache-2.0
"""JSON Schemas of scenarios, robot files and programs, from the models that read them; for editors and others.

They hold types, ranges and keys. What one key demands of another is checked by the model only.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

from fivebar_bringup.reference.summary_schema import summary_schema
from fivebar_bringup.scenario import Scenario
from fivebar_control.planning.program import Program
from fivebar_description.robot_file import RobotFile
from fivebar_description.strict_yaml import KEY, NEWEST, StrictModel


def file_schema(model: type[StrictModel], title: str) -> str:
    """Return the schema of a file with this model as text."""
    schema = _plain(model.model_json_schema())
    schema["properties"][KEY]["const"] = NEWEST
    schema = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": title, **schema}
    return json.dumps(schema, indent=2, allow_nan=False) + "\n"


def schemas() -> dict[str, str]:
    """Return all published schemas by the name of their file."""
    return {
        "scenario.schema.json": file_schema(Scenario, "Scenario of fivebar"),
        "robot.schema.json": file_schema(RobotFile, "Robot file of fivebar"),
        "program.schema.json": file_schema(Program, "Program of fivebar"),
        "summary.schema.json": summary_schema(),
    }


def _plain(schema: Any) -> Any:
    """Return a schema without the titles that pydantic makes of the keys, and with defaults as a file has them."""
    if isinstance(schema, list):
        return [_plain(part) for part in schema]
    if isinstance(schema, float) and schema.is_integer():
        # a bound of 0 or of 0.0, as whichever of two equal declarations was met first
        return int(schema)
    if not isinstance(schema, dict):
        return schema
    plain = {key: _plain(part) for key, part in schema.items() if key != "title" or isinstance(part, dict)}
    if plain.get("default") == math.inf:
        plain["default"] = None
    if plain.get("type") == "object" and not isinstance(plain.get("default", {}), dict):
        # a section as the tuple that it is once read; its keys have their own defaults
        del plain["default"]
    return plain


if __name__ == "__main__":
    for name, text in schemas().items():
        Path(sys.argv[1], name).write_text(text, encoding="utf-8")
