"""YAML 1.2 files read into typed, immutable models; every mistake is named by file, key, value and expectation."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from fivebar_description.errors import InputError as InputError

M = TypeVar("M", bound="StrictModel")

DEEPEST_NESTING = 100
"""Levels of a text whose nodes are asked for; the parser's time grows with their square."""

NESTED_TOO_DEEPLY = "is nested too deeply"


class StrictModel(BaseModel):
    """A frozen section of a file: unknown keys, wrong types, NaN and infinities are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


def read_yaml(path: Path, model: type[M]) -> M:
    """Read one file into `model`.

    Raises:
        InputError: the file is missing, not YAML, or does not fit the model.
    """
    return validate(load_yaml(path), model, str(path))


def load_yaml(path: Path) -> object:
    """Return the content of a YAML 1.2 file as plain values.

    Here `3e4` and `3.0e4` are numbers, and `on` and `yes` are words; to YAML 1.1, which ROS reads its parameter files
    with, they are the other way round. A key given twice is refused, and so is a tag that asks for a Python object.

    Raises:
        InputError: the file is missing or not YAML.
    """
    return parse_yaml(read_text(path), str(path))


def read_text(path: Path) -> str:
    """Return the text of a file, its line ends as they are.

    Raises:
        InputError: the file is missing or not UTF-8 text.
    """
    try:
        return path.read_bytes().decode("utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text") from error


def parse_yaml(text: str, source: str) -> object:
    """Return text in YAML 1.2 as plain values; `source` starts every error.

    Raises:
        InputError: it is not YAML.
    """
    # here, because most importers of this module read no file
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    try:
        # the pure parser: the other one, in C, reads YAML 1.1
        return YAML(typ="safe", pure=True).load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        # without advice to programmers, and of a key given twice without its values, which can be sections
        problem = _one_line(error.problem or error.context).partition(" with value")[0]
        raise InputError(f"{source}: is not valid YAML: {place}{problem}") from error
    except (YAMLError, ValueError, TypeError) as error:
        # a ValueError comes of a date without such a day, or of a wrong tag such as `!!int x`; a TypeError of a key
        # that is a sequence of mappings
        raise InputError(f"{source}: is not valid YAML: {_one_line(error)}") from error
    except RecursionError as error:
        raise InputError(f"{source}: {NESTED_TOO_DEEPLY}") from error


def yaml_nodes(text: str, source: str) -> Any:
    """Return the nodes of a text with their places; None where it is not YAML, as `parse_yaml` then reports.

    Raises:
        InputError: a node refers to another one, so that its content may be exponentially larger than the text, or it
            is nested more than `DEEPEST_NESTING` levels deep.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError
    from ruamel.yaml.events import AliasEvent, CollectionEndEvent, CollectionStartEvent

    depth = 0
    try:
        for event in YAML(typ="safe", pure=True).parse(text):
            depth += isinstance(event, CollectionStartEvent) - isinstance(event, CollectionEndEvent)
            if depth > DEEPEST_NESTING:
                raise InputError(f"{source}: {NESTED_TOO_DEEPLY}")
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


def _one_line(words: object) -> str:
    return " ".join(str(words).split())


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
        raise InputError(f"{source}: {problems_in(error)}") from error


def problems_in(error: ValidationError, section: str = "") -> str:
    """Return what is wrong in one line, every key with the section that it stands in."""
    details = error.errors(include_url=False)
    return "; ".join(section + _problem(detail) for detail in details if not _only_lacks_refused(detail))


def _only_lacks_refused(detail: Any) -> bool:
    """Return whether a sequence is called too short although it is not: pydantic leaves out its refused elements."""
    return bool(detail["type"] == "too_short" and len(detail["input"]) >= detail["ctx"]["min_length"])


def _problem(detail: Any) -> str:
    key = ".".join(_in_line(str(part)) for part in detail["loc"])
    if detail["type"] == "extra_forbidden":
        return f"{key}: unknown key"
    if detail["type"] == "missing":
        return f"{key}: is missing"
    expectation = detail["msg"].removeprefix("Value error, ")
    if not expectation.isprintable():
        # it quotes a value with a line break
        expectation = _one_line(expectation)
    expectation = expectation[:1].lower() + expectation[1:]
    return f"{key}: {detail['input']!r}: {expectation}" if key else expectation


def _in_line(key: str) -> str:
    """Return a key as it is written, or quoted where it would break the line."""
    return key if key.isprintable() else repr(key)
