"""Definition of the study, its page and its summary."""

from __future__ import annotations

from collections.abc import Sequence
from shlex import quote
from typing import Any

from fivebar_bringup.odds.odds import PEAK_LIMIT, success_rule
from fivebar_bringup.pages.content import Picture
from fivebar_bringup.pages.rendering import render
from fivebar_bringup.studies.assess.reach import RobotReach, reach_of
from fivebar_bringup.studies.assess.rows import ACCEPTED, OUT_OF_REACH, RANDOM, REFUSED, ROWS, UNLIKELY, AssessRow
from fivebar_bringup.studies.assess.running import AssessSettings, is_complete, run_numbered
from fivebar_bringup.studies.assess.statistics import (
    Change,
    best_tuning,
    changes,
    expected,
    removed_errors,
    sensor_changes,
    status_counts,
    tuning_changes,
    typical_successes,
)
from fivebar_bringup.studies.assess.tables import (
    assumptions_table,
    changes_table,
    expected_table,
    reach_table,
    typical_table,
)
from fivebar_bringup.studies.assess.typical import typical_motions
from fivebar_bringup.studies.engine.program import program_digest
from fivebar_bringup.studies.engine.study import Study, StudyReport, case_numbers
from fivebar_bringup.studies.rigs.declared import DECLARED, VARIANTS, assumptions, derived_tuning
from fivebar_bringup.studies.rigs.rig import OF_ROBOT
from fivebar_bringup.studies.sweep.drawing import tolerance_of
from fivebar_bringup.studies.sweep.sweep import DECIDING
from fivebar_description.robot_file import RobotFile, read_robot
from fivebar_description.rounding import in_millimetres
from fivebar_description.strict_yaml import yaml_text

QUICK: dict[str, Any] = {"cases": 10, "robots": 6}
"""Settings of the quick assessment."""

MOST_DRAWS = 8
"""Largest ratio of drawn crossings to those that are to be run."""

SHOWN_CHANGES = 3
"""Errors that the summary names."""


def assess_report(settings: AssessSettings, rows: Sequence[AssessRow]) -> StudyReport:
    """Return summary, tables, figures and page."""
    # here, because workers need no matplotlib
    from fivebar_bringup.studies.assess.figures import change_chart, crossing_map

    file, first = read_robot(settings.robot), settings.controllers[0]
    reach, found = reach_of(file), expected(rows, settings.controllers)
    removed, sensors, tunings = (made(rows, first) for made in (removed_errors, sensor_changes, tuning_changes))
    typical, assumed = typical_successes(rows, first), assumptions(file)
    tuning = best_tuning(rows, first)
    section = _tuning_section(file, tuning)
    lines = _summary(settings, rows, file, reach)
    pictures: list[Picture] = [crossing_map(settings.robot, rows, first)]
    base = next(iter(changes(rows, first, (DECLARED,))), None)
    if base is not None:
        pictures += [
            change_chart("errors", "What to calibrate", base, removed, "Each error removed in turn, same robots."),
            change_chart("sensors", "Which sensors to add", base, sensors, "Each set of sensors, same robots."),
        ]
    tables = [
        expected_table(found),
        changes_table(
            "removed",
            "What to calibrate or mend first",
            "Each error removed in turn, on the same robots and motions, also on motions that are refused as too"
            " unlikely. Points: gain of success, with its interval for 95 %. Motions are as planned for the robot as"
            " declared; planning them anew may bring more.",
            removed,
        ),
        changes_table(
            "sensors", "With other sensors", "Beside the motors' encoders; the estimator uses what is there.", sensors
        ),
        typical_table(typical),
        reach_table(reach),
    ]
    command = command_of(settings)
    robot, seed = quote(settings.robot), settings.seed + 1
    check = f"fivebar sweep --robot {robot} --controllers {first} --seed {seed} --cases 200"
    content: dict[str, Any] = {
        "robot": file.name,
        "command": command,
        "summary": lines,
        "assumed": [one._asdict() for one in assumed],
        "reach": reach.as_json(),
        "drawn": dict(status_counts(rows)),
        "expected": [{**one._asdict(), "success": one.success._asdict()} for one in found],
        "removed": [_as_json(one) for one in removed],
        "sensors": [_as_json(one) for one in sensors],
        "bandwidths": [_as_json(one) for one in tunings],
        "typical": {
            name: {"success": None if one is None else one._asdict(), "duration_s": duration, "reason": reason}
            for name, (one, duration, reason) in typical.items()
        },
        "tuning": derived_tuning(VARIANTS[tuning].file(file)),
        "tuning_section": section,
    }
    size = tolerance_of(f"{OF_ROBOT}{settings.robot}") / PEAK_LIMIT
    page = render(
        "assess.html",
        title=f"What {file.name} can do",
        setting=f"simulated by the compiled engine · seed {settings.seed} · success: {success_rule(size)}",
        lines=lines,
        pictures=pictures,
        tables=tables,
        tuning_words=_tuning_words(file, tuning, tunings),
        tuning=section,
        details=[
            assumptions_table(assumed),
            changes_table("bandwidths", "Other bandwidths of the law", "", tunings),
        ],
        command=command,
        check=check,
    )
    return StudyReport(page, content, pictures, lines)


