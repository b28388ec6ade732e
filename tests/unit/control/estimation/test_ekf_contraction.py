# SPDX-License-Identifier: Apache-2.0
"""The filter forgets where it was: estimates of the same readings approach each other, whatever the tolerances.

With a gyroscope constant errors are estimated, and do not forget: a part of what moved the estimate stays in them, and
less than that in the position.
"""

from __future__ import annotations

import functools

import numpy as np
import pytest
from estimate_replay import encoder_scenario
from numpy.typing import NDArray

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.offline import OfflineRun, simulate
from fivebar_control.estimation.constants import EstimatorModel, estimator_model
from fivebar_control.estimation.ekf import Estimate
from fivebar_control.estimation.gyroscope import with_rate
from fivebar_control.estimation.history import keep_belief
from fivebar_control.estimation.readings import EstimatorMemory, with_motors
from fivebar_control.estimation.settings import EkfSettings, Sensing
from fivebar_control.estimation.step import first_update, next_update
from fivebar_control.scenario.sensors import homing_of
from fivebar_description.tolerances import Tolerances

PERTURBED = 150
"""Sample after which one of the estimates is moved, on the way from the locus to the end of the motion."""


@functools.cache
def run_of_gyroscope() -> tuple[Scenario, OfflineRun]:
    imu = {"gyro_noise": 0.01, "gyro_bias": 0.01}
    tolerances = {"length": 4e-4}
    scenario = encoder_scenario("middle", 0.5, ekf={"gyro": True}, imu=imu, tolerances=tolerances)
    return scenario, simulate(scenario)


def moved(memory: EstimatorMemory) -> EstimatorMemory:
    estimate = memory.belief.estimate
    belief = memory.belief._replace(estimate=estimate._replace(x=estimate.x + 1e-11, vx=estimate.vx + 1e-9))
    keep_belief(memory.history, memory.newest, belief)
    return memory._replace(belief=belief)


def estimates(model: EstimatorModel, run: OfflineRun, assembly: int, gyro: bool, perturbed: bool) -> list[Estimate]:
    """Return the estimates after the perturbed sample."""
    found = []
    memory: EstimatorMemory | None = None
    for sample in run.samples:
        assert sample.estimated is not None
        (q11, q21), (tau1, tau2) = sample.estimated.motors
        if memory is None:
            memory = first_update(model, assembly, q11, q21)
            continue
        memory = with_motors(memory, sample.number, 1, q11, q21, tau1, tau2)
        for one in sample.imu if gyro else ():
            with_rate(model, memory, one.made, one.reading.angular_velocity[2])
        memory = next_update(model, memory, memory.newest).memory
        if sample.number == PERTURBED and perturbed:
            memory = moved(memory)
        if sample.number >= PERTURBED:
            found.append(memory.belief.estimate)
    return found


def motions(found: list[Estimate]) -> NDArray[np.float64]:
    """Return x, y, vx, vy of estimates, [N, 4]."""
    return np.array([one[:4] for one in found])


@pytest.mark.extra
@pytest.mark.parametrize("gyro", [False, True])
@pytest.mark.parametrize("length", [0.0, 5e-5, 4e-4, 2e-3])
def test_a_small_error_dies_out(gyro: bool, length: float) -> None:
    scenario, run = run_of_gyroscope()
    homing = homing_of(scenario)
    model = estimator_model(
        scenario.five_bar(),
        homing.mode,
        Sensing(scenario.rate_hz, scenario.drives(), EkfSettings(gyro=gyro), Tolerances(length=length)),
    )
    without, with_it = (estimates(model, run, homing.assembly, gyro, perturbed) for perturbed in (False, True))
    differences = np.abs(motions(with_it) - motions(without))
    assert differences[0].max() == pytest.approx(1e-9, rel=1e-6)
    # m and m/s; the moved velocity alone would lead 1e-10 m away
    assert differences[-1, :2].max() < (1e-11 if gyro and length > 0.0 else 1e-12)
    assert differences[-1, 2:].max() < 1e-10
