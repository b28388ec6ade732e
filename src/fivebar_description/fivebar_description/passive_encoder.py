"""An encoder on the passive joint of one leg, between its proximal and its distal link."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_description.interface import JOINTS
from fivebar_description.readings import Latency, LostReadings, ReadingRate, ReadingSchedule, schedule_of
from fivebar_description.settings import Section, Setting
from fivebar_description.shared_settings import EncoderCounts


class PassiveEncoder(NamedTuple):
    """An encoder on a passive joint, q12 or q22. Zero, eccentricity and losses concern the simulation only.

    How exactly its zero is known is `passive_zero` of the tolerances.
    """

    leg: Annotated[int, Setting("Leg whose passive joint has the encoder, 0 for none.", at_least=0, at_most=2)] = 0
    counts: EncoderCounts = 4096
    zero: Annotated[
        float,
        Setting(
            "Reading where the angle is 0; typical: 2e-3 by a jig, 1e-2 by eye.",
            "rad",
            at_least=-math.pi,
            at_most=math.pi,
        ),
    ] = 0.0
    eccentricity: Annotated[
        float,
        Setting(
            "Amplitude of the error once a turn: eccentricity over the disc's radius; typical: 1e-3.",
            "rad",
            at_least=0.0,
            at_most=0.1,
        ),
    ] = 0.0
    rate_hz: ReadingRate = 0
    latency: Latency = 0.0
    lost: LostReadings = 0.0

    @property
    def joint(self) -> str:
        """Name of the joint that has it."""
        return JOINTS[self.place]

    @property
    def place(self) -> int:
        """Place of that joint among all joints."""
        return 2 * self.leg - 1

    def schedule(self, rate_hz: int) -> ReadingSchedule:
        """Return when readings are made and arrive, at a sampling rate (Hz)."""
        return schedule_of(self.rate_hz, self.latency, rate_hz)


NO_ENCODER = PassiveEncoder()


class Sensors(NamedTuple):
    """Section `sensors` of a scenario: what the estimator has besides the motors' encoders and the IMU."""

    passive_encoder: Section[PassiveEncoder] = NO_ENCODER
