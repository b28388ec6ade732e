# SPDX-License-Identifier: Apache-2.0
"""Subcommand that finds a robot's parameters from a recording: identify."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from fivebar_bringup.cli.app import Group, JsonOption, RecordedNamespaceOption, command, input_errors
from fivebar_bringup.cli.printing import Printer
from fivebar_bringup.cli.progress import progress_bar
from fivebar_bringup.runs.namespace import read_namespace
from fivebar_description.errors import InputError
from fivebar_description.interrupts import keyboard_interrupts

if TYPE_CHECKING:
    from fivebar_bringup.identify.result import IdentificationResult
    from fivebar_control.identification.motor_map import MotorMap, MotorValue

MOST_PERIODS = 1000
"""Largest number of periods of cogging in a turn."""


@command(Group.ROBOT)
def identify(
    bag: Annotated[Path, typer.Argument(metavar="BAG", help="A bag, or the directory of a run.")],
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot",
            help="Robot whose lengths are right, by name or file (.yaml) [default: that of the run]",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="New or empty directory for the results [default: runs/identify-ROBOT-DATE-TIME]"),
    ] = None,
    cogging: Annotated[
        str | None,
        typer.Option(
            "--cogging",
            metavar="PERIODS",
            help="Map the motors instead: torque per commanded torque, friction, and cogging with so many periods a"
            ' turn, such as "12,24". Inertias and mass are those of the robot file, weighed or identified before. It is'
            " printed only.",
        ),
    ] = None,
    resonance: Annotated[
        bool,
        typer.Option(
            "--resonance",
            help="Find the elastic transmissions instead, from the chirp of the scenario excitation_resonance, and"
            " write the robot's file with the bandwidth that they allow.",
        ),
    ] = False,
    namespace: RecordedNamespaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Find inertias, mass and friction from a recorded run.

    The results are written as a robot file. A motion that excites all of them is the scenario excitation;
    docs/identification.md goes through it.

    Example: `fivebar identify runs/moved`, of a run made by `fivebar simulate excitation --out runs/moved`
    """
    from fivebar_bringup.identify.identify import ROBOT_FILE, identify_bag, write_identification

    with input_errors(), keyboard_interrupts():
        within = None if namespace is None else read_namespace(namespace)
        if cogging is not None and resonance:
            raise InputError("--resonance: expected without --cogging")
        if resonance:
            _find_resonance(bag, robot, out, as_json, within)
            return
        if cogging is not None:
            _map(bag, robot, cogging, out, as_json, within)
            return
        with progress_bar("identification", as_json):
            findings = identify_bag(bag, robot, within)
            directory = write_identification(findings, out)
    if as_json:
        print(json.dumps(findings.as_json(), indent=2, allow_nan=False))
        return
    printer = Printer()
    printer.print(_table(findings))
    cutoffs, fit = findings.identification.cutoffs, findings.identification.fit
    printer.print(
        f"condition number {fit.condition:.3g}; {findings.encoder()}: derivatives cut off at"
        f" {cutoffs.derivative_hz:.3g} Hz, equations at {cutoffs.parallel_hz:.3g} Hz",
        soft_wrap=True,
    )
    printer.print(f"robot file {directory.path / ROBOT_FILE}, look at {directory.page}", soft_wrap=True)


