# SPDX-License-Identifier: Apache-2.0
"""Subcommand that simulates leading a robot by hand: guide."""

from __future__ import annotations

import json

from fivebar_bringup.cli.app import Group, JsonOption, OutOption, ScenarioArgument, command, input_errors
from fivebar_bringup.cli.printing import Printer
from fivebar_bringup.cli.progress import progress_bar
from fivebar_description.interrupts import interrupts_deferred, keyboard_interrupts


@command(Group.ROBOT)
def guide(scenario: ScenarioArgument, out: OutOption = None, as_json: JsonOption = False) -> None:
    """Simulate leading a robot by hand, to calibrate from it.

    A hand leads the robot of SCENARIO along its waypoints, without power. The bag has the motors' readings and those of
    the IMU; docs/calibration.md calibrates from it.

    Example: `fivebar guide calibration --out runs/led`, then `fivebar calibrate runs/led --encoders-only`
    """
    from fivebar_bringup.recorded.results import write_errors
    from fivebar_bringup.recorded.run_directory import new_run_directory
    from fivebar_bringup.scenarios.scenario_files import load_scenario
    from fivebar_bringup.simulation.guided import guide as lead
    from fivebar_bringup.simulation.guided import write_guided_bag
    from fivebar_description.modules import modules_unopened

    # a hand leads the robot, no law does
    with input_errors(), keyboard_interrupts(), modules_unopened():
        loaded = load_scenario(scenario)
        with progress_bar(loaded.name, as_json):
            samples = lead(loaded)
        with interrupts_deferred():
            run = new_run_directory(out, loaded)
            with write_errors(run.path):
                write_guided_bag(samples, loaded, run.bag)
    force = max(sample.force for sample in samples)
    if as_json:
        print(json.dumps({"run": str(run.path), "samples": len(samples), "force_peak_n": force}, indent=2))
        return
    Printer().print(f"{len(samples)} samples, the hand pulls with up to {force:.1f} N: {run.path}", soft_wrap=True)
