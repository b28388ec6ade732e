"""What the estimator of a recorded run was given, and what it gave, out of a bag."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fivebar_bringup.report.timing import read_timing
from fivebar_bringup.runs.bag.payloads import recorded_payloads
from fivebar_bringup.runs.bag.reader import read_bag
from fivebar_bringup.runs.bag.recording import BagError, FloatArray, IntArray, Recording
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.studies.identify.reading import Source
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    GROUND_TRUTH,
    IMU_DATA,
    JOINT_STATES,
    JOINTS,
    MOTOR_STATES,
    PASSIVE_STATES,
    TORQUE_COMMAND,
    Topic,
    moment_of_stamp,
)


class EstimatorRecord(NamedTuple):
    """Inputs and outputs of a recorded estimator; the first message of each sample counts, later ones repeat it.

    Attributes:
        samples: int64[n], of the motor readings.
        angles, torques: float64[n, 2], motors (rad) and the torques that acted before (Nm).
        commands: commanded torques (Nm) by sample.
        elbows: in the same way the readings (rad) of the encoder on a passive joint.
        rates: for each reading of the motors, the gyroscope's that came with it: its sample, and the rate (rad/s).
        estimated: recorded joint states by sample: four angles (rad) and four speeds (rad/s).
        truth: the exact ones by sample, where they were recorded.
        payloads: of the platform (kg) by the row of the first readings that are estimated with it.
    """

    samples: IntArray
    angles: FloatArray
    torques: FloatArray
    commands: dict[int, tuple[float, float]]
    rates: list[list[tuple[float, float]]]
    elbows: list[list[tuple[float, float]]]
    estimated: dict[int, tuple[float, ...]]
    truth: dict[int, tuple[float, ...]]
    payloads: dict[int, float]


def read_estimator_record(source: Source, scenario: Scenario) -> EstimatorRecord:
    """Read it from a bag of a run of a scenario.

    Raises:
        BagError: the bag cannot be read, or lacks a topic.
        InputError: the run's timing cannot be read.
    """
    recording = read_bag(source.bag)
    rate_hz = scenario.rate_hz
    samples, rows = _samples(recording, MOTOR_STATES, rate_hz)
    if not samples.size:
        raise BagError(source.bag, f"/{MOTOR_STATES.name}: no samples at {rate_hz} Hz: nothing to estimate from")
    lockstep = source.run is not None and read_timing(source.run.timing).mode == "lockstep"
    return EstimatorRecord(
        samples=samples,
        angles=_field(recording, MOTOR_STATES, "position", len(ACTIVE_JOINTS))[rows],
        torques=_field(recording, MOTOR_STATES, "effort", len(ACTIVE_JOINTS))[rows],
        commands={
            sample: (one, two) for sample, (one, two) in _by_sample(recording, TORQUE_COMMAND, rate_hz, "effort")
        },
        rates=_rates(recording, scenario, samples, lockstep),
        elbows=_elbows(recording, scenario, samples, lockstep),
        estimated=_states(recording, JOINT_STATES, rate_hz),
        truth=_states(recording, GROUND_TRUTH, rate_hz) if recording.count(GROUND_TRUTH) else {},
        payloads=_payloads(recording, rate_hz, samples),
    )


def _samples(recording: Recording, topic: Topic, rate_hz: int) -> tuple[IntArray, IntArray]:
    """Return the samples of a topic in ascending order, each once, and the row of the first message of each."""
    numbers = recording.samples(topic, rate_hz)
    # of an earlier run in the same bag, in contrast to one off the grid
    earlier = recording.stamps(topic) < recording.epoch_ns
    if np.any(numbers[~earlier] < 0):
        raise BagError(recording.path, f"/{topic.name}: a stamp is not on the grid of {rate_hz} Hz")
    samples, rows = np.unique(numbers, return_index=True)
    return samples[samples >= 0], rows[samples >= 0]


def _field(recording: Recording, topic: Topic, name: str, columns: int) -> FloatArray:
    values = recording.field(topic, name)
    if values.shape[1] != columns or not np.all(np.isfinite(values)):
        raise BagError(recording.path, f"/{topic.name}: {name}: expected {columns} finite numbers in every message")
    return values


def _by_sample(recording: Recording, topic: Topic, rate_hz: int, *fields: str) -> list[tuple[int, tuple[float, ...]]]:
    samples, rows = _samples(recording, topic, rate_hz)
    columns = len(JOINTS) if topic.name in (JOINT_STATES.name, GROUND_TRUTH.name) else len(ACTIVE_JOINTS)
    values = np.hstack([_field(recording, topic, field, columns)[rows] for field in fields])
    return [(sample, tuple(row)) for sample, row in zip(samples.tolist(), values.tolist(), strict=True)]


def _states(recording: Recording, topic: Topic, rate_hz: int) -> dict[int, tuple[float, ...]]:
    return dict(_by_sample(recording, topic, rate_hz, "position", "velocity"))


def _rates(
    recording: Recording, scenario: Scenario, samples: IntArray, lockstep: bool
) -> list[list[tuple[float, float]]]:
    if not recording.count(IMU_DATA):
        return [[] for _ in samples]
    vectors = recording.field(IMU_DATA, "angular_velocity").tolist()
    values = [scenario.imu.turn_rate((one[0], one[1], one[2])) for one in vectors]
    late = scenario.imu.schedule(scenario.rate_hz).latency if lockstep else None
    return _came(recording, IMU_DATA, values, scenario, samples, late)


def _elbows(
    recording: Recording, scenario: Scenario, samples: IntArray, lockstep: bool
) -> list[list[tuple[float, float]]]:
    if not recording.count(PASSIVE_STATES):
        return [[] for _ in samples]
    values = recording.field(PASSIVE_STATES, "position")[:, 0].tolist()
    late = scenario.passive.schedule(scenario.rate_hz).latency if lockstep else None
    return _came(recording, PASSIVE_STATES, values, scenario, samples, late)


def _payloads(recording: Recording, rate_hz: int, samples: IntArray) -> dict[int, float]:
    """Return each payload (kg) by the row whose estimate was the first to be logged after its message."""
    answered, rows = _samples(recording, JOINT_STATES, rate_hz)
    logged = np.maximum.accumulate(recording.log_times(JOINT_STATES)[rows])
    payloads = {}
    for log_time, mass in recorded_payloads(recording):
        answer = int(np.searchsorted(logged, log_time))
        if answer < len(answered):
            payloads[int(np.searchsorted(samples, answered[answer]))] = mass
    return payloads


def _came(
    recording: Recording, topic: Topic, values: list[float], scenario: Scenario, samples: IntArray, late: int | None
) -> list[list[tuple[float, float]]]:
    """Return the late readings that came with each sample: those logged by the time of its estimate.

    In lockstep each sample waits for its readings, which are `late` by so many samples, whenever they are logged.
    Each is the moment of its stamp in samples, and its value. A simulated clock may be ahead of the samples. Of a
    reading that was published repeatedly the first message counts.
    """
    came: list[list[tuple[float, float]]] = [[] for _ in samples]
    epoch = recording.epoch_ns
    ahead = scenario.imu.clock_offset if topic == IMU_DATA else 0.0
    answered, rows = _samples(recording, JOINT_STATES, scenario.rate_hz)
    logged = np.maximum.accumulate(recording.log_times(JOINT_STATES)[rows])
    known: set[int] = set()
    for log_time, stamp, value in zip(
        recording.log_times(topic), recording.stamps(topic).tolist(), values, strict=True
    ):
        if stamp in known or not math.isfinite(value):
            continue
        known.add(stamp)
        moment = moment_of_stamp(stamp, scenario.rate_hz, epoch)
        made = moment - ahead * scenario.rate_hz
        if late is not None:
            first = round(made) + late
        else:
            answer = int(np.searchsorted(logged, log_time))
            if answer == len(answered):
                continue
            first = max(math.ceil(made), int(answered[answer]))
        row = int(np.searchsorted(samples, first))
        if row < len(came):
            came[row].append((moment, value))
    return [sorted(readings) for readings in came]
