# SPDX-License-Identifier: Apache-2.0
"""The estimator whose memory stays with machine code: the plain one's estimates, to the last bit."""

from __future__ import annotations

import pytest

from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.offline import simulate
from fivebar_control.controller.estimator import estimator_of
from fivebar_control.estimation.compiled_estimator import CompiledEstimator, _machine_code
from fivebar_control.estimation.homing import homing_at
from fivebar_control.estimation.late_reading import GYROSCOPE, LateReading
from fivebar_control.estimation.step import filter_functions
from fivebar_description.parameters import laden

SAMPLES = 120


def exact(*parts: tuple[float, ...]) -> list[str]:
    """Numbers to the last bit, whatever their types."""
    return [float(value).hex() for part in parts for value in part]


@pytest.mark.extra
def test_a_payload_and_a_new_beginning_are_those_of_the_plain_estimator() -> None:
    """With late readings of a gyroscope; a sample is left out, so that the command before it holds."""
    scenario = load_scenario("gyro_middle")
    plain, compiled = estimator_of(scenario), estimator_of(scenario, kind=CompiledEstimator)
    assert compiled.belief is None
    compiled.warm_up()
    machine_code = [len(one.signatures) for one in _machine_code(filter_functions(None))]
    samples = simulate(scenario).samples[:SAMPLES]
    robot = scenario.five_bar()
    for both in ("first", "again"):
        for sample in samples:
            if sample.number == 60:
                continue
            assert sample.estimated is not None
            (q11, q21), (tau1, tau2) = sample.estimated.motors
            usable = scenario.imu.usable_rate
            rates = [LateReading(GYROSCOPE, one.made, usable(one.reading.angular_velocity)) for one in sample.imu]
            one, other = (each.take(sample.number, q11, q21, tau1, tau2, rates) for each in (plain, compiled))
            assert exact(*one) == exact(*other), (both, sample.number)
            assert exact(plain.squared) == exact(compiled.squared)
            for each in (plain, compiled):
                each.commanded(sample.number, *sample.command)
                if sample.number == 30:
                    each.carry(laden(robot, 0.05))
        assert plain.belief is not None and compiled.belief is not None
        assert plain.belief.estimate == compiled.belief.estimate
        assert plain.belief.covariance.tobytes() == compiled.belief.covariance.tobytes()
        for each in (plain, compiled):
            each.begin_at(homing_at(robot, (1, -1), *scenario.waypoints[0]))
        assert compiled.belief is None
    after = [len(one.signatures) for one in _machine_code(filter_functions(None))]
    assert after == machine_code, "nothing is compiled after the warm-up"
