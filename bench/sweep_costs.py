# SPDX-License-Identifier: Apache-2.0
"""Itemises a case of a sweep: `python bench/sweep_costs.py [RIG [CASES]]`, "" for no rig."""

from __future__ import annotations

import sys
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping
from types import FrameType
from typing import Any

from rich.console import Console
from rich.table import Table

from fivebar_bringup.simulation import engine
from fivebar_studies.sweep.sweep import SweepSettings, run_numbered

RUNS, REST = "compiled runs: predictions, odds, the run itself", "planning, durations, the rest"

PARTS: Mapping[tuple[str, str], str] = {
    ("fivebar_bringup.simulation.engine", "crossing"): RUNS,
    ("fivebar_control.planning.feasibility", "screen"): "screen of references",
    ("fivebar_bringup.simulation.case", "sampled"): "plan at the samples",
    ("fivebar_bringup.simulation.case", "case_of"): "constants and random numbers of the runs",
    ("fivebar_bringup.odds.robot_errors", "with_drawn_robot"): "constants and random numbers of the runs",
    ("fivebar_description.strict_yaml", "validate"): "scenarios, checked",
    ("fivebar_control.planning.predicted_estimate", "predict_estimate"): "estimate that is predicted",
}
"""Parts of a case by module and function; the innermost of them that is being called counts."""

EVERY = 1e-3
"""Time (s) between two looks."""

SEED, WARM = 1, 3
"""Seed of the cases, and the number of first cases that are left out, which load machine code."""


def costs_of(work: Callable[[], object], parts: Mapping[tuple[str, str], str]) -> defaultdict[str, float]:
    """Do some work in this thread, and return the processor time (s) that each part of it has taken.

    Another thread looks again and again which function is being called. What the processor has done since it last
    looked belongs to that function, so that a busy machine makes the figures coarser, not larger.
    """
    watched = threading.get_ident()
    clock, over = time.pthread_getcpuclockid(watched), threading.Event()
    found = defaultdict[str, float](float)

    def look() -> None:
        before = time.clock_gettime(clock)
        while not over.wait(EVERY):
            now = time.clock_gettime(clock)
            found[_part(sys._current_frames()[watched], parts)] += now - before
            before = now

    watcher, interval = threading.Thread(target=look), sys.getswitchinterval()
    sys.setswitchinterval(0.2 * EVERY)
    watcher.start()
    try:
        work()
    finally:
        over.set()
        watcher.join()
        sys.setswitchinterval(interval)
    return found


def _part(frame: FrameType | None, parts: Mapping[tuple[str, str], str]) -> str:
    while frame is not None:
        part = parts.get((frame.f_globals.get("__name__", ""), frame.f_code.co_name))
        if part is not None:
            return part
        frame = frame.f_back
    return REST


def main() -> None:
    """Measure and print."""
    rig, count = sys.argv[1] if len(sys.argv) > 1 else "good", int(sys.argv[2]) if len(sys.argv) > 2 else 60
    settings, runs = SweepSettings(seed=SEED, rig=rig, controllers=("unified",)), Counter[str]()
    loop_of = engine._loop

    def counted(effects: bool, **of_laws: Callable[..., Any]) -> Any:
        runs[RUNS] += 1
        return loop_of(effects, **of_laws)

    console = Console()
    with console.status(f"{count} cases"):
        for number in range(count, count + WARM):
            run_numbered(settings, number)
        engine._loop = counted  # type: ignore[assignment]
        costs = costs_of(lambda: [run_numbered(settings, number) for number in range(count)], PARTS)
    table = Table("part", "ms of processor time a case", title=f"unified, {f'rig {rig}' if rig else 'no rig'}")
    for part in dict.fromkeys((*PARTS.values(), REST)):
        words = f", {runs[part] / count:.1f} of them" if runs[part] else ""
        table.add_row(f"{part}{words}", f"{1e3 * costs[part] / count:.0f}")
    table.add_row("in all", f"{1e3 * sum(costs.values()) / count:.0f}")
    console.print(table)


if __name__ == "__main__":
    main()
