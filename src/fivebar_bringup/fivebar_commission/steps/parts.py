# SPDX-License-Identifier: Apache-2.0
"""The first step: the drives answer, and what they are set up for."""

from __future__ import annotations

from fivebar_commission.record import imu_keys
from fivebar_commission.session import Session
from fivebar_commission.step import Findings, GateClosed, GatedStep
from fivebar_description.interface import ACTIVE_JOINTS

LEAST_COUNTS = 1000
"""Counts of a joint's turn below which angles are too coarse for the steps that follow."""


def run(session: Session) -> Findings:
    """Ask for the emergency stop, open the drives, and read them."""
    if not session.person.agrees(
        "parts.emergency_stop",
        "Does the emergency stop take the motors' power without the computer, is it within reach, and is nobody within"
        " the robot's reach?",
    ):
        raise GateClosed("no_emergency_stop", "wire the drives' STO to an emergency stop and try it first")
    file = session.drives
    facts = [file.facts(joint) for joint in ACTIVE_JOINTS]
    coarse = [joint for joint, fact in zip(ACTIVE_JOINTS, facts, strict=True) if fact.counts < LEAST_COUNTS]
    if coarse:
        raise GateClosed(
            "coarse_encoder", f"{coarse[0]}: expected at least {LEAST_COUNTS} counts in a turn of the joint"
        )
    with session.opened() as drives:
        first, second = session.reading(drives)
        notes = drives.notes
    imu = session.bench.imu
    if imu is not None:
        session.learn(imu=imu_keys(imu))
    figures = {
        "rate, Hz": file.rate_hz,
        "ids": file.ids(),
        "counts in a turn of each joint": [fact.counts for fact in facts],
        "torque limit of each joint, Nm": [fact.torque_limit for fact in facts],
        "readings, rad": [round(first, 4), round(second, 4)],
        "gyroscope": "none" if imu is None else f"{imu.rate_hz} readings a second",
        "notes of the drives": notes,
    }
    return Findings(f"both drives answer at {file.rate_hz} Hz, without power so far", figures)


PARTS = GatedStep(
    name="parts",
    title="Parts",
    does="opens both drives without power and reads them: ids, firmware as their interface demands it, counts, limits",
    cost="a minute",
    risk="none: the motors have no power",
    gate="an emergency stop; both drives answer and are set up as their file says, with limits within the allowed ones",
    run=run,
)
