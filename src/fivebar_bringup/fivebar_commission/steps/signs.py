# SPDX-License-Identifier: Apache-2.0
"""Signs, gear and counts: each proximal link is turned by hand, and what the drives read is compared."""

from __future__ import annotations

import math

from fivebar_commission.drives_file import COUNTS
from fivebar_commission.person import Turn
from fivebar_commission.session import Session
from fivebar_commission.step import Findings, GateClosed, GatedStep
from fivebar_description.interface import ACTIVE_JOINTS

SIDES = ("left", "right")
"""Where each motor is."""

ANGLE = math.radians(20.0)
"""Angle by which a link is turned."""

LEAST_SEEN = 0.01
"""Part of that angle below which nothing is read at all."""

BY_HAND = 0.25
"""How wrong the angle may be by which a link is turned by hand, as a share of it."""

FACTORS = (2, 3, 4, 5, 6, 8, 10, 16, 20, 25, 32, 40, 50, 64, 100, 128, 256)
"""Factors by which counts or gears are mistaken."""


def run(session: Session) -> Findings:
    """Ask for a turn of each link, and correct the drives' file."""
    turned = [_turned(session, motor) for motor in range(2)]
    if all(abs(turned[motor][1 - motor]) > 2.0 * abs(turned[motor][motor]) for motor in range(2)):
        if not session.person.agrees(
            "signs.exchange", "The motors are exchanged. Exchange q11 and q21 in the drives' file?"
        ):
            raise GateClosed("motors_exchanged", "the drive of q11 is on the right: exchange cables or ids")
        file = session.drives
        file.exchange_motors()
        file.write()
        turned = [(pair[1], pair[0]) for pair in turned]
    corrected = [_corrected(session, motor, turned[motor][motor]) for motor in range(2)]
    figures: dict[str, object] = {
        f"{joint}: read for {math.degrees(ANGLE):.0f} degrees by hand": round(math.degrees(turned[motor][motor]), 1)
        for motor, joint in enumerate(ACTIVE_JOINTS)
    }
    figures |= {f"{joint}: corrected": words for joint, words in zip(ACTIVE_JOINTS, corrected, strict=True) if words}
    changes = [f"{joint}: {words}" for joint, words in zip(ACTIVE_JOINTS, corrected, strict=True) if words]
    return Findings("; ".join(changes) or "both motors count as their file says", figures)


def _turned(session: Session, motor: int) -> tuple[float, float]:
    """Return by how much both motors' readings (rad) change while a link is turned by hand."""
    joint, side = ACTIVE_JOINTS[motor], SIDES[motor]
    with session.opened() as drives:
        before = session.reading(drives)
    session.person.does(
        f"signs.{joint}",
        f"Turn the {side} proximal link ({joint}) by hand, by {math.degrees(ANGLE):.0f} degrees counter-clockwise as"
        " seen from above, and leave it there",
        Turn(motor, ANGLE),
    )
    with session.opened() as drives:
        after = session.reading(drives)
    return after[0] - before[0], after[1] - before[1]


def _corrected(session: Session, motor: int, change: float) -> str:
    """Correct sign and counts of a motor; return what was changed, "" for nothing.

    Raises:
        GateClosed: nothing is read, or what is read fits no gear.
    """
    joint, file = ACTIVE_JOINTS[motor], session.drives
    if abs(change) < LEAST_SEEN * ANGLE:
        raise GateClosed(
            "encoder_silent", f"{joint} reads no change: was the {SIDES[motor]} link turned? Is the encoder connected?"
        )
    words = []
    if change < 0.0:
        file.change(joint, sign=-file.facts(joint).sign)
        words.append("sign reversed")
    ratio = abs(change) / ANGLE
    if abs(ratio - 1.0) > BY_HAND:
        factor = _factor_of(ratio)
        if factor is None:
            raise GateClosed(
                "wrong_scale",
                f"{joint} reads {math.degrees(abs(change)):.1f} degrees where the link was turned by"
                f" {math.degrees(ANGLE):.0f}: check counts_per_revolution and gear_ratio",
            )
        key = file.scale_key
        scale = file.motor(joint)[key] * factor
        scale = round(scale) if key == COUNTS else round(scale, 6)
        if not session.person.agrees(
            f"signs.{joint}.counts",
            f"{joint} reads {ratio:.3g} times the angle. Set {key} to {scale:g}?",
        ):
            raise GateClosed("wrong_scale", f"{joint}: correct {COUNTS} or gear_ratio in {file.path}")
        file.change(joint, **{key: scale})
        words.append(f"{key} {scale:g}")
    if words:
        file.write()
    return ", ".join(words)


def _factor_of(ratio: float) -> float | None:
    """Return the usual factor, or one over it, that a ratio stands for; None where it stands for none."""
    factors = [*(float(factor) for factor in FACTORS), *(1.0 / factor for factor in FACTORS)]
    best = min(factors, key=lambda factor: abs(math.log(ratio / factor)))
    return best if abs(math.log(ratio / best)) < 0.5 * BY_HAND else None


SIGNS = GatedStep(
    name="signs",
    title="Signs, gear and counts",
    does="has each proximal link turned by hand and compares what the drives read; corrects their file",
    cost="two minutes",
    risk="none: the motors have no power",
    gate=f"each motor reads the angle it was turned by, to {BY_HAND:.0%}, counter-clockwise positive",
    run=run,
)
