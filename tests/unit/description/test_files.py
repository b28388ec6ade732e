# SPDX-License-Identifier: Apache-2.0
"""Files from outside: regular files of bounded size in UTF-8, and YAML whose content is as large as it looks."""

from __future__ import annotations

import os
import stat
import tracemalloc
from pathlib import Path

import pytest

from fivebar_description.errors import InputError, quoted
from fivebar_description.files import is_file, read_text, write_file
from fivebar_description.strict_yaml import parse_yaml

BOM = b"\xef\xbb\xbf"


def refusal_of(path: Path, largest: int = 1000) -> str:
    with pytest.raises(InputError) as refused:
        read_text(path, largest)
    (line,) = str(refused.value).splitlines()
    return line


def test_what_is_no_file_of_text_is_refused_at_once(tmp_path: Path) -> None:
    pipe, folder, endless, large = (tmp_path / name for name in ("pipe", "folder", "endless", "large"))
    os.mkfifo(pipe)
    folder.mkdir()
    endless.symlink_to("/dev/zero")
    with large.open("wb") as file:
        file.truncate(6_000_000_000)
    assert refusal_of(pipe).endswith("pipe: is a pipe: expected a file")
    assert refusal_of(folder).endswith("folder: is a directory: expected a file")
    assert refusal_of(endless).endswith("endless: is a device: expected a file")
    assert refusal_of(large).endswith("large: 6000000000 bytes: expected at most 1000")
    assert refusal_of(tmp_path / ("n" * 300)).endswith("cannot be read: File name too long")
    assert refusal_of(tmp_path / "a\0b").endswith("a\\x00b: is not the name of a file")
    assert not is_file(tmp_path / ("n" * 300))
    assert not is_file(tmp_path / "a\0b")


def test_a_byte_order_mark_is_no_part_of_the_text(tmp_path: Path) -> None:
    path = tmp_path / "text"
    path.write_bytes(BOM + b"a: 1\r\n")
    assert read_text(path) == "a: 1\r\n"
    path.write_bytes("a: 1".encode("utf-16"))
    assert refusal_of(path).endswith("begins with the byte order mark of UTF-16: expected UTF-8 text")


def test_a_name_cannot_speak_to_the_terminal(tmp_path: Path) -> None:
    line = refusal_of(tmp_path / "\x1b[31mred\nsecond \u202e line")
    assert "\\x1b[31mred\\nsecond \\u202e line: cannot be read" in line
    assert line.isprintable()


def test_a_file_that_cannot_be_written_stays_as_it_was(tmp_path: Path) -> None:
    path, link = tmp_path / "file", tmp_path / "link"
    path.write_text("old", encoding="utf-8")
    path.chmod(0o640)
    link.symlink_to(path)
    write_file(link, "new")
    assert (path.read_text(encoding="utf-8"), link.is_symlink()) == ("new", True)
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    with pytest.raises(InputError, match=r"missing/file: cannot be written: No such file or directory$"):
        write_file(tmp_path / "missing" / "file", "new")
    # a device is written to, and not replaced by a file
    with pytest.raises(InputError, match=r"^/dev/full: cannot be written: No space left on device$"):
        write_file(Path("/dev/full"), "new")
    assert stat.S_ISCHR(Path("/dev/full").stat().st_mode)


def bomb(levels: int) -> str:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    for level in range(1, levels):
        lines.append(f"a{level}: &a{level} [{', '.join([f'*a{level - 1}'] * 10)}]")
    return "\n".join(lines)


def test_references_are_written_out_within_bounds() -> None:
    content = parse_yaml("a: &a {b: 1}\nc: *a\nd: {<<: *a, e: 2}\n", "file")
    assert content == {"a": {"b": 1}, "c": {"b": 1}, "d": {"b": 1, "e": 2}}
    assert isinstance(parse_yaml(bomb(4), "file"), dict)
    tracemalloc.start()
    with pytest.raises(InputError, match=r"^file: line 5: more than 100000 values, written out"):
        parse_yaml(bomb(10), "file")
    assert tracemalloc.get_traced_memory()[1] < 5e6
    tracemalloc.stop()
    with pytest.raises(InputError, match=r"^file: \*a: stands within what it refers to$"):
        parse_yaml("a: &a [1, *a]\n", "file")


def test_a_long_value_is_quoted_in_part() -> None:
    assert quoted("x" * 1000) == "'" + "x" * 119 + "..."
    assert quoted(1 << 20000) == "a number of thousands of digits"
