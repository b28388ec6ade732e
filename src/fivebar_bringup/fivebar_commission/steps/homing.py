# SPDX-License-Identifier: Apache-2.0
"""Zeros of the encoders: the platform is put on its mark."""

from __future__ import annotations

import math

from fivebar_commission.person import PutAt
from fivebar_commission.session import Session
from fivebar_commission.step import Findings, GateClosed, GatedStep
from fivebar_control.model.geometry import wrap
from fivebar_description.interface import ACTIVE_JOINTS

SECOND = (0.2, -0.1)
"""Place of the second mark from the first one, in lengths of the first proximal link."""

LARGEST_MISFIT = math.radians(3.0)
"""Largest error (rad) of a motor's angle at the second mark."""


def run(session: Session) -> Findings:
    """Ask for the platform on a mark and on its home mark, set the zeros there, and check them at the other."""
    home, link = session.robot.home_m, session.robot.lengths_m.l_11
    second = (home[0] + SECOND[0] * link, home[1] + SECOND[1] * link)
    if not all(map(math.isfinite, (*session.angles_at(*home), *session.angles_at(*second)))):
        raise GateClosed("home_out_of_reach", f"home_m ({home[0]:g}, {home[1]:g}) m: expected a place within reach")
    checked = _placed(session, "zero.check", second)
    read = _placed(session, "zero.home", home)
    expected, file = session.angles_at(*home), session.drives
    shifts = expected.q11 - read[0], expected.q21 - read[1]
    for joint, shift in zip(ACTIVE_JOINTS, shifts, strict=True):
        file.change(joint, zero=round(file.facts(joint).zero + shift, 9))
    there = session.angles_at(*second)
    misfit = [
        wrap(found + shift - wanted)
        for found, shift, wanted in zip(checked, shifts, (there.q11, there.q21), strict=True)
    ]
    figures = {
        "zeros, rad": [file.facts(joint).zero for joint in ACTIVE_JOINTS],
        "error at the second mark, degrees": [round(math.degrees(error), 2) for error in misfit],
    }
    if max(map(abs, misfit)) > LARGEST_MISFIT:
        joint = ACTIVE_JOINTS[max(range(2), key=lambda motor: abs(misfit[motor]))]
        raise GateClosed(
            "zero_contradicted",
            f"at the second mark {joint} is {math.degrees(max(map(abs, misfit))):.1f} degrees off: is the gear or a"
            " length wrong, or are the elbows on the other side?",
            figures,
        )
    file.write()
    return Findings("zeros set at the home mark and confirmed at a second one", figures)


def _placed(session: Session, key: str, place: tuple[float, float]) -> tuple[float, float]:
    """Return both readings (rad) with the platform on a mark."""
    session.person.does(
        key,
        f"Put the platform by hand at x = {1e3 * place[0]:.1f} mm, y = {1e3 * place[1]:.1f} mm, elbows outwards (origin"
        " in the middle between the motor axes, x from the left to the right one)",
        PutAt(*place),
    )
    with session.opened() as drives:
        return session.reading(drives)


ZERO = GatedStep(
    name="zero",
    title="Zeros and home",
    does="has the platform put on a mark and then on its home mark, sets the zeros there, checks them at the other",
    cost="three minutes",
    risk="none: the motors have no power",
    gate=f"at the second mark both motors read what they should, to {math.degrees(LARGEST_MISFIT):.0f} degrees",
    run=run,
)
