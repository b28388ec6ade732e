"""Random input: how much of it, and where an input that failed is kept.

The short run of `make test` has the same inputs every time. With FUZZ_EXAMPLES (`make fuzz`) inputs are new ones, and
what fails is kept in `.fuzz/`: hypothesis' own database, from which the next run begins, and the input as text.
"""

from __future__ import annotations

import os
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.database import DirectoryBasedExampleDatabase

KEPT = Path(__file__).parents[2] / ".fuzz"
EXAMPLES = os.environ.get("FUZZ_EXAMPLES", "")

_SLOW = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow, HealthCheck.data_too_large]
FUZZED = (
    settings(
        max_examples=int(EXAMPLES),
        suppress_health_check=_SLOW,
        derandomize=False,
        database=DirectoryBasedExampleDatabase(KEPT / "database"),
        print_blob=True,
    )
    if EXAMPLES
    else settings(max_examples=15, suppress_health_check=_SLOW)
)


def expect_understood_or_refused(
    read: Callable[[], object], refusals: tuple[type[Exception], ...], content: Any, name: str
) -> None:
    """Read something; what is neither understood nor refused in one line is kept under a name, the smallest last."""
    try:
        try:
            read()
        except refusals as refusal:
            lines = str(refusal).splitlines()
            assert len(lines) == 1, f"not one line: {lines}"
            # nothing by which a file could speak to the terminal
            assert "\x1b" not in lines[0]
    except Exception as error:
        if EXAMPLES:
            KEPT.mkdir(exist_ok=True)
            kept = KEPT / f"{name}.txt"
            kept.write_text(f"{content!r}\n\n{traceback.format_exc()}", encoding="utf-8", errors="backslashreplace")
            error.add_note(f"the input is kept in {kept}")
        raise


@st.composite
def spliced(draw: st.DrawFn, whole: bytes, pieces: st.SearchStrategy[bytes]) -> bytes:
    """Bytes in which up to three stretches are removed, doubled or replaced by a piece."""
    for _ in range(draw(st.integers(1, 3))):
        start = draw(st.integers(0, len(whole)))
        end = min(len(whole), start + draw(st.integers(0, 20)))
        middle = draw(st.one_of(st.just(b""), st.just(whole[start:end] * 2), pieces))
        whole = whole[:start] + middle + whole[end:]
    return whole
