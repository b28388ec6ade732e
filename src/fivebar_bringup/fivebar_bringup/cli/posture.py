# SPDX-License-Identifier: Apache-2.0
"""Subcommand about a robot at rest: posture."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fivebar_bringup.cli.app import COMPLETED, Group, JsonOption, command, input_errors
from fivebar_description.errors import InputError
from fivebar_description.other_units import in_other_unit

if TYPE_CHECKING:
    from fivebar_control.planning.release import ReleasePlan
    from fivebar_control.planning.standstill import Standstill
    from fivebar_control.safety.settings import SafetySettings


LARGEST = {"Q11": 4.0 * math.pi, "Q21": 4.0 * math.pi, "--rate": 100.0}
"""Largest magnitude of each option: rad, of a counter that began a turn or two away, and rad/s."""


# a negative angle must not be taken for an option
@command(Group.ROBOT, context_settings={"ignore_unknown_options": True})
def posture(
    q11: Annotated[float | None, typer.Argument(help="Angle of motor 1, rad.")] = None,
    q21: Annotated[float | None, typer.Argument(help="Angle of motor 2, rad.")] = None,
    after: Annotated[
        Path | None, typer.Option("--after", help="Run directory: the motors as they stood at its end.")
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(help="A shipped robot, or a robot file [default: dextar, or that of --after]"),
    ] = None,
    rate: Annotated[
        float | None, typer.Option(help="Reading of the gyroscope on the distal link of leg 2, rad/s, as it falls.")
    ] = None,
    release: Annotated[
        bool,
        typer.Option("--release", help="Plan how its motors get it off the locus, or refuse where that is not known."),
    ] = False,
    platform: Annotated[
        tuple[float, float] | None,
        typer.Option(metavar="X Y", help="With --release: where the platform is, m, within 10 mm."),
    ] = None,
    without_gyroscope: Annotated[
        bool,
        typer.Option("--without-gyroscope", help="With --release: the robot has none [default: as in the run]."),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Tell where a robot at rest stands, from its motor angles.

    The same motor angles are possible in two assembly modes, which meet on the Type 2 locus: the command shows both,
    and the way off the locus where the robot may be on it. The tolerances of the robot's file, or those of the run,
    determine how near to the locus it may be.

    With --release it shows what the service `blender/release` of a running graph does, which moves the robot: with
    which torque, to which assembly modes it may fall, and at which limits it stops. Nothing moves here.

    Example: `fivebar posture 1.2 1.9 --robot my_robot.yaml`

    Example: `fivebar posture --after runs/stopped --release`
    """
    from fivebar_bringup.motions.start import standing_after
    from fivebar_control.estimation.settings import EkfSettings
    from fivebar_control.planning.release import ReleaseTask, finished, plan_in_slices
    from fivebar_control.planning.standstill import DEVIATIONS, mode_by_turn, standstill_at, way_out
    from fivebar_control.safety.stages import guard_limits_of
    from fivebar_control.scenario.guard_settings import guard_settings
    from fivebar_control.scenario.scenario import ControlScenario
    from fivebar_description.robot_file import load_robot, read_robot
    from fivebar_description.scenario_file import DEFAULT_ROBOT

    with input_errors():
        for name, value in (("Q11", q11), ("Q21", q21), ("--rate", rate)):
            if value is not None and not math.isfinite(value):
                raise InputError(f"{name}: {value}: expected a finite number")
            if value is not None and abs(value) > LARGEST[name]:
                unit, turns = ("rad/s", "") if name == "--rate" else ("rad", ", two turns")
                hint = in_other_unit(unit, lambda size: True)
                raise InputError(f"{name}: {value:g}: expected at most {LARGEST[name]:.4g} {unit}{turns}{hint}")
        if after is not None and robot is not None:
            raise InputError("--robot: expected without --after: the robot is that of the run")
        if after is not None and q11 is None:
            standing = standing_after(after)
            known, tolerances = standing.scenario.five_bar(), standing.scenario.known_within()
            angles, file, rate_hz = (standing.q11, standing.q21), standing.scenario.robot, standing.scenario.rate_hz
            safety, loads = guard_settings(standing.scenario), standing.scenario.to_bear()
            seen = standing.scenario.gyro or not standing.scenario.estimated
        elif after is None and q11 is not None and q21 is not None:
            file = DEFAULT_ROBOT if robot is None else robot
            rate_hz = ControlScenario.model_fields["rate_hz"].default
            known, tolerances, angles = load_robot(file), read_robot(file).tolerances, (q11, q21)
            safety, loads, seen = _safety_of(file), read_robot(file).loads, True
        else:
            raise InputError("Q11 Q21 and --after: expected one of them")
        stand = standstill_at(known, tolerances, *angles)
        planned = None
        if platform is not None and not (release and all(map(math.isfinite, platform))):
            raise InputError(f"--platform: {platform[0]} {platform[1]}: expected two finite numbers with --release")
        if without_gyroscope and not release:
            raise InputError("--without-gyroscope: expected with --release")
        if release:
            seen = seen and not without_gyroscope
            passes = read_robot(file).elbows_pass
            limits = guard_limits_of(safety, rate_hz)
            task = ReleaseTask(known, tolerances, limits, passes, rate_hz, loads)
            planned = finished(plan_in_slices(task, *angles, platform, seen))
            stand = planned.stand
        if stand is None:
            raise InputError(f"Q11 Q21: at {angles[0]:g}, {angles[1]:g} rad both elbows are in one place")
    fallen = None if rate is None else mode_by_turn(stand, rate, DEVIATIONS * EkfSettings().gyro_noise)
    if as_json:
        sentences = way_out(stand) if stand.near else []
        content = stand._asdict() | {"near": stand.near, "way_out": sentences, "falls_to": fallen}
        content |= {} if planned is None else {"release": _values(planned)}
        print(json.dumps(content, indent=2).replace("NaN", "null"))
    else:
        print("\n".join(_lines(stand, fallen) + (_ordinary(stand) if planned is None else _of_release(planned))))
    raise typer.Exit(COMPLETED)


