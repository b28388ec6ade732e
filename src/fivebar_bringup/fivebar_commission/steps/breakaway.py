# SPDX-License-Identifier: Apache-2.0
"""The smallest torque that moves each motor: the first torque that the robot gets."""

from __future__ import annotations

import math
from collections import deque

from fivebar_commission.limits import AllowedDrives
from fivebar_commission.session import Session
from fivebar_commission.step import Findings, GateClosed, GatedStep
from fivebar_control.hardware.drive_interface import ZERO
from fivebar_description.interface import ACTIVE_JOINTS

RISE_TIME = 4.0
"""Time (s) in which the torque rises to the largest one that is tried."""

SHARE = 0.5
"""Part of the allowed torque that is tried."""

MOVED, WITHIN = 0.012, 0.1
"""Angle (rad) by which a motor has moved once it turns that far within this time (s)."""

COUNTS = 4
"""Counts that it takes at least, where these are coarse."""

PAUSE = 0.3
"""Time (s) without torque between two attempts."""

TRUSTED = 0.3
"""Share by which a drive's own torque may differ from the commanded one."""


def run(session: Session) -> Findings:
    """Raise each motor's torque, either way, until it moves."""
    largest = SHARE * session.allowed.torque
    torques: dict[str, list[float]] = {joint: [] for joint in ACTIVE_JOINTS}
    # known before the drives have power: reading files takes longer than their watchdogs wait
    file = session.drives
    rate_hz, counts = file.rate_hz, [file.facts(joint).counts for joint in ACTIVE_JOINTS]
    with session.opened() as drives:
        drives.enable(2.0)
        for motor, joint in enumerate(ACTIVE_JOINTS):
            needed = max(MOVED, COUNTS * math.tau / counts[motor])
            for direction in (1.0, -1.0):
                torques[joint].append(_breakaway(session, drives, motor, direction * largest, needed, rate_hz))
        drives.disable()
        torque, speed = drives.largest_torque, drives.largest_speed
    coulomb = {joint: 0.5 * (up - down) for joint, (up, down) in torques.items()}
    offset = {joint: 0.5 * (up + down) for joint, (up, down) in torques.items()}
    robot = session.robot
    friction = robot.friction.model_copy(
        update={
            "f_s11": round(coulomb["q11"], 6),
            "f_s21": round(coulomb["q21"], 6),
            "f_off11": round(offset["q11"], 6),
            "f_off21": round(offset["q21"], 6),
        }
    )
    session.learn_robot(robot.model_copy(update={"friction": friction}))
    figures: dict[str, object] = {
        f"{joint}: moves at, Nm": [round(value, 4) for value in both] for joint, both in torques.items()
    }
    figures |= {"largest torque, Nm": round(torque, 4), "largest speed, rad/s": round(speed, 3)}
    words = " and ".join(f"{joint} at {coulomb[joint]:.3g} Nm" for joint in ACTIVE_JOINTS)
    return Findings(f"the motors begin to move, {words}, in the direction of the torque", figures)


def _breakaway(
    session: Session, drives: AllowedDrives, motor: int, largest: float, needed: float, rate_hz: int
) -> float:
    """Return the torque (Nm) at which a motor begins to move, raised to `largest`, whose sign is the direction.

    Args:
        session: the session.
        drives: with power, at zero torque.
        motor: its number.
        largest: torque (Nm).
        needed: angle (rad) by which it has moved.
        rate_hz: cycles a second.

    Raises:
        GateClosed: it does not move, moves the other way, or its drive applies another torque.
    """
    joint = ACTIVE_JOINTS[motor]
    window: deque[tuple[float, float]] = deque(maxlen=max(2, round(WITHIN * rate_hz)))
    try:
        for number in range(round(RISE_TIME * rate_hz)):
            torque = largest * number / (RISE_TIME * rate_hz)
            drives.write((torque, 0.0) if motor == 0 else (0.0, torque))
            session.bench.wait()
            reading = drives.exchange().readings[motor]
            if reading is None:
                continue
            window.append((reading.position, torque))
            moved = window[-1][0] - window[0][0]
            if abs(moved) < needed:
                continue
            if moved * largest < 0.0:
                raise GateClosed(
                    "runs_away",
                    f"{joint} turns against its torque: encoder and motor are wired in opposite directions, and a"
                    " controller would run away. Exchange two phases, or set the drive's own direction",
                )
            if abs(reading.torque - torque) > TRUSTED * abs(torque) + 0.02 * session.allowed.torque:
                raise GateClosed(
                    "torque_differs",
                    f"{joint}: {torque:.3g} Nm commanded, {reading.torque:.3g} reported: check torque_constant",
                )
            # before it began to move
            return window[0][1]
        raise GateClosed(
            "does_not_move",
            f"{joint} does not move up to {abs(largest):.3g} Nm, half of what is allowed: brake, power stage, or"
            " friction beyond that",
        )
    finally:
        _rest(session, drives, rate_hz)


def _rest(session: Session, drives: AllowedDrives, rate_hz: int) -> None:
    """Have no torque for a moment."""
    for _ in range(round(PAUSE * rate_hz)):
        drives.write(ZERO)
        session.bench.wait()
        drives.exchange()


BREAKAWAY = GatedStep(
    name="breakaway",
    title="The smallest torque that moves",
    does="raises the torque of one motor at a time, either way, until it moves",
    cost="half a minute",
    risk="the first torque: the links move by a few degrees. Torque ends as soon as a motor moves",
    gate=f"each motor moves in the direction of its torque, below {SHARE:.0%} of the allowed torque",
    run=run,
)
