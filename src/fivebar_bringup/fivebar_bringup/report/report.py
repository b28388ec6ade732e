# SPDX-License-Identifier: Apache-2.0
"""From the directory of a run to its report."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from fivebar_bringup.bag.definitions import absolute_name
from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.recording import RawTopic, Recording
from fivebar_bringup.recorded.results import json_text, write_results
from fivebar_bringup.recorded.run_directory import RunDirectory
from fivebar_bringup.recorded.run_odds import read_odds
from fivebar_bringup.recorded.series import read_series
from fivebar_bringup.recorded.summary import Summary, summarize
from fivebar_bringup.recorded.timing import read_timing
from fivebar_bringup.report.analysis import RunAnalysis
from fivebar_bringup.report.fault_marks import FaultMark, fault_marks
from fivebar_bringup.scenario import Scenario
from fivebar_control.trajectory.planner import Plan
from fivebar_description.interface import GOAL_STATUS, JOINT_STATES, PROGRAM_STATUS
from fivebar_description.interrupts import interrupts_allowed
from fivebar_description.stages import stage
from fivebar_description.strict_yaml import InputError


def write_report(run: RunDirectory, with_page: bool = True, namespace: str | None = None) -> Summary:
    """Write summary, figures and page of a run into its directory, each file in one step, and return the summary.

    Without the page only the summary is written. A block that defers interrupts defers none of the page. `namespace` is
    that of the topics, None for the one that the bag has.

    Raises:
        InputError: the directory does not hold a run, or cannot be written to.
        BagError: the bag cannot be read or does not hold a run of the scenario.
    """
    recorded = _read(run, namespace)
    summary = recorded.analysis.summary
    # first and by itself: it is there whatever becomes of the page
    write_results(run.path, {run.summary.name: json_text(summary.as_dict())}, {})
    if with_page:
        with interrupts_allowed(), stage("drawing figures and page"):
            _write_page(run, recorded)
    return summary


def write_summary_without_bag(run: RunDirectory) -> Summary:
    """Write the summary of a run whose bag cannot be read, with the faults of its launcher, and return it.

    Raises:
        InputError: the directory does not hold a run, or cannot be written to.
    """
    nothing = {absolute_name(JOINT_STATES): RawTopic(JOINT_STATES.type, [], [])}
    summary = _analysed(run, run.read_scenario(), Recording(run.bag, nothing, {})).analysis.summary
    write_results(run.path, {run.summary.name: json_text(summary.as_dict())}, {})
    return summary


def _write_page(run: RunDirectory, recorded: _Recorded) -> None:
    # here, because matplotlib takes as long to load as all the rest of the command
    from fivebar_bringup.report.gallery import REPLAYED, draw_pictures
    from fivebar_bringup.report.page import html_page
    from fivebar_bringup.report.replay import replay_scripts

    analysis = recorded.analysis
    pictures = draw_pictures(analysis)
    replay = replay_scripts([(analysis.scenario.name, *recorded)])
    shown = [picture for picture in pictures if picture.name not in REPLAYED]
    page = html_page(analysis.scenario, analysis.summary, shown, replay)
    write_results(run.path, {run.page.name: page}, {picture.name: picture.png for picture in pictures})


def write_overlay(first: RunDirectory, second: RunDirectory) -> tuple[Path, tuple[Summary, Summary]]:
    """Write a page that plays two runs together into the directory of the first; return its path and both summaries.

    Raises:
        InputError: a directory does not hold a run or a run has no samples, or the page cannot be written.
        BagError: a bag cannot be read or does not hold a run of its scenario.
    """
    from fivebar_bringup.report.page import overlay_page
    from fivebar_bringup.report.replay import replay_scripts

    names = first.path.resolve().name, second.path.resolve().name
    runs = _read(first), _read(second)
    replay = replay_scripts([(name, *run) for name, run in zip(names, runs, strict=True)])
    if replay is None:
        raise InputError(f"{first.path}, {second.path}: expected two runs with samples")
    page = first.path / f"overlay-{names[1]}.html"
    summaries = runs[0].analysis.summary, runs[1].analysis.summary
    scenarios = [run.analysis.scenario for run in runs]
    write_results(first.path, {page.name: overlay_page(names, list(zip(scenarios, summaries, strict=True)), replay)})
    return page, summaries


def read_analysis(run: RunDirectory, namespace: str | None = None) -> RunAnalysis:
    """Read a run from its directory.

    Raises:
        InputError: the directory does not hold a run.
        BagError: the bag cannot be read or does not hold a run of the scenario.
    """
    return _read(run, namespace).analysis


def write_animation(run: RunDirectory, suffix: str, namespace: str | None = None) -> Path:
    """Write a picture of a run that moves into its directory, as `gif` or `mp4`, and return its path.

    Raises:
        InputError: the directory does not hold a run, the run has no samples, ffmpeg is missing, or the file cannot be
            written.
        BagError: the bag cannot be read or does not hold a run of the scenario.
    """
    from fivebar_bringup.report.animation import animate

    analysis = read_analysis(run, namespace)
    if not analysis.series.sample.size:
        raise InputError(f"{run.path}: the bag holds no sample of the run, so nothing would move")
    path = run.path / f"animation.{suffix}"
    write_results(run.path, {path.name: animate(analysis, suffix)})
    return path


class _Recorded(NamedTuple):
    """A run as read from its directory."""

    analysis: RunAnalysis
    faults: list[FaultMark]


def _read(run: RunDirectory, namespace: str | None = None) -> _Recorded:
    scenario = run.read_scenario()
    return _analysed(run, scenario, read_bag(run.bag, namespace))


def _plan_of(recording: Recording, scenario: Scenario) -> Plan:
    """Return what a run was to do."""
    if not (recording.count(GOAL_STATUS) or recording.count(PROGRAM_STATUS)):
        return scenario.plan()
    # here, because most runs have no requests
    from fivebar_bringup.report.requests import plan_with_requests

    return plan_with_requests(recording, scenario)


def _analysed(run: RunDirectory, scenario: Scenario, recording: Recording) -> _Recorded:
    timing = read_timing(run.timing)
    plan = _plan_of(recording, scenario)
    series = read_series(recording, scenario, plan)
    summary = summarize(recording, series, scenario, timing, plan, read_odds(run.odds))
    analysis = RunAnalysis(scenario, plan, scenario.five_bar(), series, summary)
    return _Recorded(analysis, fault_marks(recording, series))
