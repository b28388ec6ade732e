# SPDX-License-Identifier: Apache-2.0
"""The transmission between each motor and its proximal link: in a robot file, and of a simulated robot."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting


class Transmission(NamedTuple):
    """Spring, damper and play between rotor and link; motor encoders and motor friction are on the rotor's side."""

    frequency: Annotated[
        float,
        Setting(
            "Frequency f of a leg's whole grouped inertia on the stiffness k = zz_i1R (2 pi f)^2 of its transmission, 0"
            " for a rigid one; the assembled robot with locked rotors swings at 1.1 to 1.5 times that. Typical: 40 to"
            " 60 for belts and harmonic drives, 250 for a stiff gear.",
            "Hz",
            at_least=0.0,
            at_most=2000.0,
        ),
    ] = 0.0
    damping: Annotated[
        float,
        Setting("Damping ratio of that inertia on that stiffness; typical: 0.02 to 0.1.", at_least=0.0, at_most=2.0),
    ] = 0.04
    rotor_share: Annotated[
        float,
        Setting(
            "Share of a leg's grouped inertia zz_i1R that is the rotor's; typical: 0.5 to 0.85 with a gear.",
            above=0.0,
            below=1.0,
        ),
    ] = 0.7
    backlash: Annotated[
        float,
        Setting(
            "Angle by which the link can move between both flanks at a locked rotor; typical: 1e-4 (0.005 deg) for a"
            " precision gear, 1e-3 for a plain one.",
            "rad",
            at_least=0.0,
            at_most=0.1,
        ),
    ] = 0.0


RIGID = Transmission()
"""A transmission that neither bends nor has play."""
