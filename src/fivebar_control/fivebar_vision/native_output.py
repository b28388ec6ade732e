# SPDX-License-Identifier: Apache-2.0
"""Keeps what libraries in C write to standard error, past Python, from the user: the caller says what is wrong."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

STANDARD_ERROR = 2


@contextmanager
def native_output_dropped() -> Iterator[None]:
    """Drop what is written to the process's standard error meanwhile, as by decoders of damaged pictures."""
    kept = os.dup(STANDARD_ERROR)
    try:
        with open(os.devnull, "wb") as nowhere:
            os.dup2(nowhere.fileno(), STANDARD_ERROR)
        yield
    finally:
        os.dup2(kept, STANDARD_ERROR)
        os.close(kept)
