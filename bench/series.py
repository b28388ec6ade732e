# SPDX-License-Identifier: Apache-2.0
"""`python bench/series.py [RUNS] [NAME ...]`: repeated runs in real time, as a table."""

from __future__ import annotations

import statistics
import sys
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from fivebar_bringup.errors import BagError
from fivebar_bringup.graph.node_spec import Mode, Sharing
from fivebar_bringup.runs.processes import CONTROLLERS
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_description.interface import DEFAULT_PRIORITY
from fivebar_description.rounding import in_millimetres
from graph_speed import GraphSpeed, graph_speed, stamp
from histogram import histogram
from stalls import bare_loop

RUNS = 20
"""Runs of each kind, by default."""

LOOP_SECONDS = 10.0
"""How long a bare loop is measured beside each kind, at least."""


class SeriesKind(NamedTuple):
    """A kind of run.

    Attributes:
        name: by which it is chosen.
        scenario: its name.
        rate_hz: its rate.
        rehearsed: whether it goes over the bridge and emulated drives.
        sharing: which nodes share a process, None as in a run.
        laps: how often the scenario's motion, which ends where it begins, is made.
        most_runs: how many runs are made at most.
        beside: whether a bare loop runs beside each, to tell what the machine misses itself.
    """

    name: str
    scenario: str
    rate_hz: int
    rehearsed: bool = False
    sharing: Sharing | None = None
    laps: int = 1
    most_runs: int = 1000
    beside: bool = False

    def loaded(self) -> Scenario:
        """Return the scenario of a run."""
        scenario = load_scenario(self.scenario)
        first, *others = scenario.waypoints
        return scenario.model_copy(update={"rate_hz": self.rate_hz, "waypoints": (first, *others * self.laps)})


KINDS = (
    SeriesKind("middle", "middle", 500),
    SeriesKind("encoders", "middle_encoders", 500),
    SeriesKind("kilohertz", "middle", 1000),
    SeriesKind("rehearsal", "middle_robot", 500, rehearsed=True),
    SeriesKind("odrive", "middle_odrive", 500, rehearsed=True),
    SeriesKind("moteus", "middle_moteus", 500, rehearsed=True),
    SeriesKind("ros2_control", "middle_ros2_control", 500, rehearsed=True),
    SeriesKind("motkin", "motkin_middle", 500, rehearsed=True),
    SeriesKind("together", "middle_robot", 500, rehearsed=True, sharing=Sharing.ROBOT),
    SeriesKind("odrive_together", "middle_odrive", 500, rehearsed=True, sharing=Sharing.ROBOT),
    SeriesKind("moteus_together", "middle_moteus", 500, rehearsed=True, sharing=Sharing.ROBOT),
    SeriesKind("minute", "middle_odrive", 1000, True, Sharing.ROBOT, laps=30, most_runs=1, beside=True),
)


class Series(NamedTuple):
    """The runs of one kind, and how many left no bag."""

    runs: tuple[GraphSpeed, ...]
    without_bag: int


def run_series(kind: SeriesKind, runs: int) -> Series:
    """Run a kind so many times, one after the other."""
    scenario = kind.loaded()
    runs = min(runs, kind.most_runs)
    found = []
    for _ in range(runs):
        try:
            found.append(graph_speed(scenario, Mode.REALTIME, kind.rehearsed, kind.sharing, beside=kind.beside))
        except BagError:
            continue
    return Series(tuple(found), runs - len(found))


