"""A DDS domain of its own for each run, so that runs and tests at the same time do not hear each other."""

from __future__ import annotations

import fcntl
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from fivebar_description.strict_yaml import InputError

PRIVATE_DOMAINS = range(20, 100)
"""Domains to choose from: above the ones that people pick by hand, below those whose ports Linux gives away."""


@contextmanager
def private_domain() -> Iterator[int]:
    """Hold a domain that no other run of this user holds; a lock file keeps it, also against killed holders.

    Raises:
        InputError: all domains are held.
    """
    folder = _folder()
    folder.mkdir(mode=0o700, exist_ok=True)
    for domain in PRIVATE_DOMAINS:
        with (folder / str(domain)).open("w") as lock:
            if _take(lock):
                yield domain
                return
    raise InputError(f"no free DDS domain between {PRIVATE_DOMAINS.start} and {PRIVATE_DOMAINS.stop - 1}")


def held_domains() -> list[int]:
    """Return the domains that runs of this user hold at the moment."""
    held = []
    for path in _folder().glob("*"):
        with path.open("w") as lock:
            if path.name.isdecimal() and not _take(lock):
                held.append(int(path.name))
    return sorted(held)


def _folder() -> Path:
    return Path(tempfile.gettempdir()) / f"fivebar-domains-{os.getuid()}"


def _take(lock: IO[str]) -> bool:
    """Return whether a lock could be taken; it is held until its file is closed."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
