# SPDX-License-Identifier: Apache-2.0
"""Definition of the study, its page and its summary."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from shlex import quote
from typing import Any

from fivebar_bringup.odds.odds import PEAK_LIMIT, success_rule
from fivebar_bringup.pages.content import Picture
from fivebar_bringup.pages.rendering import render
from fivebar_control.scenario.robot_defaults import derived_tuning
from fivebar_description.robot_file import RobotFile, read_robot
from fivebar_description.rounding import in_millimetres
from fivebar_description.strict_yaml import yaml_text
from fivebar_studies.assess.reach import RobotReach, reach_of
from fivebar_studies.assess.rows import ACCEPTED, OUT_OF_REACH, RANDOM, REFUSED, ROWS, UNLIKELY, AssessRow
from fivebar_studies.assess.running import AssessSettings, run_numbered
from fivebar_studies.assess.statistics import (
    Change,
    TypicalResult,
    best_tuning,
    changes,
    expected,
    removed_errors,
    sensor_changes,
    status_counts,
    tuning_changes,
    typical_results,
    upgrades,
)
from fivebar_studies.assess.tables import (
    assumptions_table,
    changes_table,
    expected_table,
    reach_table,
    typical_table,
    variant_words,
)
from fivebar_studies.assess.typical import typical_motions
from fivebar_studies.engine.program import program_digest
from fivebar_studies.engine.study import Study, StudyReport, case_numbers
from fivebar_studies.rigs.declared import DECLARED, VARIANTS, assumptions, with_assumptions
from fivebar_studies.rigs.rig import OF_ROBOT
from fivebar_studies.sweep.drawing import tolerance_of
from fivebar_studies.sweep.sweep import DECIDING

QUICK: dict[str, Any] = {"cases": 10, "robots": 6}
"""Settings of the quick assessment."""

MOST_DRAWS = 8
"""Largest ratio of drawn crossings to those that are to be run."""

SHOWN_CHANGES = 3
"""Errors that the summary names."""


def assess_report(settings: AssessSettings, rows: Sequence[AssessRow]) -> StudyReport:
    """Return summary, tables, figures and page."""
    # here, because workers need no matplotlib
    from fivebar_studies.assess.figures import change_chart, crossing_map

    file, first = read_robot(settings.robot), settings.controllers[0]
    reach, expectations = reach_of(file), expected(rows, settings.controllers)
    removed, sensors, tunings = (changed(rows, first) for changed in (removed_errors, sensor_changes, tuning_changes))
    typical, assumed = typical_results(rows, first), assumptions(file)
    tuning = best_tuning(rows, first)
    section = _tuning_section(file, tuning)
    lines = _summary(settings, rows, file, reach)
    pictures: list[Picture] = [crossing_map(settings.robot, rows, first)]
    base = next(iter(changes(rows, first, (DECLARED,))), None)
    if base is not None:
        charts = (
            ("errors", "What to calibrate", removed, "Each error removed in turn, same robots."),
            ("sensors", "Which sensors to add", sensors, "Each set of sensors, same robots."),
        )
        pictures += [
            change_chart(name, title, base, shown, words)
            for name, title, shown, words in charts
            if any(change.variant != DECLARED for change in shown)
        ]
    tables = [
        expected_table(expectations),
        changes_table(
            "removed",
            "What to calibrate or mend first",
            "Each error removed in turn, on the same robots and motions, also on motions that are refused as too"
            " unlikely. Points: gain of success, with an interval that holds for all lines at once for 95 %; a line"
            " stands here only where its gain is more than chance. Motions are as planned for the robot as declared;"
            " planning them anew may bring more.",
            removed,
        ),
        changes_table(
            "sensors",
            "With other sensors",
            "Beside the motors' encoders; the estimator uses what is there. Sets of sensors that make a difference.",
            sensors,
        ),
        typical_table(settings.robot, typical),
        reach_table(reach),
    ]
    command = command_of(settings)
    robot, seed = quote(settings.robot), settings.seed + 1
    check = f"fivebar sweep --robot {robot} --controllers {first} --seed {seed} --cases 200"
    content: dict[str, Any] = {
        "robot": file.name,
        "command": command,
        "summary": lines,
        "assumed": [assumption._asdict() for assumption in assumed],
        "reach": reach.as_json(),
        "drawn": dict(status_counts(rows)),
        "expected": [
            {**expectation._asdict(), "success": expectation.success._asdict()} for expectation in expectations
        ],
        "removed": [_as_json(change) for change in removed],
        "sensors": [_as_json(sensor) for sensor in sensors],
        "bandwidths": [_as_json(tuning) for tuning in tunings],
        "typical": {
            name: {
                variant or "declared": {
                    "success": None if success is None else success._asdict(),
                    "duration_s": duration,
                    "reason": reason,
                }
                for variant, (success, duration, reason) in results.items()
            }
            for name, results in typical.items()
        },
        "tuning": derived_tuning(VARIANTS[tuning].file(with_assumptions(file))),
        "tuning_section": section,
    }
    size = tolerance_of(f"{OF_ROBOT}{settings.robot}") / PEAK_LIMIT
    page = render(
        "assess.html",
        package="fivebar_studies",
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
    """Return the section `tuning` to be written into a robot's file as YAML; "" where what follows from it is best."""
    if variant == DECLARED:
        return ""
    bandwidth = derived_tuning(VARIANTS[variant].file(with_assumptions(file)))["bandwidth"]
    return yaml_text({"tuning": {"bandwidth": float(f"{bandwidth:.3g}")}})


