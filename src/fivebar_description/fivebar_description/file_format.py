"""The version of a file's format, which is checked first."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, TypeVar

from fivebar_description.errors import InputError
from fivebar_description.settings import Setting
from fivebar_description.strict_yaml import StrictModel, parse_yaml, read_text, validate

M = TypeVar("M", bound=StrictModel)

KEY = "format"
NEWEST = 1
"""Of scenarios, robot files and programs, and that of files without the key, which it stays after there is a 2."""

OTHERS = {
    True: "a newer release of fivebar reads this file",
    False: "fivebar 1.0.0 brings a file of format 0 up to date: fivebar migrate",
}
"""What to do with a file of another format, by whether it is newer."""


def _is_newest(number: int) -> str | None:
    return None if number == NEWEST else f"expected {NEWEST}"


Format = Annotated[
    int, Setting("Version of the file's format; docs/reference/stability.md says what it promises.", check=_is_newest)
]
"""The key in a model."""


def read_versioned(path: Path, model: type[M], placed: Callable[[Any], Any] | None = None) -> M:
    """Read one file into `model`.

    Args:
        path: of the file.
        model: what it has to fit.
        placed: returns the parsed content with what depends on the place of the file, such as names of other files.

    Raises:
        InputError: the file is missing, not YAML, of another format, or does not fit the model.
    """
    return parse_versioned(read_text(path), str(path), model, placed)


def parse_versioned(text: str, source: str, model: type[M], placed: Callable[[Any], Any] | None = None) -> M:
    """Read the text of a file as `read_versioned` does; `source` starts every error.

    Raises:
        InputError: it is not YAML, of another format, or does not fit the model.
    """
    content = parse_versioned_content(text, source)
    return validate(content if placed is None else placed(content), model, source)


def parse_versioned_content(text: str, source: str) -> object:
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
