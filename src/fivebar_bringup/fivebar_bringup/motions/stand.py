# SPDX-License-Identifier: Apache-2.0
"""A graph that keeps running after its planned motion: the robot rests and accepts goals."""

from __future__ import annotations

from collections.abc import Sequence

from fivebar_bringup.drives.run_files import Rehearsal
from fivebar_bringup.graph.crossing_graph import Work, crossing_graph
from fivebar_bringup.graph.node_spec import Mode, NodeSpec
from fivebar_bringup.graph.standing import LONGEST, check_takes_goals, standing
from fivebar_bringup.odds.robot_errors import has_odds
from fivebar_bringup.recorded.run_directory import RunDirectory, new_run_directory
from fivebar_bringup.recorded.summary import Summary
from fivebar_bringup.runs.launcher import INTERRUPTED, GraphOutcome, RunOptions, run_graph
from fivebar_bringup.runs.processes import ProcessSpec, processes
from fivebar_bringup.runs.run import report_on, run_prepared
from fivebar_bringup.scenario import Scenario
from fivebar_description.interface import DEFAULT_PRIORITY
from fivebar_description.interrupts import interrupts_allowed, interrupts_deferred, resumable
from fivebar_description.ros.scheduling import Scheduling


def stand(
    scenario: Scenario,
    seconds: float | None,
    options: RunOptions,
) -> tuple[RunDirectory, Summary]:
    """Run a scenario with all nodes, then let the robot rest for some seconds of simulated time; return its summary.

    Without a time it rests until it is interrupted, which then is no fault. A further interrupt ends the reading of its
    bag, which takes as long as a tenth of the run.

    Raises:
        InputError: the controller accepts no goals, or the output directory cannot be used.
        ResumableInterrupt: the summary has not been written.
    """
    check_takes_goals(scenario)

    def specs() -> Sequence[ProcessSpec]:
        resting = LONGEST if seconds is None else round(seconds * scenario.rate_hz)
        nodes = standing_graph(scenario, options.mode, run, resting, Work())
        return processes(nodes, options.mode, scenario.rate_hz, Scheduling(DEFAULT_PRIORITY))

    def follow(specs: Sequence[ProcessSpec], chosen: int) -> GraphOutcome:
        return run_graph(specs, run, chosen, options)

    with interrupts_deferred():
        run = new_run_directory(options.out, scenario, options.odds)
        outcome = run_prepared(scenario, options, specs, follow, has_odds(scenario))
        # whoever interrupts a robot that rests has had what was asked for, but not before it has begun
        as_asked = seconds is None and run.bag.exists()
        faults = [fault for fault in outcome.faults if not (as_asked and fault == INTERRUPTED)]
        with resumable(f"interrupted: `fivebar report {run.path}` judges the run"), interrupts_allowed():
            return run, report_on(run, scenario, options.mode, outcome._replace(faults=faults), with_page=False)


def standing_graph(
    scenario: Scenario, mode: Mode, run: RunDirectory, resting: int, work: Work, rehearsal: Rehearsal | None = None
) -> tuple[NodeSpec, ...]:
    """Return the nodes of a run whose robot rests for some samples after its plan, and takes requests."""
    last = min(scenario.plan().path.samples(scenario.rate_hz) + resting, LONGEST)
    nodes = crossing_graph(scenario, mode, run.bag, rehearsal, work=work)
    return tuple(standing(node, last, scenario) for node in nodes)