def _tuning_words(file: RobotFile, variant: str, changes: Sequence[Change]) -> str:
    present = derived_tuning(with_assumptions(file))["bandwidth"]
    if variant == DECLARED:
        return f"None is needed: no other bandwidth than the present {present:g} rad/s is sure to bring more success."
    best = next(change for change in changes if change.variant == variant)
    return (
        f"With {VARIANTS[variant].words} of the present {present:g} rad/s success rises by"
        f" {100.0 * best.gain:.1f} ± {100.0 * best.spread:.1f} points; in the robot's file:"
    )


def _summary(settings: AssessSettings, rows: Sequence[AssessRow], file: RobotFile, reach: RobotReach) -> list[str]:
    """Return about ten lines that say what the robot can do."""
    first, counts = settings.controllers[0], status_counts(rows)
    locus = reach.loci[0]
    assumed = ", ".join(assumption.key for assumption in assumptions(file))
    drawn, within = sum(counts.values()), counts[ACCEPTED] + counts[UNLIKELY]
    lines = [
        f"assumed, since {file.name} does not declare it: {assumed}",
        f"reaches {reach.measures.workspace_area:.0f} cm²; Type 2 locus with elbows outwards {locus.length:.0f} cm,"
        f" along {locus.room:.0%} of it there is room to cross",
        *_typical_lines(settings.robot, file, typical_results(rows, first)),
        f"random crossings: {drawn} drawn, {counts[REFUSED]} refused by geometry, {counts[OUT_OF_REACH]} beyond drives"
        f" and limits, {within} within reach; of these {counts[ACCEPTED]} are likely enough to be accepted",
    ]
    for expectation in expected(rows, settings.controllers):
        lines.append(
            f"{expectation.controller}, where accepted: {expectation.success} succeed; largest error"
            f" {in_millimetres(expectation.median)} median, {in_millimetres(expectation.most)} in 95 %"
        )
    if within:
        steps = (
            f"{variant_words(upgrade.variant, file.declares_errors)} {upgrade.success.share:.0%}"
            for upgrade in upgrades(rows, first)
        )
        lines.append(f"of all {within} within reach succeed: {'; '.join(steps)}")
        lines += [
            f"  mend first: {error.words}: {error.gain:+.1%} ± {error.spread:.1%}"
            + (f" ({error.remedy})" if error.remedy else "")
            for error in removed_errors(rows, first)[:SHOWN_CHANGES]
        ]
    best = best_tuning(rows, first)
    if best != DECLARED:
        lines.append(_tuning_words(file, best, tuning_changes(rows, first)).replace("; in the robot's file:", ""))
    return lines


def _typical_lines(robot: str, file: RobotFile, by_motion: Mapping[str, Mapping[str, TypicalResult]]) -> Iterator[str]:
    """Yield for each typical motion on which robots how many succeed, and the command that makes it."""
    commands = {motion.name: motion.command(robot) for motion in typical_motions(robot)}
    for name, results in by_motion.items():
        told = (
            f"{variant_words(variant, file.declares_errors)}"
            f" {'refused' if result.success is None else f'{result.success.share:.0%}'}"
            for variant, result in results.items()
        )
        yield f"{name}: {'; '.join(told)} ({commands[name]})"


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
    chunk=lambda settings: 1,
    report=assess_report,
    program=lambda settings: program_digest(
        (
            *DECIDING,
            "fivebar_bringup/motions/*.py",
            "fivebar_studies/assess/rows.py",
            "fivebar_studies/assess/running.py",
            "fivebar_studies/assess/typical.py",
        ),
        (settings.robot,),
        (),
        settings.controllers,
    ),
    command=command_of,
    wanted=lambda settings: settings.cases,
    counts=_run,
)
"""The study of what a robot can do."""
