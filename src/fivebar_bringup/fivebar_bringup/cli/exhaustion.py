# SPDX-License-Identifier: Apache-2.0
"""Errors by which libraries say that the system gives this process no more memory, threads or files."""

from __future__ import annotations

SIGNS = (
    "can't start new thread",
    "pthread_create failed",
    "failed to map segment",
    "cannot allocate memory",
    "too many open files",
    "resource temporarily unavailable",
)
"""Parts of the messages of such errors, in any case of letters: their types differ from library to library."""


def exhaustion(error: BaseException) -> str | None:
    """Return in one line what has run out, None where an error has another cause."""
    cause: BaseException | None = error
    while cause is not None:
        words = (isinstance(cause, OSError) and cause.strerror) or str(cause)
        text = words.splitlines()[0] if words else "out of memory"
        if isinstance(cause, MemoryError) or any(sign in text.lower() for sign in SIGNS):
            return f"the system gives this process no more memory, threads or files: {text}; see ulimit -a"
        cause = cause.__cause__ or cause.__context__
    return None