def _safety_of(file: str) -> SafetySettings:
    """Return the limits that a robot's file has."""
    from fivebar_control.safety.settings import SafetySettings
    from fivebar_description.forbidden import numbers_of
    from fivebar_description.robot_file import read_robot

    read = read_robot(file)
    limit = math.inf if read.drives.torque_limit is None else read.drives.torque_limit
    return SafetySettings(torque_limit=limit, forbidden=numbers_of(read.forbidden))


def _values(planned: ReleasePlan) -> dict[str, object]:
    """Return a planned release for machines."""
    release = planned.release
    return {
        "torque_at_most_nm": [release.cap1, release.cap2],
        "turn_rad": [release.per_way1 * release.way, release.per_way2 * release.way],
        "elbows_m": release.way,
        "seconds": release.way / release.pace,
        "falls_to": list(planned.modes),
        "ends_m": [list(end) for end in planned.ends],
        "odds": None if math.isnan(planned.odds) else planned.odds,
        "drive_m": release.drive.length,
        "drive_seconds": release.drive.duration if release.drive.side else 0.0,
        "motor_speed_rad_s": release.motor_speed,
        "link_rate_rad_s": release.link_rate,
        "travel_rad": release.travel,
    }


def _of_release(planned: ReleasePlan) -> list[str]:
    """Return a planned release for a person, line by line."""
    from fivebar_control.planning.release_step import STALL_TIME
    from fivebar_control.trajectory.refusal import place

    release, way = planned.release, planned.release.way
    falls = " or ".join(
        f"assembly mode {'+' if mode > 0 else '-'}, platform at {place(x, y)}"
        for mode, (x, y) in zip(planned.modes, planned.ends, strict=True)
    )
    return [
        f"release: the motors turn by {release.per_way1 * way:+.4f} and {release.per_way2 * way:+.4f} rad, which moves"
        f" the elbows by {1e3 * way:.2f} mm, with {release.cap1:.3f} and {release.cap2:.3f} Nm at most",
        *_of_drive(planned),
        f"  it ends in {falls}" + ("" if planned.pivot else _which(planned)),
        f"  it stops with zero torque at {release.motor_speed:g} rad/s of a motor, {release.link_rate:g} rad/s of a"
        f" distal link, {release.travel:.3f} rad of travel, and after {STALL_TIME:g} s at the largest torque",
        "  in a running graph: ros2 service call /blender/release std_srvs/srv/Trigger",
    ]


def _of_drive(planned: ReleasePlan) -> list[str]:
    """Return what goes before the press where there is no gyroscope."""
    drive = planned.release.drive
    if drive.side == 0:
        return []
    return [
        f"  before that they drive the platform by {1e3 * drive.length:.0f} mm in {drive.duration:.2f} s along"
        f" ({drive.d_x:+.2f}, {drive.d_y:+.2f}), from which the locus goes away"
    ]


def _which(planned: ReleasePlan) -> str:
    if math.isnan(planned.odds):
        return "; which of them the gyroscope tells"
    return f"; the first with a probability of {planned.odds:.4f}"


def _lines(stand: Standstill, fallen: int | None) -> list[str]:
    from fivebar_control.planning.standstill import DEVIATIONS, way_out
    from fivebar_control.trajectory.refusal import place

    shape = "stretched" if stand.stretched else "folded"
    short = f"{1e3 * stand.gap:+.3f} mm (±{1e3 * DEVIATIONS * stand.gap_deviation:.3f} mm)"
    lines = [f"elbows {short} from where the distal links lie on one line, {shape}: the Type 2 locus"]
    if stand.gap >= 0.0:
        lines += [
            f"assembly mode {sign}: platform at {place(x, y)}, {1e3 * stand.side:.1f} mm beside the elbows' line"
            for sign, (x, y) in (("+", stand.plus), ("-", stand.minus))
        ]
    if fallen is not None:
        towards = {1: "to assembly mode +", -1: "to assembly mode -", 0: "not at all, within its noise"}[fallen]
        lines.append(f"by the gyroscope it falls {towards}")
    if stand.near:
        lines.append("the encoders do not tell the assembly mode; the way out:")
        lines += [f"  {sentence}" for sentence in way_out(stand)]
    return lines


def _ordinary(stand: Standstill) -> list[str]:
    """Return the advice for a robot that rests away from the locus."""
    ordinary = "away from the locus: declare the assembly mode in which it stands, or see which"
    return [] if stand.near else [ordinary]
