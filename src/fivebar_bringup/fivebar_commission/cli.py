# SPDX-License-Identifier: Apache-2.0
"""Subcommand that leads from a box of parts to the first crossing: commission."""

from __future__ import annotations

import sys
from contextlib import closing
from pathlib import Path
from typing import Annotated

import typer

from fivebar_bringup.cli.app import COMPLETED, FAILED, Group, JsonOption, command, input_errors
from fivebar_bringup.cli.printing import complain, say
from fivebar_bringup.cli.progress import progress_bar
from fivebar_description.interrupts import keyboard_interrupts, resumable


@command(Group.ROBOT)
def commission(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="The robot as drawn: a shipped one, or a file.")],
    torque: Annotated[float, typer.Option("--torque", help="Largest torque of either motor that is allowed, Nm.")],
    speed: Annotated[float, typer.Option("--speed", help="Largest speed of either motor that is allowed, rad/s.")],
    drives: Annotated[
        str | None,
        typer.Option("--drives", help="Configuration of the real drives, by name or file [default: the robot's]"),
    ] = None,
    practice: Annotated[
        str | None,
        typer.Option(
            "--practice",
            metavar="NUMBER|FILE",
            help="Practise on a simulated robot instead, in simulated time: drawn at random by a number, or as a file"
            " says, such as practice.yaml of an earlier practice.",
        ),
    ] = None,
    realtime: Annotated[
        bool,
        typer.Option(
            "--realtime",
            help="With --practice: by the clock, as with a real robot: drives on a bus in another process, the graph of"
            " nodes for every motion.",
        ),
    ] = False,
    imu_rate: Annotated[
        int,
        typer.Option(
            "--imu-rate",
            min=0,
            max=10_000,
            help="Readings a second of the IMU on the distal link of leg 2, on imu/data; 0 for none.",
        ),
    ] = 0,
    answers: Annotated[
        str | None,
        typer.Option(
            "--answers",
            metavar="FILE|-",
            help="Answers by the keys of the questions (.yaml), - for standard input, in place of a person.",
        ),
    ] = None,
    last: Annotated[str | None, typer.Option("--until", metavar="STEP", help="Stop after this step.")] = None,
    again: Annotated[
        str | None, typer.Option("--again", metavar="STEP", help="Go back to this step, which is repeated.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Directory, which a later call resumes from [default: runs/commission-ROBOT]"),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Lead from a box of parts to the first crossing.

    Steps with a gate after each: what is found out is written into the files of robot and drives in the directory, and
    into one page. Ctrl-C leaves at any moment, without torque, and the same command resumes.

    Example: `fivebar commission dextar --torque 3 --speed 12 --practice 1`
    """
    from fivebar_bringup.recorded.results import json_text
    from fivebar_commission.page import PAGE
    from fivebar_commission.person import PersonLeft
    from fivebar_commission.steps.begin import begun
    from fivebar_commission.steps.sequence import commission as go_through

    # standard output is for the result alone
    tell = complain if as_json else say
    with input_errors(), keyboard_interrupts():
        session = begun(
            robot=robot,
            torque=torque,
            speed=speed,
            drives=drives,
            practice=practice,
            answers=answers,
            again=again,
            last=last,
            out=out,
            imu_rate_hz=imu_rate,
            tell=tell,
            read=sys.stdin.readline,
            realtime=realtime,
        )
        session.shown = lambda name: progress_bar(name, as_json)
        words = f"left: {session.folder} has what was found, and the same command resumes"
        with closing(session), resumable(words):
            try:
                ended = go_through(session, last)
            except PersonLeft as left:
                tell(f"{left}; {words}")
                raise typer.Exit(FAILED) from left
    if as_json:
        print(json_text(session.state.model_dump(mode="json")), end="")
    else:
        say(f"{ended.words}: look at {session.folder / PAGE}")
    raise typer.Exit(COMPLETED if ended.passed else FAILED)
