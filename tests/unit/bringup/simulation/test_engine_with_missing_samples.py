# SPDX-License-Identifier: Apache-2.0
"""Samples that never reach the control chain: the compiled loop against the parts of the nodes, on the other plant.

A node whose sample is missing does nothing: no estimate, no law, no guard. The drives hold the last torque.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
import pytest
from engine_agreement import JOINTS, POSITION, changed, columns, places, prepared

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.engine import traced_crossing
from fivebar_bringup.simulation.run_metrics import RunMetrics
from fivebar_control.controller.estimator import estimator_of
from fivebar_control.estimation.late_reading import GYROSCOPE, LateReading
from fivebar_control.laws.reference import against_disturbance
from fivebar_control.laws.torque import UNDEFINED, ZERO
from fivebar_control.loop.closed_loop import FAULT_NAMES
from fivebar_control.loop.law_runner import LawRunner
from fivebar_control.loop.plan_sample import plan_sample
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.safety.guard import Guard
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_control.scenario.start import initial_joints
from fivebar_description.interface import late_stamp_ns, moment_of_stamp
from fivebar_sim.plant import Plant
from fivebar_sim.sensors import ImuReading, ReadingQueue


def by_parts(scenario: Scenario, missing: Collection[int]) -> tuple[list[tuple[float, ...]], list[str]]:
    """Return the exact joint angles (rad) at each sample, and the faults, of a run with what the nodes are made of."""
    robot, plan, rate_hz, lead = scenario.five_bar(), scenario.plan(), scenario.rate_hz, scenario.lead_samples
    plant = Plant(robot, initial_joints(scenario), rate_hz, scenario.plant, scenario.imu)
    queue: ReadingQueue[ImuReading] = ReadingQueue(scenario.imu, rate_hz, scenario.plant.seed)
    estimator, (law,) = estimator_of(scenario), tuned_controller(scenario).laws
    runner = LawRunner(law, robot, plan, rate_hz)
    guard = Guard(robot, plan.mode, rate_hz, scenario.safety)
    positions, faults, command = [], [], ZERO
    for number in range(plan.path.samples(rate_hz) + 1):
        positions.append(tuple(plant.truth().position))
        arrived = queue.arrived(number, plant.measure_imu())
        if number not in missing:
            rates = [
                LateReading(
                    GYROSCOPE,
                    moment_of_stamp(late_stamp_ns(made, rate_hz, scenario.imu.clock_offset), rate_hz),
                    scenario.imu.turn_rate(one.angular_velocity),
                )
                for made, one in arrived
                if scenario.gyro
            ]
            angles, torques = plant.measure().of_motors()
            estimate = estimator.take(number, *angles, *torques, rates)
            if estimator.fault is not None:
                return positions, [estimator.fault.name]
            state = state_from_joints(robot, *estimate.position, *estimate.velocity)
            planned = plan_sample(robot, plan, (number + lead) / rate_hz)
            reference = planned.reference
            if scenario.compensates_disturbance:
                reference = against_disturbance(reference, *estimate.disturbance)
            torque = runner(number + lead, state, reference)
            desired = (planned.platform.x, planned.platform.y)
            command = guard.command(number, state, desired, 0.0, torque, UNDEFINED).applied
            if guard.fault is not None:
                return positions, [guard.fault.name]
            estimator.commanded(number, *command)
        plant.advance(command)
    return positions, faults


def compiled(scenario: Scenario, missing: Collection[int]) -> tuple[RunMetrics, np.ndarray]:
    case, plan = prepared(scenario, stop_at_fault=True)
    absent = case.numbers.missing.copy()
    absent[list(missing)] = True
    return traced_crossing(case._replace(numbers=case.numbers._replace(missing=absent)), plan)


@pytest.fixture(scope="module", params=["encoders", "gyroscope"])
def scenario(request: pytest.FixtureRequest) -> Scenario:
    """Into the other assembly mode; the robot is 5 % heavier than believed, so that there is a disturbance."""
    plant = {"encoder_counts": 20_000, "delay_samples": 1, "mass_scale": 1.05}
    one_way = {"waypoints": [[0.0, 0.15], [0.0, 0.02]], "segment_duration": 0.3}
    sensors = {"gyro": True} if request.param == "gyroscope" else {}
    return changed("unified_middle", plant, estimator="ekf", ekf=sensors, **one_way)


def test_it_is_the_run_of_the_nodes_parts(scenario: Scenario) -> None:
    """Singly, as one of two, before the locus, and for as long as the estimator bears on it."""
    crossing = round(scenario.plan().crossings[0].time * scenario.rate_hz)
    missing = {20, 30, 32, *range(50, 54), *range(crossing - 4, crossing + 5)}
    wanted, faults = by_parts(scenario, missing)
    outcome, trace = compiled(scenario, missing)
    assert faults == []
    assert (FAULT_NAMES[outcome.fault], outcome.mode_changes) == ("", 1)
    robot = scenario.actual_robot()
    found = places(robot, columns(trace, *JOINTS))
    np.testing.assert_allclose(found, places(robot, wanted), rtol=0.0, atol=POSITION)
    undisturbed, _ = by_parts(scenario, ())
    assert np.abs(found - places(robot, undisturbed)).max() > 1e3 * POSITION


def test_with_one_more_the_estimate_is_lost(scenario: Scenario) -> None:
    missing = range(60, 70)
    assert by_parts(scenario, missing)[1] == ["estimate_lost"]
    outcome, _ = compiled(scenario, missing)
    assert (FAULT_NAMES[outcome.fault], outcome.fault_sample) == ("estimate_lost", 70)
