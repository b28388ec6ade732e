# SPDX-License-Identifier: Apache-2.0
"""JSON Schema of summary.json, from the declaration of its content."""

from __future__ import annotations

import json
from typing import Any

from pydantic import TypeAdapter

from fivebar_bringup.attributes import attribute_words
from fivebar_bringup.recorded.summary import COMPLETED, Summary


def summary_schema() -> str:
    """Return the schema as text, with the descriptions of the fields."""
    schema = TypeAdapter(Summary).json_schema()
    _add_deprecated(schema)
    for name, words in attribute_words(Summary).items():
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


if __name__ == "__main__":
    print(summary_schema(), end="")
