# SPDX-License-Identifier: Apache-2.0
"""How likely the first crossing is to succeed, on robots drawn within what is known, and what else the robot can do."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fivebar_commission.crossings import USED, TriedCrossing, as_found, likely_crossings
from fivebar_commission.session import Session
from fivebar_commission.step import Findings, GateClosed, GatedStep
from fivebar_description.files import write_file
from fivebar_description.robot_file import RobotFile
from fivebar_description.strict_yaml import InputError, validate

if TYPE_CHECKING:
    from fivebar_studies.engine.study import Study

ROBOTS = 24
"""Drawn robots that make each crossing."""

SHOWN_ERRORS = 3
"""Errors whose removal would bring most that the report names."""


def run(session: Session) -> Findings:
    """Try crossings there and back in several durations, and keep those that are likely enough, from slow to fast."""
    enough, unlikely = likely_crossings(session, ROBOTS)
    figures = {_name(crossing): str(crossing.odds) for crossing in (*enough, *unlikely)}
    if not enough:
        raise GateClosed("unlikely", _advice(unlikely, session), figures)
    # the slowest, the fastest, and the one between them
    chosen = [enough[0], enough[len(enough) // 2], enough[-1]][:USED]
    different = [crossing for number, crossing in enumerate(chosen) if crossing not in chosen[:number]]
    for number, crossing in enumerate(different, start=1):
        write_file(session.folder / f"crossing_{number}.yaml", crossing.scenario.to_yaml())
    for left in range(len(different) + 1, USED + 1):
        (session.folder / f"crossing_{left}.yaml").unlink(missing_ok=True)
    words = ", ".join(
        f"{_name(crossing)}: {crossing.odds.successes} of {crossing.odds.robots}" for crossing in different
    )
    # from here on the file stands for the robot in every command
    session.learn_robot(declared(session))
    able, more, pages = _assessed(session)
    return Findings(f"likely enough, slow to fast: {words} drawn robots succeed; {able}", figures | more, pages)


def declared(session: Session) -> RobotFile:
    """Return the robot's file with its transmissions and its gyroscope as they were found."""
    measured: dict[str, Any] = {}
    if session.state.transmissions:
        measured["transmission"] = session.state.transmissions
    if session.state.imu is not None:
        measured["imu"] = session.state.imu
    known = session.robot.model_dump(mode="json", exclude_none=True)
    return validate(known | measured, RobotFile, str(session.robot_path))


def _assessed(session: Session) -> tuple[str, dict[str, object], tuple[str, ...]]:
    """Assess the robot as `fivebar assess --quick` does; return its ability in words, figures and the page."""
    # here, because the compiled engine takes long to load
    from fivebar_studies.assess.assess import ASSESSMENT as STUDY
    from fivebar_studies.assess.assess import QUICK
    from fivebar_studies.assess.running import AssessSettings
    from fivebar_studies.assess.statistics import changes, removed_errors
    from fivebar_studies.engine.executor import LocalProcesses
    from fivebar_studies.engine.running import run_study
    from fivebar_studies.rigs.declared import DECLARED

    arguments = {"robot": str(session.robot_path), **QUICK}
    try:
        with session.shown("  other crossings") as progress, LocalProcesses(os.cpu_count() or 1) as processes:
            finished = run_study(STUDY, arguments, study_folder(session, STUDY, arguments), processes, progress)
    except InputError as error:
        return f"its other crossings cannot be assessed: {error}", {}, ()
    law = AssessSettings().controllers[0]
    pages = (str(Path(finished.page).relative_to(session.folder)),)
    base = next(iter(changes(finished.rows, law, (DECLARED,))), None)
    if base is None:
        return "no random crossing is within reach", {}, pages
    figures: dict[str, object] = {"random crossings": str(base.success)}
    for change in removed_errors(finished.rows, law)[:SHOWN_ERRORS]:
        figures[f"random crossings, {change.words}"] = str(change.success)
    return f"of random crossings {base.success} succeed", figures, pages


def study_folder(session: Session, study: Study[Any, Any], arguments: Mapping[str, Any]) -> Path:
    """Return the folder of a study that was interrupted, of the robot as it is now, which resumes; else a new one."""
    # here, because what studies stand on takes long to load
    from fivebar_studies.engine.directory import opened

    begun = session.last_folder(study.name)
    if begun is not None:
        with suppress(InputError):
            files, _ = opened(study, begun, arguments)
            if not files.directory.page.exists():
                return begun
    return session.new_folder(study.name)


def _name(crossing: TriedCrossing) -> str:
    return f"there and back in {sum(crossing.scenario.durations()):.2f} s"


def _advice(unlikely: list[TriedCrossing], session: Session) -> str:
    """Return why the gate is closed, and what would raise the odds most."""
    from fivebar_bringup.odds.relief import most_relieved
    from fivebar_bringup.odds.robot_errors import declared_errors
    from fivebar_bringup.odds.trials import SEED

    if not unlikely:
        return "no duration is feasible"
    best = max(unlikely, key=lambda crossing: crossing.odds.successes)
    scenario = as_found(session, best.scenario)
    relief = most_relieved(scenario, declared_errors(scenario), SEED, best.odds)
    needed = f"expected are at least {best.scenario.risk.success:.0%}"
    return f"at best, {_name(best)}, {best.odds}; {needed}{f'; {relief}' if relief else ''}"


ASSESSMENT = GatedStep(
    name="assessment",
    title="Odds of the first crossing",
    does="simulates crossings there and back, in durations from slow to fast, on robots drawn within what is known;"
    " then assesses the robot as `fivebar assess --quick` does",
    cost="three minutes of computing",
    risk="none: nothing moves",
    gate="at least nine of ten drawn robots succeed in one duration",
    run=run,
)
