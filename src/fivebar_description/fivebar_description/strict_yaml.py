"""YAML files read into typed, immutable models; every mistake is named by file, key, value and expectation."""

from __future__ import annotations

from collections.abc import Hashable
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

M = TypeVar("M", bound="StrictModel")


class InputError(ValueError):
    """Bad input from a person: one line that names the place, the value and what was expected."""


class StrictModel(BaseModel):
    """A frozen section of a file: unknown keys, wrong types, NaN and infinities are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class _UniqueKeyLoader(yaml.SafeLoader):
    """The safe loader, which also refuses a key given twice (YAML would silently keep the last)."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, Hashable):
                raise yaml.constructor.ConstructorError(None, None, "a key must be a plain word", key_node.start_mark)
            if key in seen:
                raise yaml.constructor.ConstructorError(None, None, f"key {key!r} is given twice", key_node.start_mark)
            seen.add(key)
        return super().construct_mapping(node, deep)


def read_yaml(path: Path, model: type[M]) -> M:
    """Read one file into `model`.

    Raises:
        InputError: the file is missing, not YAML, or does not fit the model.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text") from error
    try:
        # _UniqueKeyLoader is a SafeLoader
        content = yaml.load(text, Loader=_UniqueKeyLoader)
    except yaml.YAMLError as error:
        raise InputError(f"{path}: is not valid YAML: {' '.join(str(error).split())}") from error
    return validate(content, model, str(path))


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
        problems = "; ".join(_problem(detail) for detail in error.errors(include_url=False))
        raise InputError(f"{source}: {problems}") from error


def _problem(detail: Any) -> str:
    key = ".".join(str(part) for part in detail["loc"])
    if detail["type"] == "extra_forbidden":
        return f"{key}: unknown key"
    if detail["type"] == "missing":
        return f"{key}: is missing"
    expectation = detail["msg"].removeprefix("Value error, ")
    expectation = expectation[:1].lower() + expectation[1:]
    return f"{key}: {detail['input']!r}: {expectation}" if key else expectation
