"""The page of a sweep."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from fivebar_bringup.pages.document import html_document, verdict_html
from fivebar_bringup.pages.picture import Picture, figure_html
from fivebar_bringup.pages.table import WIDE_TABLE_CSS, Table, table_html

TITLE = "Random crossings"


def html_page(
    setting: str,
    drawn: str,
    verdict: tuple[bool, str],
    tables: Sequence[Table],
    pictures: Sequence[Picture],
    details: Sequence[Table],
    command: str,
) -> str:
    """Return the page: what was drawn, the verdict, tables, figures, tables with the details, how to repeat it."""
    met, text = verdict
    body = f"""\
{verdict_html(met, "Met" if met else "Not met", f": {escape(text)}")}
<h2>What was drawn</h2>
<p>{escape(drawn)}</p>
<h2>Tables</h2>
{"".join(table_html(table) for table in tables)}
<h2>Figures</h2>
{"".join(figure_html(picture) for picture in pictures)}
<h2>Details</h2>
{"".join(table_html(table) for table in details)}
<h2>Do it again</h2>
<pre>{escape(command)}</pre>"""
    return html_document(title=TITLE, heading=TITLE, setting=setting, body=body, css=WIDE_TABLE_CSS)
