"""The page of a run: one file with everything in it, which asks nothing of the network."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape

from fivebar_bringup.report.picture import Picture
from fivebar_bringup.report.summary import Pair, Summary
from fivebar_bringup.report.thesis import thesis_figures
from fivebar_bringup.report.wording import engineering, plain
from fivebar_bringup.scenario import Scenario

RUNNERS = {"ros": "ROS 2 node graph", "offline": "one process, without ROS"}

CSS = """
:root { color-scheme: light dark; --ink: #1f2430; --soft: #5b6472; --line: #d9dde4; --page: #f6f7f9; --card: #ffffff;
  --good: #00714f; --bad: #b34700; }
@media (prefers-color-scheme: dark) { :root { --ink: #e7e9ee; --soft: #a4adbb; --line: #363d4a; --page: #14171d;
  --card: #1d222b; --good: #35c496; --bad: #ff9a4d; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--ink); font: 16px/1.55 system-ui, sans-serif; }
main { max-width: 1060px; margin: 0 auto; padding: 2.2rem 1.2rem 4rem; }
h1 { margin: 0 0 .2rem; font-size: 1.9rem; overflow-wrap: anywhere; }
h2 { margin: 2.6rem 0 .8rem; font-size: 1.25rem; }
.setting { margin: 0; color: var(--soft); }
.verdict { margin: 1.3rem 0 0; padding: .8rem 1.1rem; background: var(--card); border-left: 5px solid var(--good);
  border-radius: 0 8px 8px 0; }
.verdict strong { color: var(--good); }
.failed { border-left-color: var(--bad); }
.failed strong { color: var(--bad); }
.verdict ul { margin: .4rem 0 0; padding-left: 1.2rem; overflow-wrap: anywhere; }
.scroll { overflow-x: auto; background: var(--card); border: 1px solid var(--line); border-radius: 8px; }
table { border-collapse: collapse; width: 100%; }
th, td { padding: .45rem .9rem; text-align: left; vertical-align: top; border-top: 1px solid var(--line); }
thead th { border-top: 0; color: var(--soft); font-weight: 600; }
tbody th { font-weight: 400; }
td { font-variant-numeric: tabular-nums; }
figure { margin: 0 0 2rem; background: var(--card); border: 1px solid var(--line); border-radius: 8px;
  overflow: hidden; }
img { display: block; width: 100%; height: auto; background: #ffffff; }
figcaption { padding: .7rem 1.1rem .9rem; color: var(--soft); font-size: .93rem; }
pre { margin: 0; padding: .9rem 1.1rem; overflow-x: auto; background: var(--card); border: 1px solid var(--line);
  border-radius: 8px; font: .88rem/1.5 ui-monospace, monospace; }
"""

Row = tuple[str, str, str | None]


def html_page(scenario: Scenario, summary: Summary, pictures: Sequence[Picture]) -> str:
    """Return the page: outcome, figures beside those of the thesis, pictures, the scenario, how to repeat it."""
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<title>{escape(scenario.name)}: {"completed" if summary.completed else "not completed"}</title>
<style>{CSS}</style>
</head>
<body>
<main>
<h1>{escape(scenario.name)}</h1>
<p class="setting">{escape(_setting(summary))}</p>
{_verdict(summary)}
<h2>Results</h2>
{_table(_rows(scenario, summary))}
<h2>Figures</h2>
{_gallery(pictures)}
<h2>Scenario as run</h2>
<pre>{escape(scenario.to_yaml())}</pre>
<h2>Do it again</h2>
<p>In the directory of this run:</p>
<pre>{escape(_commands(summary))}</pre>
</main>
</body>
</html>
"""


def _setting(summary: Summary) -> str:
    parts = [f"controller {summary.controller}"]
    if summary.runner is not None:
        parts.append(RUNNERS.get(summary.runner, summary.runner))
    if summary.mode is not None:
        parts.append(summary.mode)
    return " · ".join(parts)


def _verdict(summary: Summary) -> str:
    if summary.completed:
        asked = summary.torque_saturated_samples
        beyond = f" {asked} samples asked for more torque than the drives can give." if asked else ""
        turned = summary.working_mode_changes
        working = f", {turned} of working mode" if turned else ""
        return (
            '<div class="verdict"><strong>Completed</strong>: all'
            f" {summary.samples} samples, {summary.assembly_mode_changes} changes of assembly mode{working}, no fault."
            f"{beyond}</div>"
        )
    reasons = "".join(f"<li>{escape(reason)}</li>" for reason in summary.not_completed_because)
    return f'<div class="verdict failed"><strong>Not completed</strong>, because<ul>{reasons}</ul></div>'


def _rows(scenario: Scenario, summary: Summary) -> Iterable[Row]:
    """Return what was found, its value, and what the thesis states; None where it states nothing."""
    thesis = thesis_figures(scenario)
    cycle = summary.cycle_time_ms
    yield "changes of assembly mode", str(summary.assembly_mode_changes), thesis.mode_changes
    if summary.planned_working_mode_changes or summary.working_mode_changes:
        yield "changes of working mode", str(summary.working_mode_changes), None
    yield "largest torque applied, motors 1 and 2", _both(summary.torque_peak_nm, "Nm"), thesis.torque
    yield "largest torque asked for, motors 1 and 2", _both(summary.torque_requested_peak_nm, "Nm"), None
    yield "samples that asked for more than the limit", _count(summary.torque_saturated_samples), None
    yield "error of the virtual constraint |h| where σ > 0", engineering(summary.vhc_error_max_m, "m"), thesis.vhc_error
    joint = engineering(summary.vhc_error_joint_max_rad, "rad")
    yield "the same in motor angles", joint, thesis.vhc_error_joint
    yield "largest tracking error, x and y", _both(summary.tracking_error_max_m, "m"), None
    yield "root mean square tracking error, x and y", _both(summary.tracking_error_rms_m, "m"), None
    yield "largest distance from the reference", engineering(summary.tracking_error_peak_m, "m"), None
    yield "largest weight σ", "–" if summary.sigma_max is None else f"{summary.sigma_max:.3g}", "1 on the locus"
    imu = plain(summary.imu_acceleration_error_rms, "m/s²")
    yield "root mean square acceleration error by the IMU", imu, "goes to zero"
    yield "largest error of the estimate", engineering(summary.estimate_error_max_m, "m"), None
    yield "samples recorded of those planned", f"{summary.samples} of {summary.planned_samples}", None
    times = "–" if cycle is None else f"{cycle.p50:.2f}, {cycle.p99:.2f}, {cycle.max:.2f} ms"
    yield "time between samples: median, 99 %, longest", times, None
    yield "overruns", _count(summary.overruns), None
    yield "messages that the recorder missed", _count(summary.dropped_messages), None
    yield "simulated time", plain(summary.simulated_s, "s"), None
    yield "wall time", plain(summary.wall_s, "s"), None


def _both(pair: Pair, unit: str) -> str:
    text = plain if unit == "Nm" else engineering
    return ", ".join(text(value, unit) for value in pair)


def _count(value: int | None) -> str:
    return "–" if value is None else str(value)


def _table(rows: Iterable[Row]) -> str:
    body = "\n".join(
        f'<tr><th scope="row">{escape(name)}</th><td>{escape(value)}</td><td>{escape(thesis or "")}</td></tr>'
        for name, value, thesis in rows
    )
    return (
        '<div class="scroll"><table>\n<thead><tr><th scope="col">figure</th><th scope="col">this run</th>'
        f'<th scope="col">thesis</th></tr></thead>\n<tbody>\n{body}\n</tbody>\n</table></div>'
    )


def _gallery(pictures: Sequence[Picture]) -> str:
    if not pictures:
        return "<p>The bag holds no sample of this run, so there is nothing to draw.</p>"
    return "\n".join(
        f'<figure><img alt="{escape(picture.caption, quote=True)}"'
        f' src="data:image/png;base64,{base64.b64encode(picture.png).decode("ascii")}">'
        f"<figcaption>{escape(picture.caption)}</figcaption></figure>"
        for picture in pictures
    )


def _commands(summary: Summary) -> str:
    again = "fivebar simulate scenario.yaml" if summary.runner == "offline" else "fivebar run scenario.yaml"
    if summary.mode == "realtime":
        again += " --realtime"
    return f"{again}\nfivebar report .\nros2 bag play bag"
