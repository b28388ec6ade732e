# SPDX-License-Identifier: Apache-2.0
"""The inputs and outputs of the estimator of a recorded run, out of a bag."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from operator import itemgetter
from typing import NamedTuple, TypeVar

import numpy as np

from fivebar_bringup.bag.payloads import recorded_payloads
from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.recording import FloatArray, IntArray, Recording
from fivebar_bringup.errors import BagError
from fivebar_bringup.identify.reading import Source
from fivebar_bringup.recorded.timing import read_timing
from fivebar_bringup.scenario import Scenario, scalar_topics
from fivebar_control.estimation.late_reading import CAMERA, EXTRA, PASSIVE, LateReading
from fivebar_control.estimation.platform_reading import PlatformReading, used
from fivebar_description.imu import Vector3
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    EXTRA_NAME,
    EXTRA_READINGS,
    GROUND_TRUTH,
    IMU_DATA,
    JOINT_STATES,
    JOINTS,
    MOTOR_STATES,
    PASSIVE_STATES,
    TORQUE_COMMAND,
    VISION_NAMES,
    VISION_PLATFORM,
    Topic,
    moment_of_stamp,
)
from fivebar_description.optional import CAMERA_FRAMES, CAMERA_ON, optional_part
from fivebar_description.sensors import LateSensor
from fivebar_sim.effects.gyroscope import ImuClock

T = TypeVar("T")

Arrival = Callable[[float], int | None]
"""Maps the time at which a reading was made (samples) to the sample with which it came; None where it cannot have
come."""


STAMP_DIGITS = 6
"""Digits by which the moments of two stamps differ (samples)."""


class EstimatorRecord(NamedTuple):
    """Inputs and outputs of a recorded estimator; the first message of each sample counts, later ones repeat it.

    Attributes:
        samples: int64[n], of the motor readings.
        angles, torques: float64[n, 2], motors (rad) and the torques that acted before (Nm).
        commands: commanded torques (Nm) by sample.
        gyroscope: for each reading of the motors, the gyroscope's that came with it: its sample, and the angular
            velocity in the IMU's frame (rad/s).
        late: in the same way the readings of the other late sensors.
        estimated: recorded joint states by sample: four angles (rad) and four speeds (rad/s).
        truth: the exact ones by sample, where they were recorded.
        payloads: of the platform (kg) by the row of the first readings that are estimated with it.
    """

    samples: IntArray
    angles: FloatArray
    torques: FloatArray
    commands: dict[int, tuple[float, float]]
    gyroscope: list[list[tuple[float, Vector3]]]
    late: list[list[LateReading]]
    estimated: dict[int, tuple[float, ...]]
    truth: dict[int, tuple[float, ...]]
    payloads: dict[int, float]

    def until(self, count: int) -> EstimatorRecord:
        """Return the record of the first so many readings of the motors."""
        return self._replace(
            samples=self.samples[:count],
            angles=self.angles[:count],
            torques=self.torques[:count],
            gyroscope=self.gyroscope[:count],
            late=self.late[:count],
        )


def read_estimator_record(source: Source, scenario: Scenario) -> EstimatorRecord:
    """Read it from a bag of a run of a scenario.

    Raises:
        BagError: the bag cannot be read, or lacks a topic.
        InputError: the run's timing cannot be read.
    """
    recording = read_bag(source.bag, source.namespace)
    recording.refuse_clock_steps(MOTOR_STATES, JOINT_STATES, IMU_DATA, PASSIVE_STATES, EXTRA_READINGS, VISION_PLATFORM)
    rate_hz = scenario.rate_hz
    samples, rows = _samples(recording, MOTOR_STATES, rate_hz)
    if not samples.size:
        raise BagError(source.bag, f"/{MOTOR_STATES.name}: no samples at {rate_hz} Hz: nothing to estimate from")
    lockstep = source.run is not None and read_timing(source.run.timing).mode == "lockstep"
    return EstimatorRecord(
        samples=samples,
        angles=_finite_values(recording, MOTOR_STATES, "position", ACTIVE_JOINTS)[rows],
        torques=_finite_values(recording, MOTOR_STATES, "effort", ACTIVE_JOINTS)[rows],
        commands={
            sample: (tau1, tau2) for sample, (tau1, tau2) in _by_sample(recording, TORQUE_COMMAND, rate_hz, "effort")
        },
        gyroscope=_gyroscope(recording, scenario, samples, lockstep),
        late=[
            [*scalars, *more, *seen]
            for scalars, more, seen in zip(
                _scalars(recording, scenario, samples, lockstep, PASSIVE),
                _scalars(recording, scenario, samples, lockstep, EXTRA),
                _seen(recording, scenario, samples, lockstep),
                strict=True,
            )
        ],
        estimated=_states(recording, JOINT_STATES, rate_hz),
        truth=_states(recording, GROUND_TRUTH, rate_hz) if recording.count(GROUND_TRUTH) else {},
        payloads=_payloads(recording, rate_hz, samples),
    )


def _samples(recording: Recording, topic: Topic, rate_hz: int) -> tuple[IntArray, IntArray]:
    """Return the samples of a topic in ascending order, each once, and the row of the first message of each."""
    numbers = recording.samples(topic, rate_hz)
    # of an earlier run in the same bag, in contrast to one off the grid
    earlier = recording.stamps(topic) < recording.epoch_ns(rate_hz)
    if np.any(numbers[~earlier] < 0):
        raise BagError(recording.path, f"/{topic.name}: a stamp is not on the grid of {rate_hz} Hz")
    samples, rows = np.unique(numbers, return_index=True)
    return samples[samples >= 0], rows[samples >= 0]


def _finite_values(recording: Recording, topic: Topic, name: str, names: Sequence[str]) -> FloatArray:
    values = recording.values(topic, name, names)
    if not np.all(np.isfinite(values)):
        raise BagError(recording.path, f"/{topic.name}: {name}: expected finite numbers in every message")
    return values


def _by_sample(recording: Recording, topic: Topic, rate_hz: int, *fields: str) -> list[tuple[int, tuple[float, ...]]]:
    samples, rows = _samples(recording, topic, rate_hz)
    names = JOINTS if topic.name in (JOINT_STATES.name, GROUND_TRUTH.name) else ACTIVE_JOINTS
    values = np.hstack([_finite_values(recording, topic, field, names)[rows] for field in fields])
    return [(sample, tuple(row)) for sample, row in zip(samples.tolist(), values.tolist(), strict=True)]


def _states(recording: Recording, topic: Topic, rate_hz: int) -> dict[int, tuple[float, ...]]:
    return dict(_by_sample(recording, topic, rate_hz, "position", "velocity"))


def _gyroscope(
    recording: Recording, scenario: Scenario, samples: IntArray, lockstep: bool
) -> list[list[tuple[float, Vector3]]]:
    if not recording.count(IMU_DATA):
        return [[] for _ in samples]
    vectors = recording.field(IMU_DATA, "angular_velocity").tolist()
    values = [(x, y, z) if all(map(math.isfinite, (x, y, z))) else None for x, y, z in vectors]
    if not lockstep:
        return _came(recording, IMU_DATA, values, scenario, samples, None, scenario.imu.clock_offset)
    return _came(recording, IMU_DATA, values, scenario, samples, _by_its_clock(scenario, int(samples[-1])))


def _by_its_clock(scenario: Scenario, last: int) -> Arrival:
    """Return with which sample a reading of the simulated gyroscope arrives, by the moment of its stamp."""
    rate_hz, imu = scenario.rate_hz, scenario.imu
    clock = ImuClock(imu, scenario.plant.gyroscope, rate_hz, scenario.plant.seed)
    late = imu.schedule(rate_hz).latency
    stamps = {clock.stamp_ns(sample): sample for sample in range(last + 1)}
    samples = {round(moment_of_stamp(stamp, rate_hz), STAMP_DIGITS): sample for stamp, sample in stamps.items()}

    def arrival(moment: float) -> int | None:
        # a stamp that this clock does not give is that of another one with the same offset
        return samples.get(round(moment, STAMP_DIGITS), round(moment - imu.clock_offset * rate_hz)) + late

    return arrival


def _scalars(
    recording: Recording, scenario: Scenario, samples: IntArray, lockstep: bool, sensor: int
) -> list[list[LateReading]]:
    """Return the readings of a sensor of one value."""
    topic, extra = PASSIVE_STATES if sensor == PASSIVE else EXTRA_READINGS, scenario.extra()
    settings: LateSensor | None = scenario.passive if sensor == PASSIVE else extra
    if topic not in scalar_topics(scenario) or settings is None or not recording.count(topic):
        return [[] for _ in samples]
    name = scenario.passive.joint if sensor == PASSIVE else EXTRA_NAME
    values = recording.values(topic, "position", (name,))[:, 0].tolist()
    arrival = _later_by(settings.schedule(scenario.rate_hz).latency) if lockstep else None
    came = _came(recording, topic, _finite(values), scenario, samples, arrival)
    return [[LateReading(sensor, moment, value) for moment, value in readings] for readings in came]


def _seen(recording: Recording, scenario: Scenario, samples: IntArray, lockstep: bool) -> list[list[LateReading]]:
    if not recording.count(VISION_PLATFORM):
        return [[] for _ in samples]
    rows = recording.values(VISION_PLATFORM, "position", VISION_NAMES).tolist()
    values = [used(PlatformReading(*row)) for row in rows]
    seen = [value if all(map(math.isfinite, value)) else None for value in values]
    camera, rate_hz, seed = scenario.camera, scenario.rate_hz, scenario.plant.seed
    frame_of = optional_part(CAMERA_FRAMES, CAMERA_ON)

    def arrival(moment: float) -> int | None:
        # the stamp tells of the row of a rolling shutter that shows the platform, the exposure is the nearest one
        every = camera.every(rate_hz)
        frame = frame_of(camera, rate_hz, seed, every * round(moment / every))
        return int(frame.arrival) if frame is not None and frame.arrival >= 0 else None

    offset = camera.clock_offset
    came = _came(recording, VISION_PLATFORM, seen, scenario, samples, arrival if lockstep else None, offset)
    return [[LateReading(CAMERA, moment, *value) for moment, value in readings] for readings in came]


def _finite(values: Sequence[float]) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in values]


def _later_by(late: int) -> Arrival:
    return lambda moment: round(moment) + late


def _payloads(recording: Recording, rate_hz: int, samples: IntArray) -> dict[int, float]:
    """Return each payload (kg) by the row whose estimate was the first to be logged after its message."""
    answered, rows = _samples(recording, JOINT_STATES, rate_hz)
    logged = np.maximum.accumulate(recording.log_times(JOINT_STATES)[rows])
    payloads = {}
    for log_time, mass in recorded_payloads(recording):
        # one at the time of a sample, where time is simulated, came after it
        answer = int(np.searchsorted(logged, log_time, side="right"))
        if answer < len(answered):
            payloads[int(np.searchsorted(samples, answered[answer]))] = mass
    return payloads


def _came(
    recording: Recording,
    topic: Topic,
    values: Sequence[T | None],
    scenario: Scenario,
    samples: IntArray,
    arrival: Arrival | None,
    ahead: float = 0.0,
) -> list[list[tuple[float, T]]]:
    """Return the late readings that came with each sample: those logged by the time of its estimate.

    In lockstep each sample waits for its readings, whenever they are logged: `arrival` tells which these are. Each is
    the moment of its stamp in samples, and its value. The sensor's clock is `ahead` of the samples (s). Of a reading
    that was published repeatedly the first message counts.
    """
    came: list[list[tuple[float, T]]] = [[] for _ in samples]
    epoch = recording.epoch_ns(scenario.rate_hz)
    answered, rows = _samples(recording, JOINT_STATES, scenario.rate_hz)
    logged = np.maximum.accumulate(recording.log_times(JOINT_STATES)[rows])
    known: set[int] = set()
    for log_time, stamp, value in zip(
        recording.log_times(topic), recording.stamps(topic).tolist(), values, strict=True
    ):
        if stamp in known or value is None:
            continue
        known.add(stamp)
        moment = moment_of_stamp(stamp, scenario.rate_hz, epoch)
        reading_moment = moment - ahead * scenario.rate_hz
        if arrival is not None:
            first = arrival(reading_moment)
            if first is None:
                continue
        else:
            answer = int(np.searchsorted(logged, log_time))
            if answer == len(answered):
                continue
            first = max(math.ceil(reading_moment), int(answered[answer]))
        row = int(np.searchsorted(samples, first))
        if row < len(came):
            came[row].append((moment, value))
    return [sorted(readings, key=itemgetter(0)) for readings in came]
