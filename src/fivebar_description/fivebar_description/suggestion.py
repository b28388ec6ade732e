# SPDX-License-Identifier: Apache-2.0
"""The name that was meant by one that does not exist, for the messages that refuse it."""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

UNIT = re.compile(r"Unit: (.+)\.$")
"""The unit at the end of a description."""

CLOSE = 0.7
"""Likeness, 0 to 1, from which on another name is taken for the one that was meant."""


def meant(name: str, known: Collection[str], close: float = CLOSE) -> str | None:
    """Return the known name that is most like another, upper or lower case; None where none is like it."""
    folded = {known_name.casefold(): known_name for known_name in known}
    matches = difflib.get_close_matches(name.casefold(), folded, 1, close)
    return folded[matches[0]] if matches else None


def did_you_mean(name: object, known: Collection[str]) -> str:
    """Return the end of a message that refuses a name: a question, or nothing where no known name is like it."""
    suggestion = meant(name, known) if isinstance(name, str) else None
    return f" (did you mean {suggestion}?)" if suggestion is not None else ""


def expected_one_of(name: object, known: Collection[str], besides: str = "", what: str = "one of") -> str:
    """Return what was expected in place of a name: all known ones, what else is possible, and what may be meant."""
    return f"expected {what} {', '.join(known)}{besides}{did_you_mean(name, known)}"


def keys_at(schema: Mapping[str, Any], keys: Sequence[str]) -> set[str]:
    """Return the keys that a JSON Schema knows at a place, which the keys before it lead to."""
    definitions = schema.get("$defs", {})
    places = [*_alternatives(schema, definitions)]
    for key in keys:
        inside = [child for place in places for child in _children(place, key)]
        places = [alternative for child in inside for alternative in _alternatives(child, definitions)]
    return {name for place in places for name in place.get("properties", ())}


MOST_PLACES = 3
"""Keys of other sections that are proposed at most."""


def did_you_mean_elsewhere(name: str, schema: Mapping[str, Any]) -> str:
    """Return the end of a message that refuses a key: the keys of that name in the sections of a JSON Schema."""
    sections = [(), *((section,) for section in sorted(keys_at(schema, ())))]
    places = [".".join((*section, name)) for section in sections if name in keys_at(schema, section)]
    return f" (did you mean {' or '.join(places[:MOST_PLACES])}?)" if places else ""


def unit_at(schema: Mapping[str, Any], keys: Sequence[str]) -> str:
    """Return the unit of a number at a place, by the end of its description in a JSON Schema; "" where it has none."""
    definitions = schema.get("$defs", {})
    places = [*_alternatives(schema, definitions)]
    unit = ""
    for key in keys:
        inside = [child for place in places for child in _children(place, key)]
        places = [alternative for child in inside for alternative in _alternatives(child, definitions)]
        # that of a list is also that of its numbers
        units = [match[1] for place in places if (match := UNIT.search(place.get("description", "")))]
        unit = units[0] if units else unit if key.isdecimal() else ""
    return unit


def _children(place: Mapping[str, Any], key: str) -> Iterator[Mapping[str, Any]]:
    child = place.get("properties", {}).get(key)
    items = place.get("prefixItems", ())
    nth = items[int(key)] if key.isdecimal() and int(key) < len(items) else None
    for candidate in (child, nth, place.get("items"), place.get("additionalProperties")):
        if isinstance(candidate, Mapping):
            yield candidate


def _alternatives(place: Mapping[str, Any], definitions: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """Yield a place of a schema and all that it refers to."""
    yield place
    if "$ref" in place:
        yield from _alternatives(definitions[place["$ref"].rpartition("/")[2]], definitions)
    for word in ("anyOf", "oneOf", "allOf"):
        for alternative in place.get(word, ()):
            yield from _alternatives(alternative, definitions)
