# SPDX-License-Identifier: Apache-2.0
"""Runs from the two motor encoders: made offline, judged by the summary, and estimated again with other settings."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from fivebar_bringup.recorded.series import RunSeries, read_series
from fivebar_bringup.recorded.summary import Summary, summarize
from fivebar_bringup.recorded.timing import RunTiming
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.offline import OfflineRun, simulate
from fivebar_bringup.simulation.run_in_memory import RunInMemory
from fivebar_control.estimation.ekf import Belief
from fivebar_control.estimation.estimator import StateEstimator
from fivebar_control.estimation.late_reading import GYROSCOPE, LateReading
from fivebar_control.estimation.settings import EkfSettings, Sensing
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.model.state import State
from fivebar_control.scenario.sensors import homing_of
from fivebar_description.parameters import FiveBar

OFF_MODEL = {"mass_scale": 1.1, "inertia_scale": 0.9, "friction_scale": 0.8}
"""A robot that is heavier, of less inertia and smoother than the controllers and the estimator believe."""


def encoder_scenario(
    name: str, duration: float, gains: tuple[float, float] = (900.0, 60.0), plant: Mapping[str, Any] = {}, **fields: Any
) -> Scenario:
    """Return a shipped scenario with 20000 counts, torque steps of 2 mNm and a sample of delay; kp, kd of all laws."""
    kp, kd = gains
    content = load_scenario(name).model_dump(mode="json")
    content |= {"estimator": "ekf", "segment_duration": duration, **fields}
    content["gains"] = {"kp": kp, "kd": kd, "kp_vhc": kp, "kd_vhc": kd}
    content["plant"] |= {"encoder_counts": 20000, "torque_quantum": 0.002, "delay_samples": 1, **plant}
    return Scenario.model_validate(content)


class Replayed(NamedTuple):
    """One sample of a run that was estimated again: the belief and the exact state at the measurement's moment."""

    number: int
    belief: Belief
    truth: State
    fault: str | None

    @property
    def error(self) -> float:
        """Distance (m) of the estimated platform from the exact one."""
        return math.hypot(self.belief.estimate.x - self.truth.x, self.belief.estimate.y - self.truth.y)


def exact_state(robot: FiveBar, sample: Any) -> State:
    """Return the exact state of a sample of an offline run."""
    return state_from_joints(robot, *sample.exact.position, *sample.exact.velocity)


def replay(run: OfflineRun, scenario: Scenario, settings: EkfSettings | None = None) -> Iterator[Replayed]:
    """Give a run's readings and commands to a new estimator, by default one like that of the run.

    It gets the gyroscope's readings, as late as they came, where its settings use them.
    """
    settings = settings if settings is not None else scenario.ekf
    # read from its file once
    robot = scenario.five_bar()
    estimator = StateEstimator(
        robot,
        homing_of(scenario),
        Sensing(scenario.rate_hz, scenario.drives(), settings, scenario.known_within()),
    )
    for sample in run.samples:
        assert sample.estimated is not None
        angles, torques = sample.estimated.motors
        turn_rate = scenario.imu.turn_rate
        rates = [LateReading(GYROSCOPE, one.made, turn_rate(one.reading.angular_velocity)) for one in sample.imu]
        estimator.take(sample.number, *angles, *torques, rates if settings.gyro else ())
        estimator.commanded(sample.number, *sample.command)
        assert estimator.belief is not None
        fault = str(estimator.fault) if estimator.fault is not None else None
        yield Replayed(sample.number, estimator.belief, exact_state(robot, sample), fault)


def summary_of(scenario: Scenario) -> tuple[Summary, RunSeries]:
    """Run a scenario offline and judge it as `fivebar simulate` does, without a bag and without figures."""
    return _summary_of(scenario.model_dump_json())


@functools.cache
def _summary_of(content: str) -> tuple[Summary, RunSeries]:
    scenario = Scenario.model_validate_json(content)
    recording = RunInMemory(simulate(scenario), scenario)
    series = read_series(recording, scenario)
    return summarize(recording, series, scenario, RunTiming(runner="offline")), series
