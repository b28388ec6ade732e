"""The page of a run."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from fivebar_bringup.pages.document import html_document, verdict_html
from fivebar_bringup.pages.picture import Picture, figure_html
from fivebar_bringup.pages.table import framed_rows
from fivebar_bringup.report.summary import Pair, Summary
from fivebar_bringup.report.thesis import thesis_figures
from fivebar_bringup.report.wording import engineering, plain
from fivebar_bringup.scenario import Scenario

RUNNERS = {"ros": "ROS 2 node graph", "offline": "one process, without ROS"}

Row = tuple[str, str, str | None]


def html_page(scenario: Scenario, summary: Summary, pictures: Sequence[Picture]) -> str:
    """Return the page: outcome, figures beside those of the thesis, pictures, the scenario, how to repeat it."""
    body = f"""\
{_verdict(summary)}
<h2>Results</h2>
{_table(_rows(scenario, summary))}
<h2>Figures</h2>
{_gallery(pictures)}
<h2>Scenario as run</h2>
<pre>{escape(scenario.to_yaml())}</pre>
<h2>Do it again</h2>
<p>In the directory of this run:</p>
<pre>{escape(_commands(summary))}</pre>"""
    outcome = "completed" if summary.completed else "not completed"
    return html_document(
        title=f"{scenario.name}: {outcome}", heading=scenario.name, setting=_setting(summary), body=body
    )


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
        return verdict_html(
            True,
            "Completed",
            f": all {summary.samples} samples, {summary.assembly_mode_changes} changes of assembly mode{working},"
            f" no fault.{beyond}",
        )
    reasons = "".join(f"<li>{escape(reason)}</li>" for reason in summary.not_completed_because)
    return verdict_html(False, "Not completed", f", because<ul>{reasons}</ul>")


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
    return framed_rows(
        ("figure", "this run", "thesis"),
        (
            f'<th scope="row">{escape(name)}</th><td>{escape(value)}</td><td>{escape(thesis or "")}</td>'
            for name, value, thesis in rows
        ),
    )


def _gallery(pictures: Sequence[Picture]) -> str:
    if not pictures:
        return "<p>The bag holds no sample of this run, so there is nothing to draw.</p>"
    return "\n".join(figure_html(picture) for picture in pictures)


def _commands(summary: Summary) -> str:
    again = "fivebar simulate scenario.yaml" if summary.runner == "offline" else "fivebar run scenario.yaml"
    if summary.mode == "realtime":
        again += " --realtime"
    return f"{again}\nfivebar report .\nros2 bag play bag"
