# SPDX-License-Identifier: Apache-2.0
"""Subcommand that finds the faults of a robot at which each controller first fails: robustness."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import typer

from fivebar_bringup.cli.app import Group, JobsOption, JsonOption, command, input_errors
from fivebar_description.errors import InputError
from fivebar_description.interrupts import keyboard_interrupts
from fivebar_studies.cli.study_options import (
    Machines,
    SchedulerFileOption,
    SchedulerOption,
    StudyOutOption,
    StudyRobotOption,
    chosen,
    chosen_controllers,
    controllers_option,
    run_command,
    show_study,
)


@command(
    Group.STUDY,
    former={
        "--controller": "--controllers",
        "--sensors": "--rig",
        "--losses": "--effects=commands,samples",
    },
)
def robustness(
    effects: Annotated[
        str | None,
        typer.Option(
            "--effects",
            help="Some of the effects, such as lengths,zeros,elasticity, also of sensors, such as slip,gyro_clock, and"
            " bursts of lost commands,samples [default: all but those of sensors and bursts]",
        ),
    ] = None,
    controllers: Annotated[
        str | None, controllers_option("unified,multi_cartesian,multi_joint, or unified with --rig")
    ] = None,
    robot: StudyRobotOption = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only 1 s and two draws of each size.")] = False,
    rig: Annotated[
        str | None,
        typer.Option("--rig", metavar="RIG", help="Instead: faults of the sensors on random crossings of a rig."),
    ] = None,
    cases: Annotated[
        int | None, typer.Option("--cases", min=1, help="With --rig: random crossings [default: 120]")
    ] = None,
    seed: Annotated[int | None, typer.Option("--seed", min=0, help="With --rig: of all [default: 1]")] = None,
    out: StudyOutOption = None,
    jobs: JobsOption = None,
    scheduler: SchedulerOption = None,
    scheduler_file: SchedulerFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Find how large each fault of a robot may be.

    Each fault, from wrong lengths to backlash, is raised alone until a controller fails. With `--rig` the sensors
    of a rig's robots fail in every way on random crossings, and a table says what is survived, and named how.

    Example: `fivebar robustness --effects lengths,zeros,elasticity --out runs/robustness`
    """
    from fivebar_studies.rigs.declared import robot_name
    from fivebar_studies.rigs.named import find_rig
    from fivebar_studies.robustness.robustness import QUICK, ROBUSTNESS
    from fivebar_studies.robustness.sensor_effects import ALL_EFFECTS

    with input_errors(), keyboard_interrupts():
        if rig is None:
            _refuse("--effects", {"--cases": cases, "--seed": seed})
        else:
            _refuse("--rig", {"--effects": effects, "--robot": robot, "--quick": quick or None})
            if not find_rig(rig).scenario.get("ekf", {}).get("gyro"):
                raise InputError(f"--rig: {rig!r}: has no gyroscope: expected a rig with ekf: {{gyro: true}}")
        settings: dict[str, Any] = {
            "effects": None if effects is None else chosen("--effects", effects, ALL_EFFECTS),
            "controllers": chosen_controllers(controllers),
            "robot": None if robot is None else robot_name(robot),
            "rig": rig,
            "cases": cases,
            "seed": seed,
            **(QUICK if quick else {}),
        }
        finished = run_command(ROBUSTNESS.place, settings, out, Machines(jobs, scheduler, scheduler_file), as_json)
    columns = finished.shown.columns
    show_study(finished, as_json, finished.shown, columns[:5] if rig else columns[:1] + columns[2:5])


def _refuse(study: str, others: Mapping[str, object]) -> None:
    """Refuse options that the study of an option does not have."""
    for name, value in others.items():
        if value is not None:
            raise InputError(f"{name}: {value}: expected none in the study of {study}")
