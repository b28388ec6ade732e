"""The page of an identification: one file with everything in it, which asks nothing of the network."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape

from fivebar_bringup.identify.findings import INTERVALS, Findings
from fivebar_bringup.report.page import CSS
from fivebar_bringup.report.picture import Picture
from fivebar_bringup.report.wording import engineering

HEAD = ("parameter", "before", "identified", "unit", "change")


def html_page(findings: Findings, pictures: Sequence[Picture]) -> str:
    """Return the page: parameters, how they were found, pictures, the parameter file, how to use it."""
    title = f"{findings.start.name}: identified"
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<title>{escape(title)}</title>
<style>{CSS}</style>
</head>
<body>
<main>
<h1>{escape(title)}</h1>
<p class="setting">{escape(f"from {findings.bag} · {findings.samples} samples at {findings.rate_hz:g} Hz")}</p>
<h2>Parameters, with {INTERVALS}</h2>
{_table(HEAD, _parameter_rows(findings))}
<h2>How well, and from what</h2>
{_table(("figure", "value"), _figure_rows(findings))}
<h2>Figures</h2>
{_gallery(pictures)}
<h2>Parameter file</h2>
<pre>{escape(findings.parameter_file())}</pre>
<h2>Use it</h2>
<p>In the directory of this page, and in a scenario as <code>robot: PATH/identified.yaml</code>:</p>
<pre>fivebar map identified.yaml</pre>
</main>
</body>
</html>
"""


def _parameter_rows(findings: Findings) -> Iterable[tuple[str, ...]]:
    for one in findings.parameters():
        yield one.name, f"{one.before:g}", one.text(), one.unit, one.change()


def _figure_rows(findings: Findings) -> Iterable[tuple[str, ...]]:
    found = findings.found
    cutoffs = found.cutoffs
    yield "condition number of the regressor, columns scaled to unit length", f"{found.fit.condition:.3g}"
    yield "angle readings", f"{findings.encoder()}, noise {engineering(cutoffs.noise, 'rad')}"
    yield "cut-off of the differentiating filter", f"{cutoffs.derivative_hz:.3g} Hz"
    yield "cut-off of the parallel filter", f"{cutoffs.parallel_hz:.3g} Hz"
    yield "accelerations of the motors, root mean square", f"{cutoffs.acceleration:.3g} rad/s²"
    yield "time used, motors 1 and 2", ", ".join(f"{seconds:.2f} s" for seconds in found.used_s)
    yield "independent rows that the intervals rest on", f"{found.fit.independent:.0f}"
    residuals = ", ".join(engineering(value, "Nm") for value in found.fit.deviations.tolist())
    yield "residual, root mean square, motors 1 and 2", residuals
    yield "part of the torque left unexplained", ", ".join(f"{100.0 * part:.2g} %" for part in found.misfit)


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    titles = "".join(f'<th scope="col">{escape(title)}</th>' for title in head)
    body = "\n".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f'<div class="scroll"><table>\n<thead><tr>{titles}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table></div>'


def _gallery(pictures: Sequence[Picture]) -> str:
    return "\n".join(
        f'<figure><img alt="{escape(picture.caption, quote=True)}"'
        f' src="data:image/png;base64,{base64.b64encode(picture.png).decode("ascii")}">'
        f"<figcaption>{escape(picture.caption)}</figcaption></figure>"
        for picture in pictures
    )
