# SPDX-License-Identifier: Apache-2.0
"""The first crossing on a model of the robot as it was found, before the robot makes it."""

from __future__ import annotations

from pathlib import Path

from fivebar_bringup.recorded.outcome import RunOutcome
from fivebar_bringup.report.outcome_words import outcome_details
from fivebar_bringup.runs.offline import run_offline
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.mechanism_code import compiled_motion
from fivebar_commission.crossings import USED, as_found
from fivebar_commission.session import Session
from fivebar_commission.step import Findings, GateClosed, GatedStep, fault_or_outcome
from fivebar_control.scenario.start import initial_joints
from fivebar_sim.plant import Plant
from fivebar_studies.engine.running import Progress

TORQUE_SHARE = 0.9
"""Part of the allowed torque that a rehearsal may take."""


def crossing_files(session: Session) -> list[Path]:
    """Return the files of the crossings that are to be made, from slow to fast."""
    paths = (session.folder / f"crossing_{number}.yaml" for number in range(1, USED + 1))
    return [path for path in paths if path.exists()]


def chosen_crossings(session: Session) -> list[Scenario]:
    """Return the crossings that are to be made, from slow to fast."""
    return [load_scenario(str(path)) for path in crossing_files(session)]


def run(session: Session) -> Findings:
    """Simulate each chosen crossing on the robot as it was found, and drop those that do not succeed."""
    figures: dict[str, object] = {}
    kept, problems = 0, list[GateClosed]()
    paths = crossing_files(session)
    for number, path in enumerate(paths, start=1):
        scenario = load_scenario(str(path))
        name = f"in {sum(scenario.durations()):.2f} s"
        with session.shown(f"  crossing {number} of {len(paths)}") as progress:
            figures[name], problem = _rehearsed(session, scenario, name, progress)
        if problem is None:
            kept += 1
        else:
            problems.append(problem)
            path.unlink()
    if not kept:
        raise GateClosed(problems[0].name, problems[0].words, figures)
    dropped = "".join(f"; dropped: {problem}" for problem in problems)
    return Findings(f"{kept} of the crossings succeed on the model of the robot as it was found{dropped}", figures)


def _rehearsed(session: Session, scenario: Scenario, name: str, progress: Progress) -> tuple[str, GateClosed | None]:
    """Return what became of a crossing on the model, in words, and why it is not to be made, if so."""
    simulated = as_found(session, scenario)
    plant = Plant(simulated.five_bar(), initial_joints(simulated), simulated.rate_hz, simulated.plant, simulated.imu)
    plant.use_machine_code(compiled_motion())
    folder, summary = run_offline(simulated, session.new_folder("rehearsal"), progress, False, plant=plant)
    peak = max((torque or 0.0) for torque in summary.torque_peak_nm)
    became = f"{summary.outcome}{outcome_details(summary)}"
    words = f"{became}, {peak:.3g} Nm"
    if summary.outcome is not RunOutcome.SUCCEEDED:
        return words, GateClosed(fault_or_outcome(summary), f"rehearsed {name}: {became}: look at {folder.path}")
    if peak > TORQUE_SHARE * session.allowed.torque:
        allowed = f"{session.allowed.torque:g} Nm are allowed"
        return words, GateClosed("too_little_torque", f"rehearsed {name} it takes {peak:.3g} Nm, {allowed}")
    return words, None


REHEARSAL = GatedStep(
    name="rehearsal",
    title="Rehearsal",
    does="simulates the chosen crossings on the robot as it was found: masses, friction, lengths, elasticity and play",
    cost="half a minute of computing",
    risk="none: nothing moves",
    gate=f"at least one succeeds, with at most {TORQUE_SHARE:.0%} of the allowed torque; the others are dropped",
    run=run,
)
