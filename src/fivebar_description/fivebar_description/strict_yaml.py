# SPDX-License-Identifier: Apache-2.0
"""YAML 1.2 files read into typed, immutable models; every mistake is named by file, key, value and expectation.

The version of a file's format is checked first.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache, partial
from itertools import accumulate
from pathlib import Path
from typing import Annotated, Any, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from fivebar_description.errors import InputError, unwrapped
from fivebar_description.files import placed_beside, read_text
from fivebar_description.refusals import problems_in
from fivebar_description.settings import Setting

__all__ = [
    "InputError",
    "StrictModel",
    "load_yaml",
    "parse_yaml",
    "read_text",
    "read_yaml",
    "validate",
    "yaml_nodes",
    "yaml_text",
]

M = TypeVar("M", bound="StrictModel")

DEEPEST_NESTING = 100
"""Levels of a text that is read; the parser's time grows with their square."""

MOST_VALUES = 100_000
"""Values of a text in which parts refer to others, counted as often as they are referred to."""

BRACKETS = {"[": 1, "{": 1, "]": -1, "}": -1}

LEADING = re.compile(r"[-? ]*")
"""The beginning of a line: a level of blocks takes one of these characters at least."""

NESTED_TOO_DEEPLY = "is nested too deeply"

KEY = "format"

NEWEST = 1
"""Newest format of scenarios, robot files and programs, and that of files without the key, which it stays after
there is a 2."""

OTHERS = {
    True: "a newer release of fivebar reads this file",
    False: "fivebar 1.0.0 brings a file of format 0 up to date: fivebar migrate",
}
"""Advice for a file of another format, by whether it is newer."""


class StrictModel(BaseModel):
    """A frozen section of a file: unknown keys, wrong types, NaN and infinities are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


def read_yaml(path: Path, model: type[M], *files: tuple[str, ...]) -> M:
    """Read one file into `model`; `files` are the keys that lead to names of other files, which may lie beside it.

    Raises:
        InputError: the file is missing, not YAML, or does not fit the model.
    """
    return validate(placed_beside(path.parent, load_yaml(path), *files), model, str(path))


def load_yaml(path: Path) -> object:
    """Return the content of a YAML 1.2 file as plain values.

    Here `3e4` and `3.0e4` are numbers, and `on` and `yes` are words; to YAML 1.1, which ROS reads its parameter files
    with, they are the other way round. A key given twice is refused, and so is a tag that asks for a Python object.

    Raises:
        InputError: the file is missing or not YAML.
    """
    return parse_yaml(read_text(path), str(path))


def parse_yaml(text: str, source: str) -> object:
    """Return text in YAML 1.2 as plain values; `source` starts every error.

    Raises:
        InputError: it is not YAML.
    """
    # here, because most importers of this module read no file
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    if _may_be_deep(text):
        _refuse_depth(text, source)
    if "&" in text and "*" in text:
        _refuse_expansion(text, source)
    try:
        # the pure parser: the other one, in C, reads YAML 1.1
        return YAML(typ="safe", pure=True).load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        # without advice to programmers, and of a key given twice without its values, which can be sections
        problem = unwrapped(error.problem or error.context).partition(" with value")[0]
        raise InputError(f"{source}: is not valid YAML: {place}{problem}") from error
    except (YAMLError, ValueError, TypeError) as error:
        # a ValueError comes of a date without such a day, or of a wrong tag such as `!!int x`; a TypeError of a key
        # that is a sequence of mappings
        raise InputError(f"{source}: is not valid YAML: {unwrapped(error)}") from error
    except RecursionError as error:
        raise InputError(f"{source}: {NESTED_TOO_DEEPLY}") from error


def _may_be_deep(text: str) -> bool:
    """Return whether brackets, dashes or indentation of a text may be those of more than `DEEPEST_NESTING` levels."""
    brackets = accumulate(BRACKETS.get(sign, 0) for sign in text if sign in BRACKETS)
    return max(brackets, default=0) > DEEPEST_NESTING or any(
        len(LEADING.match(line)[0]) > DEEPEST_NESTING  # type: ignore[index]
        for line in text.splitlines()
    )


def _refuse_depth(text: str, source: str) -> None:
    """Refuse a text that is nested more than `DEEPEST_NESTING` levels deep; leave what is not YAML.

    Raises:
        InputError: it is.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError
    from ruamel.yaml.events import CollectionEndEvent, CollectionStartEvent

    depth = 0
    try:
        for event in YAML(typ="safe", pure=True).parse(text):
            depth += isinstance(event, CollectionStartEvent) - isinstance(event, CollectionEndEvent)
            if depth > DEEPEST_NESTING:
                break
    except (YAMLError, ValueError, RecursionError):
        return
    if depth > DEEPEST_NESTING:
        raise InputError(f"{source}: {NESTED_TOO_DEEPLY}: more than {DEEPEST_NESTING} levels")


