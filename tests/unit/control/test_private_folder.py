# SPDX-License-Identifier: Apache-2.0
"""Folders and files that others could write."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from fivebar_control.private_folder import writable_by_others

STRANGER = 54321


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = tmp_path / "around" / "kept"
    made.mkdir(parents=True)
    for path in (made, made.parent):
        path.chmod(0o755)
    return made


def test_a_folder_of_this_user_is_private_below_a_sticky_one_of_everybody(folder: Path) -> None:
    assert writable_by_others(folder) is None
    folder.parent.chmod(0o1777)
    assert writable_by_others(folder) is None
    # but not to write into itself, where others add what is not there yet
    folder.chmod(0o1777)
    assert writable_by_others(folder) == folder.resolve()


def test_what_others_can_write_is_named(folder: Path) -> None:
    folder.chmod(0o757)
    assert writable_by_others(folder) == folder.resolve()
    folder.chmod(0o755)
    folder.parent.chmod(0o777)
    assert writable_by_others(folder) == folder.parent
    folder.parent.chmod(0o755)
    file = folder / "code.nbi"
    file.touch(0o666)
    file.chmod(0o666)
    assert writable_by_others(folder, [file]) == file
    assert writable_by_others(folder) is None


def test_a_link_that_others_can_point_elsewhere_is_named(folder: Path, tmp_path: Path) -> None:
    open_to_all = tmp_path / "open"
    open_to_all.mkdir()
    open_to_all.chmod(0o777)
    (open_to_all / "link").symlink_to(folder)
    assert writable_by_others(open_to_all / "link") == open_to_all


@pytest.mark.skipif(os.geteuid() != 0, reason="gives files to another user and group")
def test_a_folder_or_a_file_of_another_user_is_not_private(folder: Path) -> None:
    file = folder / "code.nbc"
    file.touch(0o644)
    os.chown(file, STRANGER, -1)
    assert writable_by_others(folder, [file]) == file
    assert writable_by_others(folder, [file], trusted=[STRANGER]) is None
    os.chown(folder.parent, STRANGER, -1)
    assert writable_by_others(folder) == folder.parent


@pytest.mark.skipif(os.geteuid() != 0, reason="gives files to another user and group")
def test_a_group_of_others_may_not_write(folder: Path) -> None:
    os.chown(folder, -1, STRANGER)
    folder.chmod(0o775)
    assert writable_by_others(folder) == folder.resolve()
    folder.chmod(0o755)
    assert writable_by_others(folder) is None
