# SPDX-License-Identifier: Apache-2.0
"""Where new users find answers: each is at most three clicks from the home page, and all of them exist."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from fivebar_control.planning import figures

DOCS = Path(__file__).parents[2] / "docs"
CLICKS = 3
LINK = re.compile(r"\[[^\]]+\]\(([^)#]+)(?:#([^)]*))?\)")
"""A link to a page, and to a heading on it."""


def answers() -> dict[str, list[tuple[str, str]]]:
    """Return the pages and headings that answer each question."""
    rows = re.findall(r"^\| (.*\?) \| (.*) \|$", (DOCS / "faq.md").read_text(encoding="utf-8"), re.MULTILINE)
    return {question: LINK.findall(answer) for question, answer in rows}


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
    clicks = {"index.md": 0}
    for count in range(1, CLICKS + 1):
        before = [page for page, least in clicks.items() if least == count - 1]
        for page in before:
            clicks |= {one: count for one in linked(page) if one not in clicks}
    found, wrong = answers(), []
    assert len(found) >= 30
    for question, pages in found.items():
        if not pages:
            wrong.append(f"{question} expected a link to an answer")
        for page, anchor in pages:
            if page not in clicks:
                wrong.append(f"{question} expected at most {CLICKS} clicks from index.md to {page}")
            elif anchor and anchor not in anchors(page):
                wrong.append(f"{question} {page} has no heading {anchor}")
    assert not wrong, "\n".join(wrong)


def test_published_names_lead_to_pages_and_headings_that_there_are() -> None:
    tree = ast.parse((DOCS / "site" / "hooks.py").read_text(encoding="utf-8"))
    (value,) = (
        node.value
        for node in tree.body
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "REDIRECTS"
    )
    redirects = ast.literal_eval(value)
    assert len(redirects) > 20
    wrong = [name for name in redirects if (DOCS / f"{name}.md").exists()]
    for target in redirects.values():
        page, _, heading = target.partition("#")
        if not (DOCS / f"{page}.md").is_file() or (heading and heading not in anchors(f"{page}.md")):
            wrong.append(target)
    assert not wrong


def test_every_figure_that_refuses_a_motion_has_its_advice() -> None:
    page = (DOCS / "motions.md").read_text(encoding="utf-8").replace("\\|", "|")
    names = {value for name, value in vars(figures).items() if name.isupper() and isinstance(value, str)}
    assert len(names) > 10
    assert not [name for name in names if name.removesuffix(" without the reserve of torque") not in page]
