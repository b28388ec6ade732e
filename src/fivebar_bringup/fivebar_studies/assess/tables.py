# SPDX-License-Identifier: Apache-2.0
"""The tables of an assessment."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from fivebar_bringup.pages.content import Cell, Line, Table, table
from fivebar_control.planning.postures import mode_name
from fivebar_description.robot_file import read_robot
from fivebar_description.rounding import in_millimetres
from fivebar_studies.assess.reach import RobotReach
from fivebar_studies.assess.rows import AS_IN_FILE
from fivebar_studies.assess.statistics import Change, Expected, TypicalResult
from fivebar_studies.assess.typical import typical_motions
from fivebar_studies.rigs.declared import DECLARED, VARIANTS, Assumption


def _percent(value: float) -> Cell:
    return Cell(f"{100.0 * value:.1f} %", value)


def _error(value: float) -> Cell:
    return Cell(in_millimetres(value), value)


def reach_table(reach: RobotReach) -> Table:
    """Return areas and loci by working mode."""
    rows = tuple(
        (
            Cell(mode_name(mode.working_mode), list(mode.working_mode)),
            Cell(f"{mode.area_positive:.0f} cm²", mode.area_positive),
            Cell(f"{mode.area_negative:.0f} cm²", mode.area_negative),
            Cell(f"{locus.length:.1f} cm", locus.length),
            _percent(locus.stretched / locus.length if locus.length else 0.0),
            _percent(locus.room),
        )
        for mode, locus in zip(reach.measures.modes, reach.loci, strict=True)
    )
    return Table(
        "reach",
        "Where it can go",
        "Areas of both assembly modes; the Type 2 locus between them, how much of it is met with stretched distal"
        " links, and along how much of it there is room for a straight segment across, from rest to rest.",
        ("working mode", "det A > 0", "det A < 0", "Type 2 locus", "stretched", "room to cross"),
        rows,
    )


def expected_table(expectations: Sequence[Expected]) -> Table:
    """Return what to expect of each controller."""
    rows: Iterator[Line] = (
        (
            expectation.controller,
            Cell(str(expectation.success), expectation.success.share),
            *map(_error, (expectation.median, expectation.most, expectation.estimate)),
        )
        for expectation in expectations
    )
    return table(
        "expected",
        "What to expect of crossings that the planner accepts",
        "Random crossings as of `fivebar sweep --robot`. Success with its interval for 95 %; median and 95 % of the"
        " largest distance from the reference, and the median error of the estimated platform.",
        ("controller", "success", "error, median", "95 %", "estimate"),
        rows,
    )


def changes_table(name: str, title: str, note: str, changes: Sequence[Change]) -> Table:
    """Return what each change brings, ranked."""
    rows = (
        (
            Cell(change.words, change.variant),
            change.remedy,
            _percent(change.success.share),
            Cell(
                f"{100.0 * change.gain:+.1f} ± {100.0 * change.spread:.1f}", change.gain, True if change.sure else None
            ),
            _error(change.error),
            Cell(f"{change.ratio:.2f}", change.ratio),
        )
        for change in changes
    )
    columns = ("robot", "by", "success", "points", "error, median", "of declared")
    return table(
        name, title, note if changes else f"{note} None makes a difference that is more than chance.", columns, rows
    )


def variant_words(variant: str, declares_errors: bool) -> str:
    """Return a variant of a robot in words; one that declares no errors is also taken exactly as its file says."""
    if variant == AS_IN_FILE:
        return "exactly as in its file"
    if variant == DECLARED and not declares_errors:
        return "assembled from parts, not calibrated"
    return VARIANTS[variant].words


def typical_table(robot: str, by_motion: Mapping[str, Mapping[str, TypicalResult]]) -> Table:
    """Return how likely typical motions of a robot are to succeed, and the commands that make them."""
    declares = read_robot(robot).declares_errors
    commands = {motion.name: motion.command(robot) for motion in typical_motions(robot)}
    rows: list[Line] = []
    for name, results in by_motion.items():
        for variant, (success, duration, reason) in results.items():
            succeeded = Cell("refused", None, False) if success is None else Cell(str(success), success.share, True)
            took = Cell("", None) if duration is None else Cell(f"{duration:.2f} s", duration)
            by_goto = commands[name] if variant == (DECLARED if declares else AS_IN_FILE) else ""
            rows.append((name, variant_words(variant, declares), succeeded, took, by_goto, reason))
    return table(
        "typical",
        "Typical motions from where it rests",
        "Planned as `fivebar goto` does: where the first choice is not likely enough, in the duration, by the time law"
        " and across the locus where the odds are best; refused where these are too low. Of a motion that is refused"
        " the next lines say whether a change of the robot makes it likely enough.",
        ("motion", "robot", "success", "duration", "command", "why not"),
        rows,
    )


def assumptions_table(assumptions: Sequence[Assumption]) -> Table:
    """Return what was assumed."""
    return table(
        "assumed",
        "What was assumed",
        "What the robot's file does not declare. Declare it, and the figures are those of your robot.",
        ("key of the file", "assumed"),
        ((assumption.key, assumption.words) for assumption in assumptions),
    )
