# SPDX-License-Identifier: Apache-2.0
"""Running a scenario without ROS, and reporting on it; imports none of what the node graph needs."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fivebar_bringup.recorded.outcome import INTERRUPTED_FAULT
from fivebar_bringup.recorded.results import write_errors
from fivebar_bringup.recorded.run_directory import RunDirectory, new_run_directory, write_timing
from fivebar_bringup.recorded.summary import Summary
from fivebar_bringup.report.report import write_report
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.offline import simulate, write_bag
from fivebar_description.interrupts import interrupts_allowed, interrupts_deferred
from fivebar_sim.simulated_plant import SampledRobot

if TYPE_CHECKING:
    from fivebar_bringup.runs.launcher import Progress


def run_offline(
    scenario: Scenario,
    out: Path | None,
    progress: Progress,
    with_page: bool = True,
    odds: Mapping[str, Any] | None = None,
    plant: SampledRobot | None = None,
) -> tuple[RunDirectory, Summary]:
    """Run a scenario in this process, without ROS, and keep the odds of its motion, where they are known, with it.

    The robot is the one that the scenario describes, or a given one.

    Where a block that defers interrupts would raise one, the run ends with its last finished sample instead.

    Raises:
        InputError: the motion is refused or the output directory cannot be used.
    """
    began = time.monotonic()
    faults: list[str] = []

    def interrupted() -> bool:
        try:
            with interrupts_allowed():
                return False
        except KeyboardInterrupt:
            faults.append(f"{INTERRUPTED_FAULT}: stopped by a signal")
            return True

    with interrupts_deferred():
        run = new_run_directory(out, scenario, odds)
        last = scenario.plan().path.samples(scenario.rate_hz)
        result = simulate(scenario, lambda sample: progress(sample, last), plant, interrupted)
        wall_s = time.monotonic() - began
        with write_errors(run.path):
            write_bag(result, scenario, run.bag)
        write_timing(run, {"runner": "offline", "mode": None, "wall_s": wall_s, "faults": faults})
        return run, write_report(run, with_page)
