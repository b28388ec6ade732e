# SPDX-License-Identifier: Apache-2.0
"""Bounded reader of texts that come from other processes: JSON on String topics, in bags, and from a page.

A text is read within limits of size and nesting, and its fields are checked before anything uses them. Whatever is
refused raises `MessageError`, never anything else.
"""

from __future__ import annotations

import json
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from fivebar_description.errors import printable
from fivebar_description.joint_sample import MessageError
from fivebar_description.refusals import problems_in

LONGEST_TEXT = 262_144
"""Largest number of characters of a text that is read; the plan of a run with thousands of waypoints fits."""

DEEPEST = 16
"""Largest number of lists and objects within each other."""

LONGEST_LINE = 500
"""Largest number of characters of another process' text that is shown or passed on."""

LARGEST_COUNT = 2**53
"""Largest whole number that every reader of JSON represents exactly."""

Count = Annotated[int, Field(ge=0, le=LARGEST_COUNT)]
"""A whole number from 0 on."""

Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
"""Two numbers."""


class OutsideModel(BaseModel):
    """The fields of a JSON object that are checked; a default means that a field may be missing.

    The model is built when the first text is read, so that a node that reads none does not wait for it.
    """

    model_config = ConfigDict(strict=True, allow_inf_nan=False, defer_build=True)


def one_line(text: str, longest: int = LONGEST_LINE) -> str:
    """Return a text from outside as one line that can be logged, published and printed: shortened, escapes visible."""
    shown = printable(text[:longest])[:longest]
    return shown if len(text) <= longest else f"{shown}..."


def read_object(text: str | bytes, model: type[OutsideModel] | None = None) -> dict[str, Any]:
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
    if model is not None:
        check_fields(content, model)
    return content


def check_fields(content: dict[str, Any], model: type[OutsideModel]) -> None:
    """Check the fields of an object that has been read.

    Raises:
        MessageError: one does not fit.
    """
    try:
        model.model_validate(content)
    except ValidationError as error:
        raise MessageError(one_line(problems_in(error, content=content))) from None


def _check_depth_and_words(content: Any) -> None:
    """Refuse a content that is nested too deeply, or has words that cannot be written as UTF-8."""
    level: list[Any] = [content]
    for _ in range(DEEPEST + 1):
        inner: list[Any] = []
        for node in level:
            if isinstance(node, dict):
                inner += node
                inner += node.values()
            elif isinstance(node, list):
                inner += node
            elif isinstance(node, str) and not is_unicode(node):
                raise MessageError(f"text {one_line(ascii(node), 60)}, expected Unicode")
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
