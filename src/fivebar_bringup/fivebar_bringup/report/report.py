"""From the directory of a run to its report."""

from __future__ import annotations

from fivebar_bringup.report.analysis import RunAnalysis
from fivebar_bringup.report.page import html_page
from fivebar_bringup.report.series import read_series
from fivebar_bringup.report.summary import Summary, summarize
from fivebar_bringup.report.timing import read_timing
from fivebar_bringup.runs.bag.reader import read_bag
from fivebar_bringup.runs.results import json_text, write_results
from fivebar_bringup.runs.run_directory import RunDirectory


def write_report(run: RunDirectory, with_page: bool = True) -> Summary:
    """Write figures, page and summary of a run into its directory, each file in one step, and return the summary.

    Without the page only the summary is written.

    Raises:
        InputError: the directory does not hold a run, or cannot be written to.
        BagError: the bag cannot be read or does not hold a run of the scenario.
    """
    scenario = run.read_scenario()
    timing = read_timing(run.timing)
    recording = read_bag(run.bag)
    series = read_series(recording, scenario)
    summary = summarize(recording, series, scenario, timing)
    files = {run.summary.name: json_text(summary.as_json())}
    if not with_page:
        write_results(run.path, files, {})
        return summary
    # here, because matplotlib takes as long to load as all the rest of the command
    from fivebar_bringup.report.gallery import draw_pictures

    pictures = draw_pictures(RunAnalysis(scenario, scenario.plan(), scenario.five_bar(), series, summary))
    files[run.page.name] = html_page(scenario, summary, pictures)
    write_results(run.path, files, {picture.name: picture.png for picture in pictures})
    return summary
