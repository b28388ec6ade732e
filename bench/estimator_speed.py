# SPDX-License-Identifier: Apache-2.0
"""The speed of the state estimator as its node runs it: its step as machine code."""

from __future__ import annotations

import statistics
from time import perf_counter

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.offline import simulate
from fivebar_control.controller.estimator import estimator_of
from fivebar_control.estimation.compiled_estimator import CompiledEstimator
from fivebar_control.estimation.late_reading import GYROSCOPE, LateReading


def estimator_us(scenario: Scenario) -> float:
    """Return the median time (us) that the estimator takes for a sample of a scenario's run: motors and gyroscope.

    Nothing else runs between the samples, so that the processor's caches keep what the filter needs.

    Raises:
        ValueError: the scenario has no estimator.
    """
    if not scenario.estimated:
        raise ValueError(f"{scenario.name}: estimator none: expected ekf")
    estimator = estimator_of(scenario, kind=CompiledEstimator)
    estimator.warm_up()
    taken = []
    for sample in simulate(scenario).samples:
        assert sample.estimated is not None
        (q11, q21), (tau1, tau2) = sample.estimated.motors
        usable_rate = scenario.imu.usable_rate
        rates = [LateReading(GYROSCOPE, one.made, usable_rate(one.reading.angular_velocity)) for one in sample.imu]
        began = perf_counter()
        estimator.take(sample.number, q11, q21, tau1, tau2, rates if scenario.gyro else ())
        taken.append(perf_counter() - began)
        estimator.commanded(sample.number, *sample.command)
    return statistics.median(taken) * 1e6
