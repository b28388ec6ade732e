"""What a robot has to bear while it crosses the Type 2 locus: the section `loads` of a robot file and of a scenario."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting


class Loads(NamedTuple):
    """Loads that the robot has to bear at once, in whatever direction is worst; 0 for none.

    No motor acts along t_s on the Type 2 locus, so there only a quick passage keeps them from moving the platform. The
    screen refuses crossings that are too slow for them (`risk.load_share`), and the planner makes them quicker.
    Typical: 0.035 rad of tilt, 1 N for 50 ms from a cable that drags, 0.003 Nm in each ball bearing. A section that is
    left out, or has the defaults only, is that of the robot's file; one with any other value replaces it as a whole.
    """

    tilt: Annotated[
        float,
        Setting("Tilt of the base, in any direction.", "rad", at_least=0.0, at_most=math.pi / 2.0),
    ] = 0.0
    push: Annotated[
        float,
        Setting(
            "Force on the platform, in any direction, about the moment of a crossing.", "N", at_least=0.0, at_most=1e4
        ),
    ] = 0.0
    push_length: Annotated[float, Setting("How long the force lasts.", "s", at_least=0.0, at_most=10.0)] = 0.05
    passive: Annotated[
        float, Setting("Coulomb friction of each of the three passive joints.", "Nm", at_least=0.0, at_most=10.0)
    ] = 0.0

    @property
    def declared(self) -> bool:
        """Whether there is any load to bear."""
        return self.tilt > 0.0 or self.push > 0.0 or self.passive > 0.0


NO_LOADS = Loads()
"""Nothing to bear."""
