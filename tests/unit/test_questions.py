# SPDX-License-Identifier: Apache-2.0
"""Where new users find answers: the page that says so has at most three clicks to each, all of which exist."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

from fivebar_control.planning import figures

DOCS = Path(__file__).parents[2] / "docs"
CLICKS = 3
WAY = re.compile(r"\[[^\]]+\]\(([^)#]+)(?:#([^)]*))?\)")
"""A step of a way: a page, and a heading on it."""


def ways() -> dict[str, list[tuple[str, str]]]:
    """Return the way to each answer, by question: pages and headings, from the home page on."""
    rows = re.findall(r"^\| (.*\?.*?) \| (.*) \|$", (DOCS / "answers.md").read_text(encoding="utf-8"), re.MULTILINE)
    return {question: WAY.findall(way) for question, way in rows}


def linked(page: str) -> set[str]:
    """Return the pages that a page links to, by their paths in docs."""
    folder = (DOCS / page).parent
    targets = re.findall(r"\]\(([\w./]+\.md)(?:#[^)]*)?\)", (DOCS / page).read_text(encoding="utf-8"))
    paths = [(folder / target).resolve() for target in targets]
    return {path.relative_to(DOCS).as_posix() for path in paths if path.is_file() and path.is_relative_to(DOCS)}


def anchors(page: str) -> set[str]:
    """Return the anchors of a page's headings."""
    headings = re.findall(r"^#+ (.*)$", (DOCS / page).read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


def test_answers_are_three_clicks_from_the_home_page() -> None:
    found, wrong = ways(), []
    assert len(found) >= 20
    for question, way in found.items():
        if way[0] != ("index.md", "") or len(way) > CLICKS + 1:
            wrong.append(f"{question} expected a way of at most {CLICKS} clicks from index.md")
        for (before, _), (page, anchor) in itertools.pairwise(way):
            if page != before and page not in linked(before):
                wrong.append(f"{question} {before} has no link to {page}")
            if anchor and anchor not in anchors(page):
                wrong.append(f"{question} {page} has no heading {anchor}")
    assert not wrong, "\n".join(wrong)


def test_every_figure_that_refuses_a_motion_has_its_advice() -> None:
    page = (DOCS / "motions.md").read_text(encoding="utf-8").replace("\\|", "|")
    names = {value for name, value in vars(figures).items() if name.isupper() and isinstance(value, str)}
    assert len(names) > 10
    assert not [name for name in names if name.removesuffix(" without the reserve of torque") not in page]
