# SPDX-License-Identifier: Apache-2.0
"""What `make bench` says of real time."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from operator import attrgetter
from pathlib import Path

import pytest

import cycle_costs
from cycle_costs import (
    DRIVES,
    ITEMS,
    REST,
    TICK,
    WARM_UP,
    WRITTEN,
    Costs,
    WatchedGroup,
    importable,
    medians,
)
from estimator_speed import estimator_us
from fivebar_bringup.graph.node_spec import NodeSpec
from fivebar_bringup.scenarios.scenario_files import load_scenario
from graph_speed import GraphSpeed, missing_stamps
from itemised import costs_rows
from real_time import real_time_rows
from series import FIGURES, KINDS, RUNS, Series, chosen, series_row
from stalls import LateBeat, Stalls, bare_loop, bare_loop_beside, missed_by_both


def test_each_figure_of_real_time_stands_beside_that_of_a_bare_loop() -> None:
    periods = [2.0] * 98 + [3.5, 8.0]
    latency = {"p50": 0.4, "p99": 0.9, "max": 7.25}
    graph = GraphSpeed(2.0, 3.5, 1.0, 2, latency, {"controllers": 0.4, "plant": 0.5}, [], periods)
    loop = Stalls(1, True, [0.05] * 99 + [6.5], [2.0] * 99 + [8.5])
    rows = {name: (chain, bare, target) for name, chain, bare, target in real_time_rows(graph, loop, 100)}
    assert rows["missed deadlines"][:2] == ("2 of 100", "1 of 100")
    chain, bare, _ = rows["from one sample to the next"]
    assert (chain[-15:], bare[-15:]) == ("8.00 ms at most", "8.50 ms at most")
    chain, bare, target = rows["from sample to torque; loop: from due to awake"]
    assert chain == "0.40 ms median, 0.90 ms p99, 7.25 ms at most"
    assert bare.startswith("0.05 ms median") and bare.endswith("6.50 ms at most")
    assert target == "at most 0.45 ms median, 1.00 ms p99"
    assert [target for name, (_, _, target) in rows.items() if name.startswith("processor")] == ["at most 0.45 ms", ""]


def test_every_function_of_an_item_is_there() -> None:
    for place in (*(place for places in ITEMS.values() for place in places), TICK, WRITTEN):
        module, _, name = place.partition(":")
        assert callable(attrgetter(name)(import_module(module))), place


def test_a_process_that_is_itemised_finds_the_module_that_does_it(tmp_path: Path) -> None:
    find = [sys.executable, "-P", "-c", "import cycle_costs"]
    before = dict(os.environ)
    with importable():
        found = subprocess.run(find, cwd=tmp_path, check=False)
    assert found.returncode == 0
    assert dict(os.environ) == before
    assert subprocess.run(find, cwd=tmp_path, check=False, stderr=subprocess.DEVNULL).returncode != 0
    nodes = tuple(NodeSpec("fivebar_control", name, {}, (), ()) for name in ("supervisor", "blender"))
    assert WatchedGroup("controllers", nodes).module == "cycle_costs"
    assert WatchedGroup("alone", nodes[:1]).module == nodes[0].module


def test_an_item_s_time_leaves_out_that_of_what_it_calls_and_ends_with_the_torque(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = [0.0]
    monkeypatch.setattr(cycle_costs, "perf_counter", lambda: now[0])
    costs = Costs()

    def takes(seconds: float, *calls: Callable[[], None]) -> Callable[[], None]:
        def work() -> None:
            now[0] += seconds
            for call in calls:
                call()

        return work

    guard, law, read, sent = [item for item in ITEMS if item != DRIVES][:4]
    torque = costs.timed(law, takes(3e-3, costs.timed(guard, takes(2e-3))))
    parts = costs.timed(read, takes(4e-3)), costs.written(torque), costs.timed(sent, takes(5e-3))
    tick = costs.cycle(takes(1e-3, *parts))
    for _ in range(WARM_UP + 3):
        tick()
    # a cycle without a torque does not count, nor does what is called outside of one
    costs.cycle(takes(9.0))()
    torque()
    found = medians(costs)
    assert found.cycles == 3
    before = {item: round(1e3 * found.before[item], 6) for item in (REST, guard, law, read, sent)}
    assert before == {REST: 1.0, guard: 2.0, law: 3.0, read: 4.0, sent: 0.0}
    assert {item for item, seconds in found.after.items() if seconds > 0.0} == {sent}
    rows = {name: (first, second) for name, first, second in costs_rows(found)}
    assert rows["sum"] == ("10.000", "5.000")


def test_only_an_estimator_has_a_speed() -> None:
    with pytest.raises(ValueError, match=r"^middle: estimator none: expected ekf$"):
        estimator_us(load_scenario("middle"))


@pytest.mark.extra
def test_the_speed_of_the_estimator_is_in_microseconds_per_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    short = load_scenario("gyro_middle").model_copy(update={"segment_duration": 0.5})
    calls = itertools.count()
    monkeypatch.setattr("estimator_speed.perf_counter", lambda: 3e-6 * next(calls))
    assert estimator_us(short) == pytest.approx(3.0)
    assert next(calls) == 2 * (short.plan().path.samples(short.rate_hz) + 1)


def test_a_bare_loop_notes_every_beat() -> None:
    loop = bare_loop(1000, 5, 50)
    assert len(loop.lateness_ms) == len(loop.periods_ms) == 5


def test_a_missing_sample_is_told_from_one_that_a_bare_loop_beside_missed_too() -> None:
    """Samples of 1 ms, of which those at 2, 3 and 7 ms are missing, and a loop that woke at 3.5 for its beat of 1.9."""
    stamps = [0, 1_000_000, 4_000_000, 4_000_000, 5_000_000, 6_000_000, 8_000_000]
    missing = missing_stamps(stamps, 1000)
    assert missing == [2_000_000, 3_000_000, 7_000_000]
    assert missed_by_both(missing, [LateBeat(1_900_000, 3_500_000)], 1_000_000) == 2
    assert missed_by_both(missing, [], 1_000_000) == 0
    run = GraphSpeed(2.0, 3.5, 1.0, 2, None, {}, [], [2.0], missing=3, missed_too=2)
    row = dict(zip(FIGURES, series_row(Series((run, run), 0)), strict=True))
    assert row["not recorded, missed by a bare loop beside too"] == "6, 4"


def test_a_bare_loop_beside_ends_with_what_it_runs_beside() -> None:
    with bare_loop_beside(1000) as stalls:
        assert stalls == []
    assert all(one.woke - one.due > 1_000_000 for one in stalls)


def test_a_series_counts_its_runs_and_names_their_faults() -> None:
    latency = {"p50": 0.4, "p99": 0.9, "max": 7.25}
    run = GraphSpeed(2.0, 3.5, 1.0, 2, latency, {"controllers": 0.4}, [], [2.0])
    stopped = run._replace(faults=["command_stale: late", "state_stale: late"], latency_ms=None, cpu_ms={})
    row = dict(zip(FIGURES, series_row(Series((run, run, stopped), 1)), strict=True))
    assert row["completed"] == "0 of 4"
    assert row["sample to torque, ms"] == "0.40"
    assert row["first faults"] == "command_stale 1, no bag 1"
    assert series_row(Series((), 2))[0] == "0 of 2"


def test_a_series_is_chosen_by_name_and_number() -> None:
    assert chosen([]) == (RUNS, KINDS)
    assert chosen(["40", "kilohertz"]) == (40, KINDS[2:3])


@pytest.mark.parametrize(
    ("words", "refused"), [(["middle", "fast"], "fast"), (["0", "middle"], "0"), (["20", "40"], "40")]
)
def test_what_is_no_series_is_refused_by_name(words: list[str], refused: str) -> None:
    with pytest.raises(SystemExit, match=f"^'{refused}': expected one number of runs, .* some of middle, encoders, "):
        chosen(words)
