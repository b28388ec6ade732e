# SPDX-License-Identifier: Apache-2.0
"""Renders pages from their templates: each is a single self-contained file that loads nothing from the network."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment

    from fivebar_bringup.pages.content import Picture, Table


CORE = "fivebar_bringup.pages"
"""The package with the templates and scripts that all pages share."""


def render(template: str, *, package: str = CORE, **content: Any) -> str:
    """Return a page.

    Args:
        template: name of a file in `templates`; it extends base.html.
        package: by full name, in whose folder `templates` it is.
        content: what the template names, at least `title` (of the window, and of the page where the template has no
            other heading) and `setting` (a line below the heading: what the page is about). Every text is escaped.
    """
    return _environment(package).get_template(template).render(content)


def study_page(
    *,
    title: str,
    setting: str,
    command: str,
    tables: Sequence[Table],
    words: str = "",
    pictures: Sequence[Picture] = (),
    details: Sequence[Table] = (),
) -> str:
    """Return the page of a study that has no template of its own.

    Args:
        title: heading.
        setting: a line below it.
        command: that repeats the study.
        tables: of its results.
        words: above the tables.
        pictures: below them.
        details: tables below these.
    """
    return render(
        "study.html",
        title=title,
        setting=setting,
        words=words,
        tables=tables,
        pictures=pictures,
        details=details,
        command=command,
    )


@cache
def _environment(package: str) -> Environment:
    # here, because only a command that writes a page needs it
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=ChoiceLoader([PackageLoader(place) for place in dict.fromkeys((package, CORE))]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
