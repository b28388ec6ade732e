"""Where a package's data files are: in the source tree, in a colcon or ROS installation, or in a plain pip one."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from fivebar_description.errors import InputError
from fivebar_description.suggestion import expected_one_of
from fivebar_description.text_file import is_file


@cache
def share_file(package: str, *parts: str) -> Path:
    """Return the path of a data file of `package`, such as ("fivebar_description", "config", "dextar.yaml").

    The source tree comes first, so that an editable or symlinked installation shows edits at once; then the
    installation prefix that holds the package. The file itself need not exist. It is found once, since robots are asked
    for by name again and again.

    Raises:
        ModuleNotFoundError: the package is not installed.
    """
    spec = importlib.util.find_spec(package)
    if spec is None or spec.origin is None:
        raise ModuleNotFoundError(f"package {package} is not installed")
    module = Path(spec.origin).resolve()
    source = module.parents[1]
    if (source / "package.xml").is_file():
        return source.joinpath(*parts)
    for prefix in (*module.parents, Path(sys.prefix)):
        if (prefix / "share" / package / "package.xml").is_file():
            return prefix.joinpath("share", package, *parts)
    return Path(sys.prefix, "share", package, *parts)


def is_yaml_path(name: str) -> bool:
    """Return whether a name is the path of a YAML file, not that of a shipped one."""
    return name.endswith((".yaml", ".yml"))


def placed_beside(folder: Path, content: Any, *places: tuple[str, ...]) -> Any:
    """Return a file's content in which names of other YAML files that lie beside it are paths.

    A name of which no file lies there is left as it is: it is that of a shipped file, or relative to the working
    directory.

    Args:
        folder: of the file.
        content: as parsed.
        places: where names of files stand, each the keys that lead there.
    """
    for first, *rest in places:
        inside = content.get(first) if isinstance(content, Mapping) else None
        if rest:
            content = content if inside is None else {**content, first: placed_beside(folder, inside, tuple(rest))}
        elif isinstance(inside, str) and is_yaml_path(inside) and is_file(folder / inside):
            content = {**content, first: str(folder / inside)}
    return content


def yaml_path(what: str, name: str, *folders: Path) -> Path:
    """Return a YAML file by its shipped name or by its path.

    Args:
        what: what the file describes, for the message.
        name: name of a shipped file without its ending, or a path that ends in .yaml or .yml.
        folders: where the shipped files are.

    Raises:
        InputError: no file of that name is shipped.
    """
    if is_yaml_path(name):
        return Path(name)
    shipped = {file.stem: file for folder in folders for file in folder.glob("*.yaml")}
    if name not in shipped:
        raise InputError(f"{what} {name!r}: {expected_one_of(name, sorted(shipped), ', or a path to a .yaml file')}")
    return shipped[name]
