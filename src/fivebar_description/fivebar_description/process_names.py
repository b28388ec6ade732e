# SPDX-License-Identifier: Apache-2.0
"""Who a process is that does not belong to a run, in words, as far as the system tells every user."""

from __future__ import annotations

import os
import pwd
from pathlib import Path

from fivebar_description.outside_text import one_line

PROC = Path("/proc")

LONGEST_COMMAND = 120
"""Largest number of characters of a command line that is shown."""


def describe_process(pid: object) -> str:
    """Return number, name and user of a process and the command that started it, "unknown" where it is no process."""
    if not isinstance(pid, int):
        return "an unknown process"
    try:
        name = (PROC / str(pid) / "comm").read_text(encoding="utf-8", errors="replace").strip()
        user = _user_name((PROC / str(pid)).stat().st_uid)
        parent = _parent(pid)
        words = (PROC / str(parent) / "cmdline").read_bytes().decode("utf-8", "replace").split("\0")
    except (OSError, ValueError, IndexError):
        return f"process {pid}, which is not on this machine"
    # the interpreter's path says nothing
    command = " ".join(os.path.basename(word) if word.startswith("/") else word for word in words if word)
    return f"process {pid} ({one_line(name)}) of user {user}, started by {one_line(command, LONGEST_COMMAND)}"


def _parent(pid: int) -> int:
    # the name, in brackets, may have spaces
    return int((PROC / str(pid) / "stat").read_text(encoding="utf-8", errors="replace").rsplit(")", 1)[1].split()[1])


def _user_name(uid: int) -> str:
    try:
        return pwd.getpwuid(uid).pw_name
    except KeyError:
        return str(uid)
