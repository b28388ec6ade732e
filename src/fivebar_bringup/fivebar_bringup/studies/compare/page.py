"""The page of a comparison."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from fivebar_bringup.pages.document import html_document, verdict_html
from fivebar_bringup.pages.picture import Picture, figure_html
from fivebar_bringup.pages.table import WIDE_TABLE_CSS, Table, table_html
from fivebar_bringup.studies.compare.verdicts import Finding

TITLE = "Controllers side by side"

HEADS = {True: "Met", False: "Not met", None: "Not known"}


def html_page(
    verdicts: Sequence[Finding], pictures: Sequence[Picture], tables: Sequence[Table], setting: str, command: str
) -> str:
    """Return the page: the verdicts, the figures, the tables, how to repeat it."""
    body = f"""\
{"".join(_verdict(finding) for finding in verdicts)}
<h2>Over the duration</h2>
{"".join(figure_html(picture) for picture in pictures)}
<h2>Tables</h2>
{"".join(table_html(table) for table in tables)}
<h2>Do it again</h2>
<pre>{escape(command)}</pre>"""
    return html_document(title=TITLE, heading=TITLE, setting=setting, body=body, css=WIDE_TABLE_CSS)


def _verdict(finding: Finding) -> str:
    judged = f"<li>expected: {escape(finding.expected)}</li><li>measured: {escape(finding.measured)}</li>"
    return verdict_html(bool(finding.met), HEADS[finding.met], f": {escape(finding.title)}.<ul>{judged}</ul>")
