# SPDX-License-Identifier: Apache-2.0
"""Draws the figures of paper.md from the rows in docs/results: `python paper/figures.py`."""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.append(str(ROOT / "docs" / "studies"))

from fivebar_bringup.pages.style import house_style, png  # noqa: E402
from result_pages.catalogue import PAGES  # noqa: E402
from result_pages.making import ResultFiles  # noqa: E402

SHOWN = ("laws", "crossing")


def main() -> None:
    """Write a picture of each section that the paper shows."""
    files = ResultFiles(ROOT / "docs" / "results", PAGES)
    folder = ROOT / "paper" / "figures"
    folder.mkdir(exist_ok=True)
    for page in PAGES:
        if page.name in SHOWN:
            with house_style():
                (folder / f"{page.name}.png").write_bytes(png(page.figure(files.rows[page.name])))
            print(f"look at {folder / page.name}.png")


if __name__ == "__main__":
    main()
