# SPDX-License-Identifier: Apache-2.0
"""How exactly a robot is known: the section `tolerances` of a robot file, in a scenario and of the estimator."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting

UNIFORM = math.sqrt(3.0)
"""A tolerance over the standard deviation of errors that are uniform within it."""


class Tolerances(NamedTuple):
    """Largest differences that are expected between the robot and its file, each taken as uniform within its bounds.

    The estimator counts on them: it trusts its encoders only as far as the geometry is known. Typical: 0.02 mm and
    0.2 mrad for a calibrated robot, 0.3 mm and 5 mrad for one assembled from parts; 0 stands for exact. A section that
    is left out, or has the defaults only, is that of the robot's file; one with any other value replaces it as a whole.
    """

    length: Annotated[
        float, Setting("Tolerance of each link's length, plus or minus.", "m", at_least=0.0, at_most=0.1)
    ] = 0.0
    base: Annotated[
        float, Setting("Tolerance of each base joint's position, plus or minus.", "m", at_least=0.0, at_most=0.1)
    ] = 0.0
    zero: Annotated[
        float, Setting("Tolerance of each motor encoder's zero, plus or minus.", "rad", at_least=0.0, at_most=0.1)
    ] = 0.0
    gyro_scale: Annotated[
        float,
        Setting("Relative tolerance of the gyroscope's sensitivity, plus or minus.", at_least=0.0, at_most=1.0),
    ] = 0.01
    passive_zero: Annotated[
        float,
        Setting(
            "Tolerance of the zero of a passive joint's encoder, plus or minus; it is estimated.",
            "rad",
            at_least=0.0,
            at_most=1.0,
        ),
    ] = 0.005

    @property
    def declared(self) -> bool:
        """Whether lengths, bases or zeros may differ from the file at all."""
        return max(self.length, self.base, self.zero) > 0.0


EXACT = Tolerances()
"""A robot that equals its file."""
