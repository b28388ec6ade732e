"""Runs the controllers of this project on the benchmark, in a file that can be resumed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

from fivebar_bringup.recorded.results import write_errors
from fivebar_bringup.simulation.case import case_of, sampled
from fivebar_bringup.simulation.outcome import FAULT_NAMES
from fivebar_bringup.simulation.uncompiled import crossing as run_crossing
from fivebar_bringup.studies.benchmark.crossings import BenchmarkCrossing, benchmark
from fivebar_bringup.studies.benchmark.scoring import HEAD, Result, as_line, read_results
from fivebar_bringup.studies.engine.local import stream
from fivebar_bringup.studies.sweep.running import planned
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.interrupts import resumable
from fivebar_description.strict_yaml import InputError
from fivebar_description.text_file import LARGEST_TABLE, append_to_file, read_text, write_file

NOT_STARTED = "not_started"
"""In place of a fault: the estimator could not tell the assembly mode at the start."""

NOT_FINISHED = "not_finished"
"""The run ended early, as where the plant's equations have no solution."""


class BenchmarkTask(NamedTuple):
    """A crossing on a robot of a rig, for some controllers."""

    crossing: BenchmarkCrossing
    rig: str
    controllers: tuple[str, ...]


def run_task(task: BenchmarkTask) -> list[Result]:
    """Return the results of a task, one for each controller."""
    case = task.crossing.on(task.rig)
    number = task.crossing.crossing
    try:
        plan = planned(case)
    except InputError:
        return [
            Result(number, task.rig, controller, NOT_STARTED, 0, float("nan"), float("nan"), 0.0)
            for controller in task.controllers
        ]
    results = []
    for controller in task.controllers:
        scenario = case.scenario(controller)
        samples = sampled(scenario.five_bar(), plan, scenario.rate_hz, scenario.lead_samples)
        outcome = run_crossing(case_of(scenario), samples)
        fault = FAULT_NAMES[outcome.fault]
        if outcome.fault == NO_FAULT and outcome.samples != plan.path.samples(scenario.rate_hz) + 1:
            fault = NOT_FINISHED
        results.append(
            Result(
                number,
                task.rig,
                controller,
                fault,
                outcome.mode_changes,
                outcome.error_peak,
                outcome.error_final,
                max(outcome.applied1, outcome.applied2),
            )
        )
    return results


def run_benchmark(
    out: Path,
    rigs: Sequence[str],
    controllers: Sequence[str],
    count: int,
    workers: int,
    progress: Callable[[int, int], None],
) -> list[Result]:
    """Run what the file lacks, and return all results in it.

    Crossing after crossing, so that what is there when it is interrupted is the same part for all.

    Args:
        out: the file, which is made or continued.
        rigs, controllers: by name.
        count: the first so many crossings.
        workers: processes.
        progress: called with the number of runs that are there and that are wanted.

    Raises:
        InputError: the file holds something else, or cannot be used.
        ResumableInterrupt: it was interrupted; the file has the crossings that were finished.
    """
    with write_errors(out):
        text = read_text(out, LARGEST_TABLE) if out.exists() else ""
        # the last line of a run that was interrupted may be incomplete
        whole = text[: text.rfind("\n") + 1] if text else HEAD
        results = read_results(whole, str(out))
        if whole != text:
            write_file(out, whole)
        done = {result[:3] for result in results}
        tasks = []
        for crossing in benchmark()[:count]:
            for rig in rigs:
                left = tuple(name for name in controllers if (crossing.crossing, rig, name) not in done)
                if left:
                    tasks.append(BenchmarkTask(crossing, rig, left))
        total = count * len(rigs) * len(controllers)
        left_over = sum(len(task.controllers) for task in tasks)
        progress(total - left_over, total)
        kept = f"{out}: interrupted: keeps the finished crossings: the same command with --out {out} resumes"
        with resumable(kept), closing(stream(run_task, tasks, workers)) as coming:
            for found in coming:
                append_to_file(out, "".join(map(as_line, found)).encode("utf-8"))
                results += found
                left_over -= len(found)
                progress(total - left_over, total)
    return results
