"""Subcommand that finds the faults of a robot at which each controller first fails: robustness."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from fivebar_bringup.cli.app import Group, JobsOption, JsonOption, command, input_errors
from fivebar_bringup.cli.study_options import (
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
from fivebar_description.errors import InputError
from fivebar_description.interrupts import keyboard_interrupts


@command(Group.STUDY, former={"--controller": "--controllers", "--sensors": "--rig"})
def robustness(
    effects: Annotated[
        str | None,
        typer.Option(
            "--effects",
            help="Some of the effects, such as lengths,zeros,elasticity, also of sensors, such as slip,gyro_clock"
            " [default: all but those of sensors]",
        ),
    ] = None,
    controllers: Annotated[
        str | None, controllers_option("unified,multi_cartesian,multi_joint, or unified with --rig")
    ] = None,
    robot: StudyRobotOption = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only 1 s and two draws of each size.")] = False,
    losses: Annotated[
        bool,
        typer.Option("--losses", help="Instead: commands or samples lost in bursts, at every moment of a crossing."),
    ] = False,
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
    of_effects = {"--effects": effects, "--robot": robot, "--quick": quick or None}
    of_sensors = {"--rig": rig, "--cases": cases, "--seed": seed}
    machines = Machines(jobs, scheduler, scheduler_file)
    if losses:
        _refuse("--losses", {**of_effects, **of_sensors})
        _losses(controllers, out, machines, as_json)
        return
    if rig is not None:
        _refuse("--rig", of_effects)
        _sensors(controllers, {"rig": rig, "cases": cases, "seed": seed}, out, machines, as_json)
        return
    _refuse("--effects", of_sensors)
    from fivebar_bringup.studies.rigs.declared import robot_name
    from fivebar_bringup.studies.robustness.robustness import QUICK, ROBUSTNESS
    from fivebar_bringup.studies.robustness.sensor_effects import ALL_EFFECTS

    with input_errors(), keyboard_interrupts():
        settings: dict[str, Any] = {
            "effects": None if effects is None else chosen("--effects", effects, ALL_EFFECTS),
            "controllers": chosen_controllers(controllers),
            "robot": None if robot is None else robot_name(robot),
            **(QUICK if quick else {}),
        }
        made = run_command(ROBUSTNESS.place, settings, out, machines, as_json)
    show_study(made, as_json, made.shown, made.shown.columns[:1] + made.shown.columns[2:5])


def _refuse(study: str, others: Mapping[str, object]) -> None:
    """Refuse options that the study of an option does not have."""
    with input_errors():
        for name, value in others.items():
            if value is not None:
                raise InputError(f"{name}: {value}: expected none in the study of {study}")


def _sensors(
    controllers: str | None, given: dict[str, Any], out: Path | None, machines: Machines, as_json: bool
) -> None:
    from fivebar_bringup.studies.rigs.named import find_rig
    from fivebar_bringup.studies.sensor_faults.sensor_faults import SENSOR_FAULTS

    with input_errors(), keyboard_interrupts():
        if not find_rig(given["rig"]).scenario.get("ekf", {}).get("gyro"):
            raise InputError(f"--rig: {given['rig']!r}: has no gyroscope: expected a rig with ekf: {{gyro: true}}")
        given["controllers"] = chosen_controllers(controllers)
        made = run_command(SENSOR_FAULTS.place, given, out, machines, as_json)
    show_study(made, as_json, made.shown, made.shown.columns[:5])


def _losses(controllers: str | None, out: Path | None, machines: Machines, as_json: bool) -> None:
    from fivebar_bringup.studies.robustness.bursts import LOSSES

    with input_errors(), keyboard_interrupts():
        made = run_command(LOSSES.place, {"controllers": chosen_controllers(controllers)}, out, machines, as_json)
    show_study(made, as_json, made.shown, made.shown.columns)
