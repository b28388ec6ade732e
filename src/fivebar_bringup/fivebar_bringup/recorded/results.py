# SPDX-License-Identifier: Apache-2.0
"""Result directories, and atomic writing of their files, with one-line errors."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import Any, TypeVar

from fivebar_description.files import LARGEST_TABLE, read_text, replace_file
from fivebar_description.strict_yaml import InputError, StrictModel, validate

M = TypeVar("M", bound=StrictModel)

FIGURES = "figures"
"""Folder of the PNG figures in every result directory."""


def new_directory(out: Path | None, name: str) -> Path:
    """Make a new result directory, by default runs/NAME-DATE-TIME, with unsuitable characters replaced by a dash.

    Raises:
        InputError: the directory is not empty or cannot be made.
    """
    stem = re.sub(r"[^\w.-]+", "-", name)
    path = out if out is not None else Path("runs") / f"{stem}-{datetime.now():%Y%m%d-%H%M%S-%f}"
    with write_errors(path):
        path.mkdir(parents=True, exist_ok=True)
        if any(path.iterdir()):
            raise InputError(f"{path}: is not empty: expected a new or empty directory for the results")
    return path


def write_results(
    directory: Path, files: Mapping[str, str | bytes], figures: Mapping[str, bytes] | None = None
) -> None:
    """Write files into a directory, each atomically, so that a reader finds either the old or the new content.

    Args:
        directory: an existing directory.
        files: content by name; texts are encoded as UTF-8.
        figures: PNGs by stem for the folder of figures, which is made if needed; written before the files.

    Raises:
        InputError: the directory cannot be written to.
    """
    with write_errors(directory):
        if figures is not None:
            folder = directory / FIGURES
            folder.mkdir(exist_ok=True)
            for stem, png in figures.items():
                replace_file(folder / f"{stem}.png", png)
        for name, content in files.items():
            replace_file(directory / name, content if isinstance(content, bytes) else content.encode("utf-8"))


@contextmanager
def write_errors(directory: Path) -> Iterator[None]:
    """Turn an operating system error on writing, such as a full disk, into a one-line error.

    Raises:
        InputError: the block raised an OSError; the text has its file, or else the directory.
    """
    try:
        yield
    except OSError as error:
        place = error.filename if isinstance(error.filename, str) else directory
        raise InputError(f"{place}: cannot be used for the results: {error.strerror}") from error


def read_json(path: Path, model: type[M]) -> M:
    """Read a JSON file that a program has written with its results.

    Raises:
        InputError: the file cannot be read, or has unexpected content.
    """
    try:
        content = json.loads(read_text(path, LARGEST_TABLE))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: is not valid JSON: {error}") from error
    return validate(content, model, str(path))


def json_text(content: Any) -> str:
    """Return plain values as JSON text, with null for NaN and infinities."""
    return json.dumps(finite(content), indent=2, allow_nan=False) + "\n"


def finite(content: Any) -> Any:
    """Return plain values with None for NaN and infinities, which JSON cannot represent."""
    if isinstance(content, float):
        return content if math.isfinite(content) else None
    if isinstance(content, Mapping):
        return {key: finite(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [finite(value) for value in content]
    return content
