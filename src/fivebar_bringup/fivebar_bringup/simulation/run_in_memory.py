"""A finished offline run as a recording in memory, with the contents of its bag but without a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fivebar_bringup.runs.bag.recording import FloatArray, IntArray, Recording
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.offline import OfflineRun, Sample
from fivebar_control.laws.torque import UNDEFINED
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    FAULTS,
    GROUND_TRUTH,
    IMU_DATA,
    JOINT_STATES,
    JOINTS,
    REFERENCE,
    REFERENCE_NAMES,
    SUPERVISOR_NAMES,
    SUPERVISOR_STATE,
    TORQUE_REQUESTED,
    VHC_TORQUE,
    VISION_NAMES,
    VISION_PLATFORM,
    Topic,
    sample_stamp_ns,
)
from fivebar_sim.plant import Measurement

NAMES = {
    JOINT_STATES.name: JOINTS,
    GROUND_TRUTH.name: JOINTS,
    REFERENCE.name: REFERENCE_NAMES,
    SUPERVISOR_STATE.name: SUPERVISOR_NAMES,
    TORQUE_REQUESTED.name: ACTIVE_JOINTS,
    VISION_PLATFORM.name: VISION_NAMES,
}


class RunInMemory(Recording):
    """Recording of a run for the topics that a report is made from."""

    def __init__(self, run: OfflineRun, scenario: Scenario) -> None:
        """Hold a run of a scenario."""
        super().__init__(Path(scenario.name), {}, {"dropped": "0"})
        self._run = run
        samples = run.samples
        stamps = [sample_stamp_ns(sample.number, scenario.rate_hz) for sample in samples]
        self._stamps = np.array(stamps, dtype=np.int64)
        references = np.array([sample.reference for sample in samples])
        seen = [one for sample in samples for one in sample.vision]
        self._exposures = np.array([one.stamp for one in seen], dtype=np.int64)
        self._fields = {
            (JOINT_STATES.name, "position"): np.array([sample.measured.position for sample in samples]),
            (JOINT_STATES.name, "velocity"): np.array([sample.measured.velocity for sample in samples]),
            (JOINT_STATES.name, "effort"): np.array([sample.measured.effort for sample in samples]),
            (IMU_DATA.name, "linear_acceleration"): _accelerations(samples),
            (REFERENCE.name, "position"): references[:, :4],
            (REFERENCE.name, "velocity"): references[:, 2:],
            (SUPERVISOR_STATE.name, "position"): np.array([sample.supervisor for sample in samples]),
            (scenario.scheme().nominal.topic.name, "effort"): np.array([sample.nominal for sample in samples]),
            (TORQUE_REQUESTED.name, "effort"): np.array([sample.requested or UNDEFINED for sample in samples]),
        }
        constraint = [sample.constraint for sample in samples if sample.constraint is not None]
        if constraint:
            self._fields[VHC_TORQUE.name, "effort"] = np.array(constraint)
        if seen:
            self._fields[VISION_PLATFORM.name, "position"] = np.array([one.reading for one in seen])
        exact = [sample.truth for sample in samples if sample.truth is not None]
        if exact:
            for field in Measurement._fields:
                self._fields[GROUND_TRUTH.name, field] = np.array([getattr(truth, field) for truth in exact])

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
        return NAMES.get(topic.name, ACTIVE_JOINTS)

    def field(self, topic: Topic, name: str) -> FloatArray:
        """Return one field of all messages as float64."""
        return self._fields[topic.name, name]

    def texts(self, topic: Topic) -> list[str]:
        """Return the faults."""
        return list(self._run.faults)


def _accelerations(samples: list[Sample]) -> FloatArray:
    """Return [n, 3], the IMU's readings (m/s^2) in the rows of the samples at which they were made, NaN for none."""
    accelerations = np.full((len(samples), 3), np.nan)
    for sample in samples:
        for one in sample.imu:
            if one.made.is_integer() and 0 <= one.made < len(samples):
                accelerations[int(one.made)] = one.reading.acceleration
    return accelerations