def _refuse_expansion(text: str, source: str) -> None:
    """Refuse a text that is exponentially larger once what it refers to is written out; leave what is not YAML.

    Raises:
        InputError: it stands for more than `MOST_VALUES` values, or a part of it contains itself.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError
    from ruamel.yaml.events import AliasEvent, CollectionEndEvent, CollectionStartEvent, ScalarEvent

    sizes: dict[str, int] = {}
    open_parts: list[tuple[str | None, int]] = []
    count = 0
    try:
        for event in YAML(typ="safe", pure=True).parse(text):
            if isinstance(event, CollectionStartEvent):
                open_parts.append((event.anchor, count))
                count += 1
            elif isinstance(event, CollectionEndEvent):
                anchor, before = open_parts.pop()
                if anchor is not None:
                    sizes[anchor] = count - before
            elif isinstance(event, ScalarEvent):
                count += 1
                if event.anchor is not None:
                    sizes[event.anchor] = 1
            elif isinstance(event, AliasEvent):
                if event.anchor in (anchor for anchor, _ in open_parts):
                    raise InputError(f"{source}: *{event.anchor}: stands within what it refers to")
                count += sizes.get(event.anchor, 0)
            if count > MOST_VALUES:
                line = event.start_mark.line + 1
                raise InputError(
                    f"{source}: line {line}: more than {MOST_VALUES} values, written out: expected fewer references"
                )
    except InputError:
        raise
    except (YAMLError, ValueError, RecursionError):
        return


def yaml_nodes(text: str, source: str) -> Any:
    """Return the nodes of a text with their places; None where it is not YAML, as `parse_yaml` then reports.

    Raises:
        InputError: a node refers to another one, so that its content may be exponentially larger than the text, or it
            is nested more than `DEEPEST_NESTING` levels deep.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError
    from ruamel.yaml.events import AliasEvent

    _refuse_depth(text, source)
    try:
        for event in YAML(typ="safe", pure=True).parse(text):
            if isinstance(event, AliasEvent):
                line = event.start_mark.line + 1
                raise InputError(f"{source}: line {line}: *{event.anchor}: expected what it stands for, written out")
        return YAML(typ="safe", pure=True).compose(text)
    except InputError:
        raise
    except (YAMLError, ValueError, RecursionError):
        return None


def yaml_text(content: Mapping[str, Any]) -> str:
    """Return plain values as YAML that means the same to readers of YAML 1.1 and 1.2, keys in their order."""
    return yaml.dump(content, Dumper=_Dumper, sort_keys=False)


class _Dumper(yaml.SafeDumper):
    """Writes YAML 1.1, with quotes around words that only YAML 1.2 takes for numbers, such as `3e4`."""


_Dumper.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|0o[0-7]+"),
    list("-+.0123456789"),
)


def validate(content: object, model: type[M], source: str) -> M:
    """Fit parsed content into `model`; `source` (usually the file's path) starts every error.

    Raises:
        InputError: one line naming the source, the key, the value and what was expected.
    """
    if not isinstance(content, dict):
        raise InputError(f"{source}: expected keys with values, found {type(content).__name__}")
    try:
        return model.model_validate(content)
    except ValidationError as error:
        schema = partial(_schema_of, model)
        raise InputError(f"{source}: {problems_in(error, content=content, schema=schema)}") from error


@cache
def _schema_of(model: type[BaseModel]) -> Mapping[str, Any]:
    """Return the JSON Schema of a model, which takes a tenth of a second to make."""
    return model.model_json_schema()


def _is_newest(number: int) -> str | None:
    return None if number == NEWEST else f"expected {NEWEST}"


Format = Annotated[
    int, Setting("Version of the file's format; docs/reference/stability.md says what it promises.", check=_is_newest)
]
"""The key in a model."""


def parse_versioned(text: str, source: str) -> object:
    """Return the content of a file's text as plain values; `source` starts every error.

    Raises:
        InputError: it is not YAML, or names another format, whatever else it holds.
    """
    content = parse_yaml(text, source)
    number = content.get(KEY, NEWEST) if isinstance(content, dict) else NEWEST
    if type(number) is int and number == NEWEST:
        return content
    known = type(number) is int and (number == 0 or number > NEWEST)
    advice = f"; {OTHERS[number > NEWEST]}" if known else ""
    raise InputError(f"{source}: {KEY}: {number!r}: this release understands format {NEWEST}{advice}")
