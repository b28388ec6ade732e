"""The page of a comparison: one file with everything in it, which asks nothing of the network."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from fivebar_bringup.compare.verdicts import Finding
from fivebar_bringup.report.page import CSS
from fivebar_bringup.report.picture import Picture, figure_html
from fivebar_bringup.report.table import TABLE_CSS, Table, table_html

MORE_CSS = """
main { max-width: 1240px; }
"""

HEADS = {True: "Met", False: "Not met", None: "Not known"}


def html_page(
    verdicts: Sequence[Finding], pictures: Sequence[Picture], tables: Sequence[Table], setting: str, command: str
) -> str:
    """Return the page: the verdicts, the figures, the tables, how to repeat it."""
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<title>Controllers side by side</title>
<style>{CSS}{TABLE_CSS}{MORE_CSS}</style>
</head>
<body>
<main>
<h1>Controllers side by side</h1>
<p class="setting">{escape(setting)}</p>
{"".join(_verdict(finding) for finding in verdicts)}
<h2>Over the duration</h2>
{"".join(figure_html(picture) for picture in pictures)}
<h2>Tables</h2>
{"".join(table_html(table) for table in tables)}
<h2>Do it again</h2>
<pre>{escape(command)}</pre>
</main>
</body>
</html>
"""


def _verdict(finding: Finding) -> str:
    kind = "verdict" if finding.met else "verdict failed"
    return (
        f'<div class="{kind}"><strong>{HEADS[finding.met]}</strong>: {escape(finding.title)}.'
        f"<ul><li>expected: {escape(finding.expected)}</li><li>measured: {escape(finding.measured)}</li></ul></div>\n"
    )
