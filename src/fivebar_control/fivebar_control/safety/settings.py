# SPDX-License-Identifier: Apache-2.0
"""The limits of the last node before the drives."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_description.forbidden import numbers_problem
from fivebar_description.settings import Setting


class Area(NamedTuple):
    """A rectangle in the plane (m)."""

    x_min: float
    x_max: float
    y_min: float
    y_max: float


EVERYWHERE = Area(-math.inf, math.inf, -math.inf, math.inf)


def _has_an_inside(area: Area) -> str | None:
    return None if area.x_min < area.x_max and area.y_min < area.y_max else "expected x_min < x_max and y_min < y_max"


class SafetySettings(NamedTuple):
    """Limits of the last node before the drives. An infinite limit is no limit."""

    torque_limit: Annotated[
        float,
        Setting(
            "Largest commanded torque of either motor; the drives' limit holds besides.",
            "Nm",
            above=0.0,
            at_most=1e6,
            unlimited=True,
        ),
    ] = math.inf
    torque_rate_limit: Annotated[
        float,
        Setting(
            "Fastest change of either commanded torque; a stop is not slowed down by it.",
            "Nm/s",
            above=0.0,
            at_most=1e9,
            unlimited=True,
        ),
    ] = math.inf
    joint_speed_limit: Annotated[
        float,
        Setting("Speed of a motor joint beyond which the robot is stopped.", "rad/s", at_least=1e-3, at_most=1e4),
    ] = 50.0
    workspace: Annotated[
        Area | None,
        Setting(
            "Where the platform may be: x_min, x_max, y_min, y_max. Without it, wherever both legs reach.",
            "m",
            check=_has_an_inside,
        ),
    ] = None
    forbidden: Annotated[
        tuple[float, ...],
        Setting(
            "Postures that the robot may not enter, eight numbers each: least and largest x and y, q11 and q21. By"
            " default those of the robot's file.",
            "m, rad",
            check=numbers_problem,
        ),
    ] = ()
    type1_margin: Annotated[
        float,
        Setting(
            "Least |sin q_i2| on the side of the working mode; without effect in motions that may meet Type 1.",
            at_least=0.0,
            below=1.0,
        ),
    ] = 0.01
    tracking_error_limit: Annotated[
        float,
        Setting(
            "Distance of the platform from the reference beyond which the robot is stopped.",
            "m",
            at_least=1e-6,
            at_most=10.0,
        ),
    ] = 0.05
    request_ratio: Annotated[
        float,
        Setting(
            "Torque request beyond which the robot is stopped after `request_samples`, as a multiple of the torque"
            " limit: a law that asks for that much has lost control of the robot.",
            at_least=1.0,
            at_most=1e6,
            unlimited=True,
        ),
    ] = 3.0
    request_samples: Annotated[
        int,
        Setting(
            "Samples in a row with a torque request beyond `request_ratio` that stop the robot.",
            "samples",
            at_least=1,
            at_most=10_000,
        ),
    ] = 5
    rest_speed: Annotated[
        float,
        Setting(
            "Speed of the motor joints below which the robot counts as at rest, so that a fault can be reset.",
            "rad/s",
            at_least=1e-6,
            at_most=1e3,
        ),
    ] = 0.1
    brake: Annotated[
        bool,
        Setting(
            "Whether a fault that leaves state and drives sound brakes the robot before torque is zero, instead of"
            " letting it coast."
        ),
    ] = True
    brake_duration: Annotated[
        float,
        Setting("Longest braking, after which torque is zero in any case.", "s", at_least=1e-3, at_most=60.0),
    ] = 1.0
    stop_time_ms: Annotated[
        float | None,
        Setting(
            "In real time: longest time for which the last torque is held when a sample or a command is late or"
            " missing; then the robot is stopped. Without it, as long as that displaces the platform by 2 mm at most at"
            " the worst moment of the motion, 20 ms at most. At least three cycles in either case.",
            "ms",
            above=0.0,
            at_most=10_000.0,
        ),
    ] = None
    stop_cycles: Annotated[
        int | None,
        Setting(
            "The same time in cycles; where it is given, `stop_time_ms` does not count.",
            "cycles",
            at_least=2,
            at_most=10_000,
        ),
    ] = None

    @property
    def area(self) -> Area:
        """Where the platform may be (m)."""
        return EVERYWHERE if self.workspace is None else Area(*map(float, self.workspace))
