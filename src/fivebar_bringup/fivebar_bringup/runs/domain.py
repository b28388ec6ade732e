"""A private DDS domain for each run, so that concurrent runs and tests do not receive each other's messages."""

from __future__ import annotations

import fcntl
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from fivebar_description.errors import InputError

PRIVATE_DOMAINS = range(20, 100)
"""Candidate domains: above those usually chosen by hand, below those whose ports are in Linux's ephemeral range."""


@contextmanager
def private_domain() -> Iterator[int]:
    """Reserve a domain that no other run of this user holds, by a lock that the kernel releases if the run is killed.

    Raises:
        InputError: all domains are in use.
    """
    folder = _folder()
    folder.mkdir(mode=0o700, exist_ok=True)
    for domain in PRIVATE_DOMAINS:
        with (folder / str(domain)).open("w") as lock:
            if _try_lock(lock):
                yield domain
                return
    raise InputError(f"no free DDS domain between {PRIVATE_DOMAINS.start} and {PRIVATE_DOMAINS.stop - 1}")


def held_domains() -> list[int]:
    """Return the domains that runs of this user currently hold."""
    held = []
    for path in _folder().glob("*"):
        with path.open("w") as lock:
            if path.name.isdecimal() and not _try_lock(lock):
                held.append(int(path.name))
    return sorted(held)


def _folder() -> Path:
    return Path(tempfile.gettempdir()) / f"fivebar-domains-{os.getuid()}"


def _try_lock(lock: IO[str]) -> bool:
    """Try to take a lock, which is then held until its file is closed; return whether it was free."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
