# SPDX-License-Identifier: Apache-2.0
"""A disk that is full: files cannot grow beyond a size, or none can be put in place."""

from __future__ import annotations

import errno
import os
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest


@contextmanager
def full_disk(room: int) -> Iterator[None]:
    """Let this process write no file of more bytes than `room`: writing more fails, as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def full_at(patch: pytest.MonkeyPatch, number: int) -> None:
    """Let the disk be full when a file is put in place by `os.replace` for the time of this number, from 0 on."""
    replace, numbers = os.replace, iter(range(100))

    def replace_unless_full(source: Path, target: Path) -> None:
        if next(numbers) == number:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        replace(source, target)

    patch.setattr(os, "replace", replace_unless_full)