def series_row(series: Series) -> tuple[str, ...]:
    """Return the figures of a series, in the order of `FIGURES`."""
    summaries = [run.summary for run in series.runs if run.summary is not None]
    completed = sum(not summary.not_completed_because for summary in summaries)
    errors = [summary.tracking_error_peak_m for summary in summaries if summary.tracking_error_peak_m is not None]
    late = [summary.overruns or 0 for summary in summaries]
    missing = [summary.missing_samples for summary in summaries]
    cpu = [run.cpu_ms[CONTROLLERS] for run in series.runs if CONTROLLERS in run.cpu_ms]
    latencies = [run.latency_ms for run in series.runs if run.latency_ms is not None]
    faults = Counter(fault.partition(":")[0] for run in series.runs for fault in run.faults[:1])
    if series.without_bag:
        faults["no bag"] = series.without_bag
    return (
        f"{completed} of {len(series.runs) + series.without_bag}",
        in_millimetres(max(errors)) if errors else "",
        _spread(late),
        _spread(missing),
        _missed_too(series.runs),
        _median(cpu),
        _median([latency["p50"] for latency in latencies]),
        _median([latency["p99"] for latency in latencies]),
        ", ".join(f"{name} {count}" for name, count in faults.most_common()) or "none",
    )


FIGURES = (
    "completed",
    "largest error",
    "late samples, median and most",
    "missing",
    "not recorded, missed by a bare loop beside too",
    "chain, ms per cycle",
    "sample to torque, ms",
    "its p99, ms",
    "first faults",
)
"""Times are medians over the runs: of the processor time of the control chain, and of the runs' medians and p99."""


def _missed_too(runs: Sequence[GraphSpeed]) -> str:
    """Return how many samples were not recorded, and how many of them a bare loop beside the runs missed too."""
    both = [(run.missing, run.missed_too) for run in runs if run.missed_too is not None]
    return f"{sum(missing for missing, _ in both)}, {sum(too for _, too in both)}" if both else ""


def _spread(counts: Sequence[int]) -> str:
    return f"{statistics.median(counts):g}, {max(counts)}" if counts else ""


def _median(values: Sequence[float]) -> str:
    return f"{statistics.median(values):.2f}" if values else ""


def chosen(words: Sequence[str]) -> tuple[int, tuple[SeriesKind, ...]]:
    """Return number of runs and kinds from the words of the command line, by default `RUNS` and all.

    Raises:
        SystemExit: a word is neither a number nor the name of a kind; the text names it.
    """
    names = {kind.name: kind for kind in KINDS}
    numbers = [word for word in words if word.isdigit()]
    unknown = [word for word in words if not word.isdigit() and word not in names]
    refused = [*unknown, *(word for word in numbers if int(word) == 0), *numbers[1:]]
    if refused:
        raise SystemExit(f"{refused[0]!r}: expected one number of runs, 1 or more, and some of {', '.join(names)}")
    kinds = tuple(names[word] for word in words if word in names)
    return int(numbers[0]) if numbers else RUNS, kinds or KINDS


def main() -> None:
    """Measure and print, each kind as soon as its runs have ended."""
    console = Console()
    runs, kinds = chosen(sys.argv[1:])
    rows = []
    for kind in kinds:
        with console.status(f"{kind.name}: {runs} runs"):
            series = run_series(kind, runs)
            seconds = max(LOOP_SECONDS, kind.loaded().plan().path.duration)
            loop = bare_loop(kind.rate_hz, round(seconds * kind.rate_hz), DEFAULT_PRIORITY)
        row = series_row(series)
        rows.append(row)
        # as soon as it is known: a long series may be interrupted
        console.print(f"{kind.name}: " + "; ".join(f"{name}: {cell}" for name, cell in zip(FIGURES, row, strict=True)))
        median, high = np.percentile(loop.lateness_ms, (50, 99))
        console.print(
            f"{loop.name}: late {loop.late} of {len(loop.periods_ms)};"
            f" from due to awake {median:.2f} ms, p99 {high:.2f} ms"
        )
        periods = {kind.name: [time for run in series.runs for time in run.periods_ms], loop.name: loop.periods_ms}
        console.print(histogram(f"{kind.name}: from one sample to the next", 1e3 / kind.rate_hz, periods))
    # a column for each kind, which a terminal of 80 characters shows whole
    table = Table("", *(f"{kind.name}, {kind.rate_hz} Hz" for kind in kinds), title=f"Real time, {stamp()}")
    for name, *cells in zip(FIGURES, *rows, strict=True):
        table.add_row(name, *cells)
    console.print(table)


if __name__ == "__main__":
    main()
