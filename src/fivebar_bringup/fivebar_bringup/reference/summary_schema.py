"""JSON Schema of summary.json, from the declaration of its content."""

from __future__ import annotations

import json
import re
from typing import Any

from pydantic import TypeAdapter

from fivebar_bringup.recorded.summary import COMPLETED, Summary


def summary_schema() -> str:
    """Return the schema as text, with the descriptions of the fields."""
    schema = TypeAdapter(Summary).json_schema()
    _add_deprecated(schema)
    described = _descriptions(Summary.__doc__ or "")
    for name, words in described.items():
        schema["properties"][name]["description"] = words
    schema = {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "summary.json of a run"}
    schema["description"] = (Summary.__doc__ or "").partition("\n")[0]
    return json.dumps(schema, indent=2) + "\n"


def _add_deprecated(schema: dict[str, Any]) -> None:
    """Add the field that is derived from others, where the file has it: behind the first one."""
    first, *others = schema["properties"].items()
    completed = {
        "title": "Completed",
        "type": "boolean",
        "deprecated": True,
        "description": "whether `not_completed_because` is empty; `outcome` takes its place.",
    }
    schema["properties"] = dict([first, (COMPLETED, completed), *others])
    schema["required"].insert(1, COMPLETED)


def _descriptions(text: str) -> dict[str, str]:
    """Return the text of each attribute in a docstring, and of names that share one, to each."""
    described: dict[str, str] = {}
    part = text.partition("Attributes:\n")[2]
    for names, words in re.findall(r"^ {8}(\w+(?:, \w+)*): (.*(?:\n {12}.*)*)", part, re.MULTILINE):
        described |= dict.fromkeys(names.split(", "), " ".join(words.split()))
    return described


if __name__ == "__main__":
    print(summary_schema(), end="")
