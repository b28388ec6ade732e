# SPDX-License-Identifier: Apache-2.0
"""The fenced blocks of pages, which tests run word for word."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

DOCS = Path(__file__).parents[2] / "docs"

FENCE = re.compile(r'^```(\w+)(?: title="([\w.]+)")?\n(.*?)^```$', re.MULTILINE | re.DOTALL)


class Block(NamedTuple):
    """A fenced block of a page: its language, the file that it is the content of, and its text."""

    language: str
    file: str
    text: str


def blocks(page: Path) -> list[Block]:
    return [Block(*found) for found in FENCE.findall(page.read_text(encoding="utf-8"))]


def command_lines(page: Path, *begins: str) -> list[str]:
    """Return the lines of the shell blocks of a page that begin so, without comments."""
    lines = [line for block in blocks(page) if block.language == "sh" for line in block.text.splitlines()]
    return [line.partition("  #")[0].strip() for line in lines if line.startswith(begins)]


def write_files(page: str, folder: Path) -> None:
    """Write the files that a page of the documentation shows into a folder."""
    for block in blocks(DOCS / page):
        if block.file:
            (folder / block.file).write_text(block.text, encoding="utf-8")