def _find_resonance(bag: Path, robot: str | None, out: Path | None, as_json: bool, namespace: str | None) -> None:
    """Print the transmissions, and write the robot's file.

    Raises:
        InputError: the bag, the robot or the motion is unsuitable, no resonance is visible, or the directory is taken.
    """
    from fivebar_bringup.identify.resonance import resonance_of_bag, write_resonance
    from fivebar_bringup.identify.result import INTERVALS

    with progress_bar("identification", as_json):
        result = resonance_of_bag(bag, robot, namespace)
        file = write_resonance(result, out)
    if as_json:
        print(json.dumps(result.as_json(), indent=2, allow_nan=False))
        return
    resonance, printer = result.resonance, Printer()
    table = Table(f"transmission, {INTERVALS}", "leg 1 (left)", "leg 2 (right)", "unit", box=None)
    for name, unit in (("frequency", "Hz"), ("damping", ""), ("rotor_share", "")):
        values = [getattr(leg, name) for leg in resonance.legs]
        table.add_row(name, *(f"{value.value:.4g} ± {value.half_width:.2g}" for value in values), unit)
    printer.print(table)
    printer.print(
        f"on locked rotors the links swing at {resonance.locked[0]:.3g} and {resonance.locked[1]:.3g} Hz here;"
        f" response used up to {resonance.highest:.3g} Hz\n"
        f"unified: bandwidth at most {result.allowed:.3g} rad/s from an estimate,"
        f" {result.allowed_on_links:.3g} rad/s with speeds that are measured on the links",
        soft_wrap=True,
    )
    if resonance.amplitudes == 1:
        printer.print("one amplitude: play of the transmissions, if any, makes these frequencies too low")
    change = "with its tuning" if result.lowered else "unchanged but for its name: the present gains are low enough"
    printer.print(f"robot file {file}, {change}", soft_wrap=True)


def _map(bag: Path, robot: str | None, cogging: str, out: Path | None, as_json: bool, namespace: str | None) -> None:
    """Print the maps of the motors.

    Raises:
        InputError: there is something to write, or the bag, the robot, the periods or the motion are unsuitable.
    """
    from fivebar_bringup.identify.identify import map_bag

    if out is not None:
        raise InputError("--out: expected without --cogging, whose map is printed")
    with progress_bar("identification", as_json):
        motors = map_bag(bag, robot, _periods(cogging), namespace)
    if as_json:
        print(json.dumps({"motors": [motor.as_json() for motor in motors]}, indent=2, allow_nan=False))
    else:
        Printer().print(_motors(motors))


def _periods(text: str) -> tuple[int, ...]:
    """Return the periods of an option.

    Raises:
        InputError: they are no numbers from 1 on, each once.
    """
    words = [word.strip() for word in text.split(",")]
    periods = tuple(int(word) for word in words if word.isdecimal())
    unique = len(set(periods)) == len(words)
    if not (unique and all(0 < period <= MOST_PERIODS for period in periods)):
        raise InputError(f'--cogging: {text!r}: expected numbers of periods in a turn, such as "12,24"')
    return periods


def _motors(motors: tuple[MotorMap, MotorMap]) -> Table:
    from fivebar_bringup.identify.result import INTERVALS

    table = Table(f"motor, {INTERVALS}", "1 (left)", "2 (right)", "unit", box=None)

    def row(name: str, unit: str, values: Sequence[MotorValue]) -> None:
        table.add_row(name, *(f"{value.value:.4g} ± {value.half_width:.2g}" for value in values), unit)

    row("actual over commanded torque", "", [motor.gain for motor in motors])
    row("Coulomb friction, as commanded", "Nm", [motor.coulomb for motor in motors])
    row("offset, as commanded", "Nm", [motor.offset for motor in motors])
    row("viscous friction, as commanded", "Nm s/rad", [motor.viscous for motor in motors])
    for of_both in zip(*(motor.cogging for motor in motors), strict=True):
        row(f"cogging with {of_both[0].periods} periods", "Nm", [ripple.amplitude for ripple in of_both])
    return table


def _table(findings: IdentificationResult) -> Table:
    from fivebar_bringup.identify.result import INTERVALS

    table = Table("parameter", "before", f"identified, {INTERVALS}", "unit", "change", box=None)
    for line in findings.rows():
        table.add_row(*line)
    cogging = findings.cogging()
    for motor, harmonics in enumerate((cogging.q11, cogging.q21), start=1):
        for harmonic in harmonics:
            size = math.hypot(harmonic.cosine, harmonic.sine)
            table.add_row(f"cogging {motor}", "", f"{size:.3g}, {harmonic.periods} periods", "Nm", "")
    return table
