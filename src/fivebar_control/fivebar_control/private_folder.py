# SPDX-License-Identifier: Apache-2.0
"""Tells whether others could put files into a folder, from which code is loaded."""

from __future__ import annotations

import os
import stat
from collections.abc import Collection, Iterable
from functools import cache
from pathlib import Path

ROOT = 0
"""User who can write everywhere anyhow."""


def writable_by_others(folder: Path, files: Iterable[Path] = (), trusted: Collection[int] = ()) -> Path | None:
    """Return what others could write or replace of a folder, of folders around it or of files in it; None for nothing.

    Others are all users but this one, root, and those who are trusted. Folders around it count, also those that
    links lead through: who can write there can put another folder in its place, except where a sticky bit keeps them
    from it.

    Args:
        folder: that is there.
        files: that are in it.
        trusted: further users, by number.
    """
    users = {ROOT, os.geteuid(), *trusted}
    absolute, real = Path(os.path.abspath(folder)), folder.resolve()
    around = dict.fromkeys((*absolute.parents, *real.parents))
    for path in around:
        if not _kept_from_others(path, users, sticky=True):
            return path
    return next((path for path in (real, *files) if not _kept_from_others(path, users)), None)


def _kept_from_others(path: Path, users: Collection[int], sticky: bool = False) -> bool:
    """Return whether only some users can write to a path; to a sticky folder others may, if its entries are safe."""
    try:
        status = path.stat()
    except OSError:
        return False
    if status.st_uid not in users:
        return False
    if sticky and status.st_mode & stat.S_ISVTX:
        return True
    return not status.st_mode & stat.S_IWOTH and not (status.st_mode & stat.S_IWGRP and _has_others(status.st_gid))


@cache
def _has_others(group: int) -> bool:
    """Return whether a group is more than that of one user alone, as many systems give each user one."""
    # here, because Unix alone has them
    import grp
    import pwd

    if group == ROOT:
        return False
    try:
        members = set(grp.getgrgid(group).gr_mem)
    except KeyError:
        # a group that has no name, as in a container
        return group != os.getegid()
    members |= {account.pw_name for account in pwd.getpwall() if account.pw_gid == group}
    return bool(members - {pwd.getpwuid(os.geteuid()).pw_name})
