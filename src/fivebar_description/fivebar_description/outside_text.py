"""Bounded reader of texts that come from other processes: JSON on String topics, in bags, and from a page.

A text is read within limits of size and nesting, and its fields are checked before anything uses them. Whatever is
refused raises `MessageError`, never anything else.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from fivebar_description.joint_sample import MessageError

LONGEST_TEXT = 262_144
"""Largest number of characters of a text that is read; the plan of a run with thousands of waypoints fits."""

DEEPEST = 16
"""Largest number of lists and objects within each other."""

LONGEST_LINE = 500
"""Largest number of characters of another process' text that is shown or passed on."""

LARGEST_COUNT = 2**53
"""Largest whole number that every reader of JSON represents exactly."""


class Field(NamedTuple):
    """A field of a JSON object: what it has to be, in words, and whether it has to be there."""

    fits: Callable[[Any], bool]
    expected: str
    needed: bool = False


def one_line(text: str, longest: int = LONGEST_LINE) -> str:
    """Return a text from outside as one line that can be logged, published and printed: shortened, escapes visible."""
    shown = text[:longest]
    if not shown.isprintable():
        shown = "".join(one if one.isprintable() else one.encode("unicode_escape").decode() for one in shown)[:longest]
    return shown if len(text) <= longest else f"{shown}..."


def read_object(text: str | bytes, fields: Mapping[str, Field] | None = None) -> dict[str, Any]:
    """Return the JSON object in a text; fields beyond those that are checked are left as they are.

    Raises:
        MessageError: it is too long or too deep, no JSON object, has text that is no Unicode, or a field does not fit.
    """
    if len(text) > LONGEST_TEXT:
        raise MessageError(f"{len(text)} characters, expected at most {LONGEST_TEXT}")
    try:
        content = json.loads(text)
    except (ValueError, RecursionError):
        raise MessageError("expected JSON") from None
    if not isinstance(content, dict):
        raise MessageError(f"expected a JSON object, found {type(content).__name__}")
    _check_depth_and_words(content)
    for name, (fits, expected, needed) in (fields or {}).items():
        if name not in content:
            if needed:
                raise MessageError(f"expected the field {name}")
        elif not fits(content[name]):
            raise MessageError(f"{name}: {one_line(repr(content[name]), 60)}, expected {expected}")
    return content


def _check_depth_and_words(content: Any) -> None:
    """Refuse a content that is nested too deeply, or has words that cannot be written as UTF-8."""
    level: list[Any] = [content]
    for _ in range(DEEPEST + 1):
        inner: list[Any] = []
        for one in level:
            if isinstance(one, dict):
                inner += one
                inner += one.values()
            elif isinstance(one, list):
                inner += one
            elif isinstance(one, str) and not is_unicode(one):
                raise MessageError(f"text {one_line(ascii(one), 60)}, expected Unicode")
        level = inner
        if not level:
            return
    raise MessageError(f"nested more than {DEEPEST} times")


def is_unicode(value: str) -> bool:
    """Return whether a text has no halves of characters, which cannot be written."""
    try:
        value.encode()
    except UnicodeEncodeError:
        return False
    return True


def is_number(value: Any) -> bool:
    """Return whether a value is a finite number that fits into a float."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return math.isfinite(value) if isinstance(value, float) else abs(value) <= LARGEST_COUNT


def is_whole(value: Any) -> bool:
    """Return whether a value is a whole number."""
    return isinstance(value, int) and not isinstance(value, bool)


def is_count(value: Any) -> bool:
    """Return whether a value is a whole number from 0 on."""
    return is_whole(value) and 0 <= value <= LARGEST_COUNT


def is_text(value: Any) -> bool:
    """Return whether a value is a text."""
    return isinstance(value, str)


def one_of(words: Sequence[str]) -> Callable[[Any], bool]:
    """Return a check whether a value is one of some words."""
    return lambda value: isinstance(value, str) and value in words


def list_of(check: Callable[[Any], bool], *lengths: int) -> Callable[[Any], bool]:
    """Return a check whether a value is a list of values that fit, of one of some lengths if there are any."""
    return lambda value: (
        isinstance(value, list) and (not lengths or len(value) in lengths) and all(check(one) for one in value)
    )


def either(*checks: Callable[[Any], bool]) -> Callable[[Any], bool]:
    """Return a check whether a value fits one of several checks."""
    return lambda value: any(check(value) for check in checks)


def is_none(value: Any) -> bool:
    """Return whether a value is null."""
    return value is None
