# SPDX-License-Identifier: Apache-2.0
"""A finished offline run as a recording in memory, with the contents of its bag but without a file."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from fivebar_bringup.bag.recording import FloatArray, IntArray, Recording
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.offline import OfflineRun, Sample
from fivebar_description.interface import (
    FAULTS,
    PASSIVE_STATES,
    VISION_NAMES,
    VISION_PLATFORM,
    Topic,
    sample_stamp_ns,
)
from fivebar_description.run_quantities import ACCELERATION, PASSIVE_ANGLE, TURN_RATE, Quantity, quantities


class RunInMemory(Recording):
    """Recording of a run for the topics that a report is made from."""

    def __init__(self, run: OfflineRun, scenario: Scenario) -> None:
        """Hold a run of a scenario."""
        super().__init__(Path(scenario.name), {}, {"dropped": "0"})
        self._run = run
        samples = run.samples
        stamps = [sample_stamp_ns(sample.number, scenario.rate_hz) for sample in samples]
        self._stamps = np.array(stamps, dtype=np.int64)
        seen = [position for sample in samples for position in sample.vision]
        self._exposures = np.array([position.stamp for position in seen], dtype=np.int64)
        self._names: dict[str, tuple[str, ...]] = {VISION_PLATFORM.name: VISION_NAMES}
        self._fields = {(late.topic.name, late.field): values for late, values in _readings(samples).items()}
        rows = [sample.values() for sample in samples]
        for quantity in quantities(scenario.scheme().nominal.topic):
            name, topic = quantity.name, quantity.topic.name
            if any(name in row for row in rows):
                nothing = (math.nan,) * len(quantity.names)
                self._names[topic] = quantity.names
                self._fields[topic, quantity.field] = np.array([row.get(name, nothing) for row in rows])
        self._names[PASSIVE_STATES.name] = (scenario.passive.joint,)
        if seen:
            self._fields[VISION_PLATFORM.name, "position"] = np.array([position.reading for position in seen])

    def count(self, topic: Topic) -> int:
        """Return the number of messages of a topic."""
        if topic == FAULTS:
            return len(self._run.faults)
        if topic == VISION_PLATFORM:
            return len(self._exposures)
        return len(self._run.samples) if any(name == topic.name for name, _ in self._fields) else 0

    def log_times(self, topic: Topic) -> IntArray:
        """Return the stamps: in an offline run no time passes."""
        return self._stamps

    def stamps(self, topic: Topic) -> IntArray:
        """Return the stamps, int64[n] in nanoseconds."""
        return self._exposures if topic == VISION_PLATFORM else self._stamps

    def joint_names(self, topic: Topic) -> tuple[str, ...]:
        """Return the names in a topic of JointState."""
        return self._names[topic.name]

    def field(self, topic: Topic, name: str) -> FloatArray:
        """Return one field of all messages as float64."""
        return self._fields[topic.name, name]

    def texts(self, topic: Topic) -> list[str]:
        """Return the faults."""
        return list(self._run.faults)


def _readings(samples: list[Sample]) -> dict[Quantity, FloatArray]:
    """Return the readings of the late sensors, [n, values], in the rows of the samples at which they were made."""
    readings: dict[Quantity, dict[float, tuple[float, ...]]] = {TURN_RATE: {}, ACCELERATION: {}, PASSIVE_ANGLE: {}}
    for sample in samples:
        for reading in sample.imu:
            readings[TURN_RATE].setdefault(reading.made, reading.reading.angular_velocity)
            readings[ACCELERATION].setdefault(reading.made, reading.reading.acceleration)
        passive = (scalar for scalar in sample.scalars if scalar.topic == PASSIVE_STATES)
        readings[PASSIVE_ANGLE] |= {angle.made: (angle.value,) for angle in passive}
    return {
        quantity: np.array([values.get(sample.number, (math.nan,) * len(quantity.columns)) for sample in samples])
        for quantity, values in readings.items()
        if values
    }
