"""The name that was meant by one that does not exist, for the messages that refuse it."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

CLOSE = 0.7
"""Likeness, 0 to 1, from which on another name is taken for the one that was meant."""


def meant(name: str, known: Collection[str], close: float = CLOSE) -> str | None:
    """Return the known name that is most like another, upper or lower case; None where none is like it."""
    folded = {one.casefold(): one for one in known}
    found = difflib.get_close_matches(name.casefold(), folded, 1, close)
    return folded[found[0]] if found else None


def did_you_mean(name: object, known: Collection[str]) -> str:
    """Return the end of a message that refuses a name: a question, or nothing where no known name is like it."""
    found = meant(name, known) if isinstance(name, str) else None
    return f" (did you mean {found}?)" if found is not None else ""


def expected_one_of(name: object, known: Collection[str], besides: str = "", what: str = "one of") -> str:
    """Return what was expected in place of a name: all known ones, what else is possible, and what may be meant."""
    return f"expected {what} {', '.join(known)}{besides}{did_you_mean(name, known)}"


def keys_at(schema: Mapping[str, Any], keys: Sequence[str]) -> set[str]:
    """Return the keys that a JSON Schema knows at a place, which the keys before it lead to."""
    definitions = schema.get("$defs", {})
    places = [*_alternatives(schema, definitions)]
    for key in keys:
        inside = [child for place in places for child in _children(place, key)]
        places = [one for child in inside for one in _alternatives(child, definitions)]
    return {name for place in places for name in place.get("properties", ())}


def _children(place: Mapping[str, Any], key: str) -> Iterator[Mapping[str, Any]]:
    child = place.get("properties", {}).get(key)
    for found in (child, place.get("items"), place.get("additionalProperties")):
        if isinstance(found, Mapping):
            yield found


def _alternatives(place: Mapping[str, Any], definitions: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """Yield a place of a schema and all that it refers to."""
    yield place
    if "$ref" in place:
        yield from _alternatives(definitions[place["$ref"].rpartition("/")[2]], definitions)
    for word in ("anyOf", "oneOf", "allOf"):
        for one in place.get(word, ()):
            yield from _alternatives(one, definitions)
