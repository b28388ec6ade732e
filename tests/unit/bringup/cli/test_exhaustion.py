# SPDX-License-Identifier: Apache-2.0
"""Limits of the system are one line, whatever library meets them first."""

from __future__ import annotations

import errno

import pytest

from fivebar_bringup.cli.exhaustion import exhaustion


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (MemoryError(), "out of memory"),
        (RuntimeError("can't start new thread"), "can't start new thread"),
        (ImportError("libany.so: failed to map segment from shared object\nsee the guide"), "shared object; see"),
        (OSError(errno.EMFILE, "Too many open files", "any.py"), "files: Too many open files; see ulimit -a"),
        (RuntimeError("pthread_create failed: Resource temporarily unavailable"), "pthread_create failed"),
    ],
)
def test_a_limit_is_told_in_one_line(error: Exception, words: str) -> None:
    text = exhaustion(error)
    assert text is not None
    assert words in text
    assert "\n" not in text


def test_another_error_is_none_and_a_limit_behind_it_is_one() -> None:
    error = RuntimeError("a handler failed")
    assert exhaustion(error) is None
    error.__cause__ = MemoryError("Unable to allocate 8 GiB")
    assert "Unable to allocate 8 GiB" in (exhaustion(error) or "")
