"""The page of a sweep: one file with everything in it, which asks nothing of the network."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from fivebar_bringup.report.page import CSS
from fivebar_bringup.report.picture import Picture, figure_html
from fivebar_bringup.report.table import TABLE_CSS, Table, table_html

MORE_CSS = """
main { max-width: 1240px; }
"""


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
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<title>Random crossings</title>
<style>{CSS}{TABLE_CSS}{MORE_CSS}</style>
</head>
<body>
<main>
<h1>Random crossings</h1>
<p class="setting">{escape(setting)}</p>
<div class="{"verdict" if met else "verdict failed"}"><strong>{"Met" if met else "Not met"}</strong>:
{escape(text)}</div>
<h2>What was drawn</h2>
<p>{escape(drawn)}</p>
<h2>Tables</h2>
{"".join(table_html(table) for table in tables)}
<h2>Figures</h2>
{"".join(figure_html(picture) for picture in pictures)}
<h2>Details</h2>
{"".join(table_html(table) for table in details)}
<h2>Do it again</h2>
<pre>{escape(command)}</pre>
</main>
</body>
</html>
"""
