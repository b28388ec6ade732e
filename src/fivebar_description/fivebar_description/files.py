# SPDX-License-Identifier: Apache-2.0
"""Files: where those of a package and those that a user names are, and their content as bytes or text.

What is read from outside is a regular file of bounded size; everything else is refused in one line.
"""

from __future__ import annotations

import codecs
import importlib.util
import os
import stat
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

from fivebar_description.errors import InputError
from fivebar_description.suggestion import expected_one_of

LARGEST_TEXT = 1_000_000
"""Bytes of a file that people write, such as a scenario, robot file or program."""

LARGEST_TABLE = 512_000_000
"""Bytes of a file that programs write, such as the rows of a sweep or a picture."""

KINDS = {
    stat.S_IFDIR: "a directory",
    stat.S_IFIFO: "a pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}

YAML = (".yaml", ".yml")
NAMED_BY_PATH = (*YAML, ".csv")
"""Endings of files that other files name by their paths."""

UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


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
    return name.endswith(YAML)


def placed_beside(folder: Path, content: Any, *places: tuple[str, ...]) -> Any:
    """Return a file's content in which names of other files, YAML or CSV, that lie beside it are paths.

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
        elif isinstance(inside, str) and inside.endswith(NAMED_BY_PATH) and is_file(folder / inside):
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


def read_bytes(path: Path, largest: int = LARGEST_TABLE) -> bytes:
    """Return the content of a regular file.

    Devices and pipes, which may have no end or never begin, are refused without reading.

    Args:
        path: of the file.
        largest: size (bytes) beyond which it is refused.

    Raises:
        InputError: the file is missing, is none, is too large or cannot be read.
    """
    try:
        # a pipe that nobody writes to would block
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise InputError(f"{path}: is not the name of a file") from error
    try:
        status = os.fstat(descriptor)
        kind = KINDS.get(stat.S_IFMT(status.st_mode))
        if kind is not None:
            raise InputError(f"{path}: is {kind}: expected a file")
        # the size that is known may be less than what is read, as in /proc
        with open(descriptor, "rb", closefd=False) as file:
            content = file.read(largest + 1) if status.st_size <= largest else b""
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    finally:
        os.close(descriptor)
    size = max(status.st_size, len(content))
    if size > largest:
        raise InputError(f"{path}: {size} bytes: expected at most {largest}")
    return content


def endless_kind(path: Path) -> str | None:
    """Return what a path is that may have no end or never begin, such as "a pipe"; None for files and directories."""
    try:
        status = path.stat()
    except OSError:
        return None
    return None if stat.S_ISDIR(status.st_mode) else KINDS.get(stat.S_IFMT(status.st_mode))


def read_text(path: Path, largest: int = LARGEST_TEXT) -> str:
    """Return the text of a regular file, its line ends as they are, without a byte order mark.

    Raises:
        InputError: the file cannot be read as `read_bytes` does, or is not UTF-8 text.
    """
    content = read_bytes(path, largest)
    if content.startswith(UTF_16):
        raise InputError(f"{path}: begins with the byte order mark of UTF-16: expected UTF-8 text")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text") from error


def write_file(path: Path, content: str | bytes) -> None:
    """Write a file that a user named; one that cannot be written as a whole stays as it was.

    Raises:
        InputError: it cannot be written.
    """
    data = content.encode("utf-8") if isinstance(content, str) else content
    try:
        if path.exists() and not path.is_file():
            # a device or a pipe is written to, not replaced
            path.write_bytes(data)
        else:
            replace_file(path.resolve(), data)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from error


def replace_file(path: Path, content: bytes) -> None:
    """Replace the file's content atomically: at any instant it has either the complete old or the complete new one.

    Raises:
        OSError: it cannot be written; the error names it.
    """
    new = path.with_name(f".{path.name}.new")
    with _named(path):
        try:
            new.write_bytes(content)
            if path.exists():
                new.chmod(stat.S_IMODE(path.stat().st_mode))
            os.replace(new, path)
        except BaseException:
            with suppress(OSError):
                new.unlink()
            raise


def append_to_file(path: Path, content: bytes) -> None:
    """Append to a file, which is with the operating system as a whole when this returns.

    Raises:
        OSError: it cannot be written, and is as it was; the error names it.
    """
    with _named(path), path.open("ab", buffering=0) as file:
        size = file.seek(0, os.SEEK_END)
        try:
            left = memoryview(content)
            while left:
                left = left[file.write(left) :]
        except BaseException:
            with suppress(OSError):
                file.truncate(size)
            raise


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Have the errors of the operating system name this file: those of writing name none."""
    try:
        yield
    except OSError as error:
        error.filename, error.filename2 = str(path), None
        raise


def is_file(path: Path) -> bool:
    """Return whether there is a file of this name; False for what can be no name, which `Path.is_file` raises of."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
