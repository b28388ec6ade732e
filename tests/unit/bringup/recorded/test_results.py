# SPDX-License-Identifier: Apache-2.0
"""Results reach the disk whole, and a disk that takes nothing is an error of one line."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from full_disk import full_at

from fivebar_bringup.pages.content import Picture
from fivebar_bringup.pages.study_directory import StudyDirectory
from fivebar_bringup.recorded.results import json_text, new_directory, write_results
from fivebar_description.strict_yaml import InputError


def test_a_default_directory_is_named_after_what_is_made(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    directory = new_directory(None, "map-lab / robot")
    assert re.fullmatch(r"map-lab-robot-\d{8}-\d{6}-\d{6}", directory.name)
    assert directory.parent == Path("runs")


def test_a_directory_in_use_and_a_file_are_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="is not empty"):
        new_directory(tmp_path, "run")
    with pytest.raises(InputError, match="file: cannot be used for the results: "):
        new_directory(tmp_path / "file", "run")


def test_files_and_figures_are_written(tmp_path: Path) -> None:
    write_results(tmp_path, {"a.html": "ä", "b.png": b"\x89"}, {"c": b"png"})
    assert (tmp_path / "a.html").read_bytes() == "ä".encode()
    assert (tmp_path / "b.png").read_bytes() == b"\x89"
    assert (tmp_path / "figures" / "c.png").read_bytes() == b"png"


@pytest.mark.parametrize("written", range(4))
def test_a_full_disk_is_one_line_and_keeps_what_was_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, written: int
) -> None:
    """The disk runs full at each of the files in turn; those before are new, the others whole as they were."""
    study = StudyDirectory(tmp_path, "study")
    files = [study.content, tmp_path / "more.csv", tmp_path / "figures" / "p.png", study.page]
    study.write("old", {"x": 0}, [Picture("p", "", b"old")], {"more.csv": "old"})
    before = [file.read_bytes() for file in files]
    full_at(monkeypatch, written)
    with pytest.raises(InputError) as error:
        study.write("new", {"x": 1}, [Picture("p", "", b"new")], {"more.csv": "new"})
    assert str(error.value) == f"{files[written]}: cannot be used for the results: No space left on device"
    changed = [file.read_bytes() != content for file, content in zip(files, before, strict=True)]
    assert changed == [number < written for number in range(4)]
    assert not [path for path in tmp_path.rglob("*") if path.name.startswith(".")]


def test_json_has_null_for_what_json_lacks() -> None:
    text = json_text({"a": (float("nan"), 1.0), "b": [float("inf")], "c": "x"})
    assert json.loads(text) == {"a": [None, 1.0], "b": [None], "c": "x"}
    assert text.endswith("}\n")
