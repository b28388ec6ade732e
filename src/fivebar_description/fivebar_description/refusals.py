# SPDX-License-Identifier: Apache-2.0
"""Refusals of a validation by pydantic, in the words of these messages: KEY: VALUE: expected WHAT."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pydantic import ValidationError

from fivebar_description.errors import printable, quoted
from fivebar_description.other_units import in_other_unit
from fivebar_description.suggestion import did_you_mean, did_you_mean_elsewhere, keys_at, unit_at

EXPECTED = {
    "bool": "true or false",
    "float": "a number",
    "int": "a whole number",
    "string": "text",
    "tuple": "a list",
    "list": "a list",
    "dict": "keys with values",
    "mapping": "keys with values",
    "model": "keys with values",
}
"""Words for each kind of value; pydantic's types of errors begin with the kind."""

BOUNDS = {
    "greater_than_equal": ("at least", "ge"),
    "greater_than": ("above", "gt"),
    "less_than_equal": ("at most", "le"),
    "less_than": ("below", "lt"),
}

WORDS = {
    "finite_number": "a finite number",
    "int_from_float": "a whole number, without a decimal point",
    "int_parsing_size": "a whole number of fewer digits",
    "none_required": "null",
    "invalid_key": "a word as the key",
    "recursion_loop": "a value that does not contain itself",
}

TYPES = ("bool", "float", "int", "str")
"""Names of alternatives that could be keys."""

CHOICE = re.compile(r"'([^']*)'")
"""A word among several that are possible, as pydantic lists them."""

DECIMAL_COMMA = re.compile(r"\s*[-+]?[0-9]+,[0-9]+\s*")


def problems_in(
    error: ValidationError,
    section: str = "",
    content: object = None,
    schema: Callable[[], Mapping[str, Any]] | None = None,
) -> str:
    """Return what is wrong in one line.

    Args:
        error: of the validation.
        section: stands in front of every key.
        content: what was validated, by which keys are told from pydantic's names of alternatives.
        schema: makes the JSON Schema of what was expected, whose keys are proposed in place of unknown ones.
    """
    details_at: dict[tuple[str, ...], list[Any]] = {}
    for detail in error.errors(include_url=False):
        if not _only_lacks_refused(detail):
            details_at.setdefault(_keys(detail, content), []).append(detail)
    # where an alternative fits but for a part of it, that part is what is wrong, and not that the others do not fit
    split = {
        keys for keys, details in details_at.items() if any(_is_alternative(detail, content) for detail in details)
    }
    told = [
        (keys, details)
        for keys, details in details_at.items()
        if keys not in split or not any(keys == other[: len(keys)] for other in details_at if other != keys)
    ]
    return "; ".join(_problem(section, keys, details, schema) for keys, details in told)


def _only_lacks_refused(detail: Any) -> bool:
    """Return whether a sequence is called too short although it is not: pydantic leaves out its refused elements."""
    return bool(detail["type"] == "too_short" and len(detail["input"]) >= detail["ctx"]["min_length"])


def _steps(detail: Any, content: object) -> tuple[list[str], bool]:
    """Return the keys that lead to what is wrong, and whether pydantic names an alternative among them."""
    keys, inside, labelled, filled = [], content, False, False
    location = detail["loc"]
    for place, part in enumerate(location):
        if isinstance(inside, Mapping) and part in inside:
            inside = inside[part]
        elif isinstance(inside, Sequence) and not isinstance(inside, str) and isinstance(part, int):
            inside = inside[part] if part < len(inside) else None
        elif isinstance(part, str) and (filled or (place == 0 and isinstance(inside, Mapping))) and part not in TYPES:
            # of a section that was filled in while the content was validated
            inside, filled = None, True
        elif content is not None and not (place == len(location) - 1 and detail["type"] == "missing"):
            labelled = True
            continue
        keys.append(str(part))
    return keys, labelled


def _keys(detail: Any, content: object) -> tuple[str, ...]:
    return tuple(_steps(detail, content)[0])


def _is_alternative(detail: Any, content: object) -> bool:
    return _steps(detail, content)[1]


def _problem(
    section: str, keys: Sequence[str], details: Sequence[Any], schema: Callable[[], Mapping[str, Any]] | None
) -> str:
    key = section + ".".join(key_part if key_part.isprintable() else repr(key_part) for key_part in keys)
    first = details[0]
    if first["type"] == "extra_forbidden":
        if schema is None:
            return f"{key}: unknown key"
        meant = did_you_mean(keys[-1], keys_at(schema(), keys[:-1])) or did_you_mean_elsewhere(keys[-1], schema())
        return f"{key}: unknown key{meant}"
    if first["type"] == "missing":
        return f"{key}: is missing"
    # of alternatives, the one whose type it has says more than the others, which want another type
    fitting = [detail for detail in details if not detail["type"].endswith("_type")] or details
    words = dict.fromkeys(_expectation(detail) for detail in fitting)
    expectation = " or ".join(word if not at else word.removeprefix("expected ") for at, word in enumerate(words))
    value = first["input"]
    if isinstance(value, str) and DECIMAL_COMMA.fullmatch(value) and expectation.startswith("expected a number"):
        expectation += ", with a point in place of the comma"
    if schema is not None and len(fitting) == 1 and first["type"] in BOUNDS:
        expectation += _unit(first, unit_at(schema(), keys))
    return f"{key}: {quoted(first['input'])}: {expectation}" if keys else f"{section}{expectation}"


def _unit(detail: Any, unit: str) -> str:
    """Return the unit of a bound, and that of the value where another one explains it."""
    if not unit:
        return ""
    bound = float(detail["ctx"][BOUNDS[detail["type"]][1]])
    beyond = abs(detail["input"]) > abs(bound)
    hint = in_other_unit(unit, lambda size: beyond and abs(detail["input"]) * size <= abs(bound))
    return f" {unit}{hint}"


def _expectation(detail: Any) -> str:
    kind, context = detail["type"], detail.get("ctx", {})
    if kind in BOUNDS:
        word, name = BOUNDS[kind]
        return f"expected {word} {context[name]:.10g}"
    if kind in WORDS:
        return f"expected {WORDS[kind]}"
    if kind in ("literal_error", "enum"):
        return f"expected {context['expected']}{did_you_mean(detail['input'], CHOICE.findall(context['expected']))}"
    if kind in ("too_short", "too_long"):
        word, count = ("at least", "min_length") if kind == "too_short" else ("at most", "max_length")
        return f"expected {word} {_counted(context[count], 'item')}, found {context['actual_length']}"
    if kind in ("string_too_short", "string_too_long"):
        word, count = ("at least", "min_length") if kind == "string_too_short" else ("at most", "max_length")
        return f"expected {word} {_counted(context[count], 'character')}"
    if kind == "string_pattern_mismatch":
        return f"expected text that matches {context['pattern']}"
    stem, _, rest = kind.partition("_")
    if stem in EXPECTED and rest in ("type", "parsing", "attributes_type"):
        return f"expected {EXPECTED[stem]}"
    message = detail["msg"].removeprefix("Value error, ")
    for jargon in ("Input should be a valid ", "Input should be ", "Input should "):
        if message.startswith(jargon):
            return printable(f"expected {message.removeprefix(jargon)}")
    return printable(message[:1].lower() + message[1:])


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
