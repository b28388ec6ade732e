"""The page of a reproduction."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from fivebar_bringup.pages.document import html_document
from fivebar_bringup.pages.picture import figure_html
from fivebar_bringup.pages.table import TABLE_CSS, Table, framed_rows, table_html
from fivebar_bringup.studies.reproduce.rows import Row
from fivebar_bringup.studies.reproduce.verdicts import Verdict

MORE_CSS = """
main { max-width: 1180px; }
.chip { display: inline-block; padding: .05rem .6rem; border-radius: 1rem; font-size: .86rem; font-weight: 600;
  white-space: nowrap; border: 1.5px solid currentColor; }
.row { margin: 0 0 1.6rem; background: var(--card); border: 1px solid var(--line); border-radius: 8px; }
.row > header { display: flex; flex-wrap: wrap; gap: .3rem .9rem; align-items: baseline; padding: .9rem 1.1rem .3rem; }
.row h3 { margin: 0; font-size: 1.05rem; flex: 1 1 22rem; }
.row .place { color: var(--soft); }
.row dl { display: grid; grid-template-columns: minmax(5.5rem, max-content) 1fr; gap: .25rem 1.1rem; margin: 0;
  padding: .2rem 1.1rem .9rem; }
.row dt { color: var(--soft); }
.row dd { margin: 0; overflow-wrap: anywhere; }
.row figure { margin: 0; border: 0; border-top: 1px solid var(--line); border-radius: 0; }
a { color: inherit; }
"""


def html_page(rows: Sequence[Row], tables: Sequence[Table], runs: int, wall_s: float, command: str) -> str:
    """Return the page: the verdicts in short, every row with its figures, the tables."""
    counts = {verdict: sum(row.judgement.verdict == verdict for row in rows) for verdict in Verdict}
    short = ", ".join(f"{number} {verdict}" for verdict, number in counts.items())
    gallery = "\n".join(_row(row) for row in rows)
    body = f"""\
<p>Each row sets what the thesis reports beside what this project measures. A verdict follows from the measured figure
by the rule that stands with it: <span class="chip good">agreed</span> where the figure or statement comes out,
<span class="chip good">better</span> where an error is smaller by more than its order, and
<span class="chip bad">not reproduced</span> where it does not, with the reason.</p>
<h2>In short</h2>
{_overview(rows)}
<h2>Figures and claims</h2>
{gallery}
<h2>Tables</h2>
{"".join(table_html(table) for table in tables)}
<h2>Do it again</h2>
<pre>{escape(command)}</pre>"""
    return html_document(
        title=f"Reproduction: {short}",
        heading="The thesis, made again",
        setting=f"{short} · {runs} runs in {wall_s:.0f} s · simulated throughout",
        body=body,
        css=TABLE_CSS + MORE_CSS,
    )


def _overview(rows: Sequence[Row]) -> str:
    return framed_rows(
        ("thesis", "about", "verdict", "because"),
        (
            f'<th scope="row"><a href="#{_anchor(row)}">{escape(row.place)}</a></th><td>{escape(row.title)}</td>'
            f"<td>{_chip(row)}</td><td>{escape(row.judgement.reason)}</td>"
            for row in rows
        ),
    )


def _row(row: Row) -> str:
    entries = [
        ("thesis", row.thesis),
        ("measured", row.measured),
        ("rule", row.judgement.rule),
        ("reason", row.judgement.reason),
    ]
    entries += [("remark", row.remark)] if row.remark else []
    content = "\n".join(f"<dt>{name}</dt><dd>{escape(text)}</dd>" for name, text in entries)
    return (
        f'<section class="row" id="{_anchor(row)}"><header><span class="place">{escape(row.place)}</span>'
        f"<h3>{escape(row.title)}</h3>{_chip(row)}</header>\n<dl>\n{content}\n</dl>\n"
        f"{''.join(figure_html(picture) for picture in row.pictures)}</section>"
    )


def _anchor(row: Row) -> str:
    name = f"{row.place} {row.title}".lower()
    return "-".join("".join(letter if letter.isalnum() else " " for letter in name).split())


def _chip(row: Row) -> str:
    verdict = row.judgement.verdict
    kind = "bad" if verdict == Verdict.NOT_REPRODUCED else "good"
    return f'<span class="chip {kind}">{escape(verdict)}</span>'
