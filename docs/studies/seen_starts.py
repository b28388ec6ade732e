# SPDX-License-Identifier: Apache-2.0
"""Random starts that nobody declares, from rendered pictures.

`python docs/studies/seen_starts.py 200` draws 200.

Of each, place, working mode and assembly mode have to be seen rightly.
"""

from __future__ import annotations

import argparse
import math
from typing import NamedTuple

import numpy as np

from fivebar_bringup.scenario import SEEN, Scenario
from fivebar_bringup.simulation.seen_start import looked
from fivebar_control.estimation.homing import MIN_HOMING_KAPPA, Homing
from fivebar_control.planning.postures import WORKING_MODES, place_at
from fivebar_description.camera import CameraSettings
from fivebar_sim.effects.settings import PlantSettings

RIGHT_WITHIN = 5e-4
"""Distance (m) of the place from where the robot stands: some counts of its encoders."""

REACH_X, REACH_Y = (-0.15, 0.15), (-0.04, 0.18)
"""Where the platform is in the picture (m)."""

TYPE_1_MARGIN = 0.1
"""Least |sin q_i2|: a robot does not rest with a stretched leg."""


class SeenStart(NamedTuple):
    """Where a robot stands, and what was seen of it."""

    actual: Homing
    seen: Homing

    @property
    def right(self) -> bool:
        """Whether both modes are right, and the place."""
        away = math.hypot(self.seen.x - self.actual.x, self.seen.y - self.actual.y)
        return self.seen[2:] == self.actual[2:] and away < RIGHT_WITHIN


def random_starts(number: int, seed: int = 0) -> list[SeenStart]:
    """Return random starts as they were seen, in all four working modes in turn.

    Raises:
        HomingContradicted: one was not seen.
    """
    scenario = Scenario(
        name="seen_starts",
        controller="unified",
        start=SEEN,
        stands=(0.0, 0.15, 1.0, -1.0),
        waypoints=((0.0, 0.02),),
        plant=PlantSettings(encoder_counts=20_000, delay_samples=1, seed=seed),
        estimator="ekf",
        camera=CameraSettings(on=True),
    )
    robot, random = scenario.five_bar(), np.random.default_rng(seed)
    found: list[SeenStart] = []
    while len(found) < number:
        mode = WORKING_MODES[len(found) % len(WORKING_MODES)]
        x, y = float(random.uniform(*REACH_X)), float(random.uniform(*REACH_Y))
        place = place_at(robot, mode, x, y)
        if place.kappa >= MIN_HOMING_KAPPA and place.serial >= TYPE_1_MARGIN:
            there = scenario.model_copy(update={"stands": (x, y, *map(float, mode))})
            found.append(SeenStart(Homing(x, y, mode, place.assembly), looked(there)))
    return found


def main() -> None:
    """Print how many of so many random starts were seen rightly."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("starts", type=int, nargs="?", default=200, help="how many")
    starts = random_starts(parser.parse_args().starts)
    right = sum(start.right for start in starts)
    plus = sum(start.actual.assembly > 0 for start in starts)
    print(f"{right} of {len(starts)} seen rightly; {plus} in assembly mode +, {len(starts) - plus} in -")


if __name__ == "__main__":
    main()
