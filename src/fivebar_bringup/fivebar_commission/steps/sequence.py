# SPDX-License-Identifier: Apache-2.0
"""The steps in their order, and how a commissioning goes through them."""

from __future__ import annotations

import time
from typing import NamedTuple

from fivebar_commission.page import write_page
from fivebar_commission.record import CLOSED, PASSED, Outcome, StepRecord
from fivebar_commission.session import Session
from fivebar_commission.step import Findings, GateClosed, GatedStep
from fivebar_commission.steps.assessment import ASSESSMENT
from fivebar_commission.steps.breakaway import BREAKAWAY
from fivebar_commission.steps.by_motion import BY_MOTION
from fivebar_commission.steps.calibration import CALIBRATION
from fivebar_commission.steps.crossing import FASTER, FIRST
from fivebar_commission.steps.homing import ZERO
from fivebar_commission.steps.identification import IDENTIFICATION
from fivebar_commission.steps.parts import PARTS
from fivebar_commission.steps.rehearsal import REHEARSAL
from fivebar_commission.steps.sensors import SENSORS
from fivebar_commission.steps.signs import SIGNS
from fivebar_commission.steps.transmissions import TRANSMISSIONS
from fivebar_description.strict_yaml import InputError

STEPS: tuple[GatedStep[Session], ...] = (
    PARTS,
    SIGNS,
    BREAKAWAY,
    ZERO,
    IDENTIFICATION,
    TRANSMISSIONS,
    SENSORS,
    CALIBRATION,
    ASSESSMENT,
    REHEARSAL,
    FIRST,
    BY_MOTION,
    FASTER,
)


ATTEMPTS = 3
"""How often a step is begun that late samples have ended."""

LATE = frozenset(
    {
        "candidate_missing",
        "command_lost",
        "command_stale",
        "estimate_lost",
        "feedback_missing",
        "moteus_watchdog",
        "state_stale",
        "states_stale",
        "WATCHDOG_TIMER_EXPIRED",
    }
)
"""Faults with which a busy computer ends a motion, and an error of a drive's watchdog: nothing is wrong with the robot
where they are gone the next time."""


class Ended(NamedTuple):
    """How a commissioning has ended: whether all gates were passed, and in words."""

    passed: bool
    words: str


def commission(session: Session, last: str | None = None) -> Ended:
    """Go through all steps that have not been passed, to a last one, and stop at the first gate that stays closed.

    State and page are written after every step. What interrupts a step ends it without torque, and leaves no record.
    """
    for number, step in enumerate(STEPS, start=1):
        done = session.state.outcome_of(step.name)
        if done is None or done.outcome != PASSED:
            session.tell("")
            session.tell(f"Step {number} of {len(STEPS)}: {step.title}: {step.does}")
            session.tell(f"  takes {step.cost}; risk: {step.risk}")
            record = _record_of(session, step)
            session.state = session.state.with_step(record)
            session.state.write(session.folder)
            write_page(session.folder, session.state, STEPS)
            session.tell(f"  {record.outcome}: {record.words}")
            if record.outcome == CLOSED:
                return Ended(False, f"{step.title}: {record.words}")
        if step.name == last:
            return Ended(True, f"passed as far as {step.name}")
    return Ended(True, "all steps passed")


def _record_of(session: Session, step: GatedStep[Session]) -> StepRecord:
    began, on_robot, asked = time.monotonic(), session.bench.time, session.person.asked
    outcome: Outcome = PASSED
    try:
        findings = _tried(session, step)
    except GateClosed as closed:
        outcome, findings = CLOSED, Findings(str(closed), closed.figures)
    except InputError as error:
        outcome, findings = CLOSED, Findings(f"refused: {error}")
    return StepRecord(
        step=step.name,
        outcome=outcome,
        words=findings.words,
        figures=dict(findings.figures),
        pages=findings.pages,
        questions=session.person.asked - asked,
        robot_s=round(session.bench.time - on_robot, 3),
        wall_s=round(time.monotonic() - began, 3),
    )


def _tried(session: Session, step: GatedStep[Session]) -> Findings:
    """Return what a step finds, which is begun again where late samples have ended it and the person agrees.

    Raises:
        GateClosed: its gate stays closed.
    """
    ended = list[str]()
    while True:
        try:
            findings = step.run(session)
        except GateClosed as closed:
            if not is_late(closed) or len(ended) == ATTEMPTS - 1:
                raise
            session.tell(f"  {closed}")
            question = f"Samples came too late, and the motors have no power ({closed}). Begin the step again?"
            if not session.person.agrees(f"{step.name}.again", question):
                raise
            ended.append(str(closed))
        else:
            return findings._replace(figures={**findings.figures, "begun again after": ended}) if ended else findings


def is_late(closed: GateClosed) -> bool:
    """Return whether late samples have closed a gate, as on a busy computer."""
    return closed.name in LATE or any(word.strip(",") in LATE for word in closed.words.split())
