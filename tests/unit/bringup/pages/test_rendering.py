# SPDX-License-Identifier: Apache-2.0
"""Pages: what comes from outside is escaped, what is missing is an error, and nothing asks for the network."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path

import pytest
from jinja2 import UndefinedError

import fivebar_bringup.pages.rendering as rendering
from fivebar_bringup.pages.content import LONG, Cell, Picture, Table
from fivebar_bringup.pages.rendering import render

TEMPLATES = Path(rendering.__file__).parent / "templates"
BRINGUP = TEMPLATES.parents[2]

MALICE = "\"'><script>alert(1)</script>&"


class Page(HTMLParser):
    """Tags with their attributes, and texts."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        self.texts.append(data)

    def of(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.tags if name == tag]


def comparison(tables: list[Table], pictures: list[Picture] | None = None, title: str = "t") -> Page:
    content = {"verdicts": [], "words": {}, "tables": tables, "pictures": pictures or [], "command": ""}
    return Page(render("comparison.html", package="fivebar_studies", title=title, setting=title, **content))


def test_texts_are_escaped_wherever_they_stand() -> None:
    table = Table("name", MALICE, MALICE, (MALICE,), ((Cell(MALICE, 1),),))
    page = comparison([table], [Picture("p", MALICE, b"png")], MALICE)
    assert not page.of("script")
    assert page.of("img") == [{"alt": MALICE, "src": "data:image/png;base64,cG5n"}]
    # window, heading, setting; the table's title, note, column and cell; the figure's caption
    assert page.texts.count(MALICE) == 8


def test_cells_are_marked_good_bad_and_long() -> None:
    row = (Cell("a", 1), Cell("b", 2, True), Cell("c", 3, False), Cell("d" * (LONG + 1), 4), Cell("e" * 99, 5, False))
    page = comparison([Table("n", "t", "", ("1", "2", "3", "4", "5"), (row,))])
    assert [cell.get("class") for cell in page.of("td")] == [None, "good", "bad", "long", "bad long"]


def test_a_folded_table_shows_its_title_only() -> None:
    row = (Cell("a", 1),)
    page = comparison([Table("n", "open", "a note", ("c",), (row,)), Table("n", "shut", "", ("c",), (row,), True)])
    names = [name for name, _ in page.tags]
    assert (names.count("details"), names.count("h3"), names.count("table")) == (1, 1, 2)
    assert "a note" in page.texts


def test_a_value_that_a_page_lacks_is_an_error() -> None:
    content = {"verdicts": [], "words": {}, "tables": [], "pictures": [], "command": ""}
    with pytest.raises(UndefinedError, match="setting"):
        render("comparison.html", package="fivebar_studies", title="t", **content)


def test_no_template_asks_for_the_network_or_turns_escaping_off() -> None:
    others = [path for folder in BRINGUP.glob("*/templates") for path in folder.iterdir()]
    assert len(others) > 5
    for path in (*TEMPLATES.iterdir(), *others):
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"https?:|<script|<link|@import|url\(|\|\s*safe|autoescape", text), path.name
