# SPDX-License-Identifier: Apache-2.0
"""Settings that several components share, each with one description, unit and range."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from fivebar_description.interface import NANOSECONDS
from fivebar_description.settings import Setting


def whole_period(rate_hz: int) -> str | None:
    """Return what is wrong with a sampling rate (Hz) whose period is not a whole number of nanoseconds."""
    if rate_hz > 0 and NANOSECONDS % rate_hz == 0:
        return None
    return "expected a rate that divides 1e9, so that stamps are whole nanoseconds"


def two_signs(modes: Sequence[int]) -> str | None:
    """Return what is wrong with a working mode that is not a pair of signs."""
    return None if len(modes) == 2 and all(mode in (-1, 1) for mode in modes) else "expected two signs, each +1 or -1"


ROBOT = Setting("The robot's parameters: the name of a shipped file, or the path to a YAML file.")
RATE = Setting("Sampling rate; it must divide 1e9.", "Hz", at_least=1, at_most=10_000, check=whole_period)
WORKING_MODE = Setting(
    "Elbow side of each leg: +1 counter-clockwise of the line from base to platform.", check=two_signs
)

Robot = Annotated[str, ROBOT]
RateHz = Annotated[int, RATE]

LOCKSTEP, REALTIME = "lockstep", "realtime"

RunMode = Annotated[
    str,
    Setting(
        "How time advances: lockstep waits for the torque of each sample; realtime follows the steady clock.",
        choices=(LOCKSTEP, REALTIME),
    ),
]

LastSample = Annotated[
    int, Setting("Last sample of the run, 0 for a run without end.", "samples", at_least=0, at_most=100_000_000)
]
AwaitedNodes = Annotated[tuple[str, ...], Setting("Nodes whose announcement on run/ready this one waits for.")]
BrakeLimit = Annotated[
    float,
    Setting(
        "Longest time for which the blender's torque is followed while it brakes the robot after a fault; 0 stops the"
        " robot at once.",
        "s",
        at_least=0.0,
        at_most=100.0,
    ),
]
ReadyTimeout = Annotated[float, Setting("Longest time until the run has started.", "s", at_least=0.1, at_most=3600.0)]

LARGEST_COUNTS = 1_000_000_000
"""Encoder counts per revolution."""

LONGEST_DELAY = 100
"""Longest delay of the drives, in samples."""

EncoderCounts = Annotated[
    int | None,
    Setting(
        "Encoder counts per revolution of a joint; without them the angle is exact.",
        "counts",
        at_least=1,
        at_most=LARGEST_COUNTS,
    ),
]
DRIVE_TORQUE_LIMIT = 10.0
"""Default torque limit of the drives (Nm)."""

DelaySamples = Annotated[
    int, Setting("Time from a torque command to its effect.", "samples", at_least=0, at_most=LONGEST_DELAY)
]
DriveTorqueLimit = Annotated[
    float | None, Setting("Largest torque of either motor that the drives apply.", "Nm", above=0.0, at_most=1e6)
]