def _as_json(change: Change) -> dict[str, Any]:
    return {**change._asdict(), "success": change.success._asdict(), "words": change.words, "remedy": change.remedy}


def _tuning_section(file: RobotFile, variant: str) -> str:
    """Return the section `tuning` of a robot's file as YAML, to be pasted."""
    tuning = derived_tuning(VARIANTS[variant].file(file))
    return yaml_text({"tuning": {name: float(f"{value:.3g}") for name, value in tuning.items()}})


def _tuning_words(file: RobotFile, variant: str, found: Sequence[Change]) -> str:
    if variant == DECLARED:
        return "Other bandwidths bring no more success; in place of `tuning` in the robot's file:"
    best = next(one for one in found if one.variant == variant)
    return (
        f"With {VARIANTS[variant].words} of the present {derived_tuning(file)['bandwidth']:g} rad/s success rises by"
        f" {100.0 * best.gain:.1f} ± {100.0 * best.spread:.1f} points; in place of `tuning` in the robot's file:"
    )


def _summary(settings: AssessSettings, rows: Sequence[AssessRow], file: RobotFile, reach: RobotReach) -> list[str]:
    """Return about ten lines that say what the robot can do."""
    first, counts = settings.controllers[0], status_counts(rows)
    locus = reach.loci[0]
    drawn, within = sum(counts.values()), counts[ACCEPTED] + counts[UNLIKELY]
    lines = [
        f"assumed, since {file.name} does not declare it: {', '.join(one.key for one in assumptions(file))}",
        f"reaches {reach.measures.workspace_area:.0f} cm²; Type 2 locus with elbows outwards {locus.length:.0f} cm,"
        f" along {locus.room:.0%} of it there is room to cross",
        f"random crossings: {drawn} drawn, {counts[REFUSED]} refused by geometry, {counts[OUT_OF_REACH]} beyond drives"
        f" and limits, {within} within reach; of these {counts[ACCEPTED]} are likely enough to be accepted",
    ]
    for one in expected(rows, settings.controllers):
        lines.append(
            f"{one.controller}, where accepted: {one.success} succeed; largest error {in_millimetres(one.median)}"
            f" median, {in_millimetres(one.most)} in 95 %"
        )
    base = next(iter(changes(rows, first, (DECLARED,))), None)
    if base is not None:
        lines.append(f"of all within reach {base.success} succeed as declared, and if this is mended first:")
        lines += [
            f"  {one.words}: {one.gain:+.1%} ± {one.spread:.1%}{f' ({one.remedy})' if one.remedy else ''}"
            for one in removed_errors(rows, first)[:SHOWN_CHANGES]
        ]
        others = [one for one in sensor_changes(rows, first) if one.variant != DECLARED]
        lines.append("sensors: " + ", ".join(f"{one.words} {one.success.share:.0%}" for one in others))
    made = [
        f"{name} {'refused' if success is None else f'{success.share:.0%}'}"
        for name, (success, _, _) in typical_successes(rows, first).items()
    ]
    lines.append("from home " + ", ".join(made))
    best = best_tuning(rows, first)
    bandwidth = derived_tuning(VARIANTS[best].file(file))["bandwidth"]
    lines.append(f"tuning: bandwidth {bandwidth:.3g} rad/s; the page has the section to paste")
    return lines


def command_of(settings: AssessSettings) -> str:
    """Return the command that repeats the study."""
    usual, words = AssessSettings(), [f"fivebar assess {quote(settings.robot)}"]
    quick = all(getattr(settings, name) == value for name, value in QUICK.items())
    words += ["--quick"] if quick else [f"--cases {settings.cases}"] if settings.cases != usual.cases else []
    words += [f"--seed {settings.seed}"] if settings.seed != usual.seed else []
    return " ".join([*words, *settings.options("controllers")])


def _run(settings: AssessSettings, rows: Sequence[AssessRow]) -> int:
    """Return how many random crossings of these rows were run."""
    return len(case_numbers([row for row in rows if row.motion == RANDOM and row.robot is not None]))


ASSESSMENT = Study(
    name="assess",
    place=f"{__name__}:ASSESSMENT",
    settings=AssessSettings,
    table=ROWS,
    run=run_numbered,
    cases=lambda settings: len(typical_motions(settings.robot)) + MOST_DRAWS * settings.cases,
    chunk=1,
    report=assess_report,
    program=lambda settings: program_digest(
        (*DECIDING, "motions/*.py", "studies/assess/rows.py", "studies/assess/running.py", "studies/assess/typical.py"),
        (settings.robot,),
        (),
        settings.controllers,
    ),
    command=command_of,
    complete=is_complete,
    wanted=lambda settings: settings.cases,
    counts=_run,
)
"""The study of what a robot can do."""
