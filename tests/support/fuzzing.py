# SPDX-License-Identifier: Apache-2.0
"""What has to come of any input: it is understood, or refused in one line."""

from __future__ import annotations

from pathlib import Path

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from parsers import Parser

FUZZED = settings(
    max_examples=15,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow, HealthCheck.data_too_large],
)
"""A short run, with the same inputs every time; `make fuzz` is the long one."""


def understand_or_refuse(parser: Parser, content: bytes, folder: Path) -> bool:
    """Let a parser read, with a folder of its own for files; return whether it understood.

    Raises:
        AssertionError: it refused in several lines, or with characters by which an input could speak to the terminal.
        Exception: of any kind: neither understood nor refused.
    """
    try:
        parser.read(content, folder)
    except parser.refusals as refusal:
        lines = str(refusal).splitlines()
        assert len(lines) == 1, f"not one line: {lines}"
        assert "\x1b" not in lines[0]
        return False
    return True


@st.composite
def spliced(draw: st.DrawFn, whole: bytes, pieces: st.SearchStrategy[bytes]) -> bytes:
    """Bytes in which up to three stretches are removed, doubled or replaced by a piece."""
    for _ in range(draw(st.integers(1, 3))):
        start = draw(st.integers(0, len(whole)))
        end = min(len(whole), start + draw(st.integers(0, 20)))
        middle = draw(st.one_of(st.just(b""), st.just(whole[start:end] * 2), pieces))
        whole = whole[:start] + middle + whole[end:]
    return whole
