# SPDX-License-Identifier: Apache-2.0
"""The controller as an object: lost samples, times, faults and how they are cleared, further motions."""

from __future__ import annotations

import math

import pytest

from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.offline import plant_parts
from fivebar_control.controller.motion_controller import ControlOutput, MotionController, StillFaulty
from fivebar_control.estimation.homing import HomingContradicted
from fivebar_control.laws.torque import ZERO
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.planning.motion_queue import Goal
from fivebar_control.trajectory.planner import PlanRefused
from fivebar_description.errors import InputError
from fivebar_description.readings import SensorReadings
from fivebar_sim.simulated_plant import SimulatedPlant

RATE_HZ = 500


def controller(name: str = "unified_middle", longest_hold: int | None = None, **keys: object) -> MotionController:
    return MotionController(load_scenario(name, changes=dict(keys)), longest_hold)


def at_rest(control: MotionController, x: float = 0.0, y: float = 0.15) -> SensorReadings:
    joints = inverse_geometry(control.scenario.five_bar(), (1, -1), x, y)
    return SensorReadings(joint_angles=tuple(joints), joint_velocities=(0.0,) * 4)


def run_on(
    control: MotionController, plant: SimulatedPlant, readings: SensorReadings
) -> tuple[ControlOutput, SensorReadings]:
    """Step both until the motion is finished; return the last answer and the readings after it."""
    while True:
        output = control.step(readings)
        readings = plant.step(output.torque)
        if control.finished:
            return output, readings


def test_a_lost_sample_holds_the_torque_and_too_many_of_them_stop_the_robot() -> None:
    control = controller(longest_hold=3)
    held = control.step(at_rest(control)).torque
    assert held != ZERO
    outputs = [control.step(None) for _ in range(5)]
    assert [one.torque for one in outputs] == [held] * 3 + [ZERO] * 2
    assert [one.fault is None for one in outputs] == [True] * 3 + [False] * 2
    assert str(control.fault) == "state_stale: no sample after 0, where the torque is held for 3 at most"
    assert control.step(at_rest(control)).torque == ZERO
    control.clear()
    assert control.step(at_rest(control)).torque != ZERO


def test_samples_that_a_time_leaves_out_are_lost_ones() -> None:
    one, other = controller(), controller()
    for control in (one, other):
        control.step(at_rest(control))
    for _ in range(4):
        one.step(None)
    moving = at_rest(one)._replace(joint_velocities=(0.1, 0.0, -0.1, 0.0))
    assert one.step(moving) == other.step(moving._replace(time=5 / RATE_HZ))


def test_a_time_again_gets_the_same_answer_and_one_that_goes_back_is_refused() -> None:
    control = controller()
    readings = at_rest(control)
    with pytest.raises(InputError, match=r"time: -0.002: it goes back: expected at least 0 s"):
        control.step(readings._replace(time=-1 / RATE_HZ))
    first = control.step(readings._replace(time=0.01))
    assert control.step(readings._replace(time=0.01)) is first
    with pytest.raises(InputError, match=r"time: 0.008: it goes back: expected at least 0.01 s"):
        control.step(readings._replace(time=0.008))
    with pytest.raises(InputError, match=r"time: 0.0125: expected a multiple of the period, 0.002 s"):
        control.step(readings._replace(time=0.0125))


def test_readings_that_the_scenario_does_not_take_are_refused_and_leave_the_controller_as_it_was() -> None:
    control = controller()
    with pytest.raises(InputError, match=r"joint_angles, joint_velocities: .* or a scenario with estimator ekf"):
        control.step(SensorReadings(motor_angles=(0.0, 0.0)))
    with pytest.raises(InputError, match=r"joint_velocities: .*nan.*expected 4 finite numbers"):
        control.step(at_rest(control)._replace(joint_velocities=(0.0, math.nan, 0.0, 0.0)))
    assert control.step(at_rest(control)).sample == 0


def test_an_estimator_refuses_to_begin_elsewhere() -> None:
    control = controller("gyro_middle")
    with pytest.raises(HomingContradicted):
        control.step(SensorReadings(motor_angles=(0.0, 0.0)))


def test_a_fault_stops_the_robot_and_is_cleared_at_rest_where_the_robot_stands() -> None:
    control = controller()
    readings = at_rest(control)
    control.step(readings)
    fast = control.step(readings._replace(joint_velocities=(60.0, 0.0, 0.0, 0.0)))
    assert fast.torque == ZERO and str(fast.fault).startswith("over_speed: at sample 1: motors at 60.00")
    with pytest.raises(StillFaulty, match="over_speed"):
        control.clear()
    control.step(readings._replace(joint_velocities=(1.0, 0.0, 0.0, 0.0)))
    with pytest.raises(StillFaulty, match=r"the motors still turn at 1.00 rad/s, at rest is below 0.1 rad/s"):
        control.clear()
    elsewhere = at_rest(control, 0.01, 0.14)
    control.step(elsewhere)
    with pytest.raises(PlanRefused, match="clear it first"):
        control.request(Goal(0.0, 0.1))
    control.clear()
    assert control.fault is None and control.finished
    held = control.step(elsewhere)
    assert held.fault is None and held.reference[:2] == pytest.approx((0.01, 0.14), abs=1e-12)
    assert held.reference[2:] == (0.0,) * 4
    control.reset()
    assert control.step(readings).sample == 0 and control.fault is None


def test_faults_of_the_estimator_are_cleared_by_a_new_beginning_only() -> None:
    control = controller("gyro_middle")
    plant = SimulatedPlant(*plant_parts(load_scenario("gyro_middle")))
    readings = plant.reset()
    while control.fault is None:
        # one motor's encoder reads what it read at the start
        stuck = readings.motor_angles and (plant_start(control), readings.motor_angles[1])
        readings = plant.step(control.step(readings._replace(motor_angles=stuck)).torque)
    assert control.fault.name in ("encoder_frozen", "estimate_inconsistent")
    with pytest.raises(StillFaulty, match="only a new beginning clears"):
        control.clear()
    control.reset()
    assert control.step(plant.reset()).fault is None


def plant_start(control: MotionController) -> float:
    return inverse_geometry(control.scenario.five_bar(), (1, -1), *control.scenario.waypoints[0]).q11


@pytest.mark.parametrize("name", ["unified_middle", "mpc_middle"])
def test_a_further_motion_crosses_from_where_the_robot_rests(name: str) -> None:
    control, plant = controller(name), SimulatedPlant(*plant_parts(load_scenario(name)))
    with pytest.raises(PlanRefused, match=r"the robot is moving for another 2\.00 s"):
        control.request(Goal(0.0, 0.1))
    _, readings = run_on(control, plant, plant.reset())
    control.request(Goal(0.0, 0.02, assembly=-1, duration=0.54))
    assert not control.finished
    output, readings = run_on(control, plant, readings)
    assert output.fault is None and output.reference[:2] == pytest.approx((0.0, 0.02), abs=1e-9)
    exact = plant.truth
    state = state_from_joints(control.scenario.five_bar(), *exact.position, *exact.velocity)
    assert (state.x, state.y) == pytest.approx((0.0, 0.02), abs=2e-4)
    with pytest.raises(PlanRefused, match=r"goal: .* out of reach"):
        control.request(Goal(0.0, 0.5))
    control.request(Goal(0.0, 0.15, assembly=1, duration=0.54))
    output, _ = run_on(control, plant, readings)
    assert output.fault is None and output.estimate is not None
    assert (output.estimate.x, output.estimate.y) == pytest.approx((0.0, 0.15), abs=2e-4)


def test_laws_that_switch_take_no_further_motion() -> None:
    with pytest.raises(PlanRefused, match="they need controller unified"):
        controller("middle").request(Goal(0.0, 0.1))


@pytest.mark.parametrize("name", ["unified_middle", "gyro_middle"])
def test_it_begins_where_the_robot_rests_and_holds_it_there(name: str) -> None:
    control = controller(name)
    joints = inverse_geometry(control.scenario.five_bar(), (1, -1), 0.02, 0.13)
    control.begin_at(joints)
    assert control.finished
    readings = SensorReadings(None, (joints.q11, joints.q21), (0.0, 0.0), tuple(joints), (0.0,) * 4)
    output = control.step(readings)
    assert output.fault is None and output.reference[:2] == pytest.approx((0.02, 0.13), abs=1e-12)
    assert output.estimate is not None
    assert (output.estimate.x, output.estimate.y) == pytest.approx((0.02, 0.13), abs=1e-4)
    with pytest.raises(InputError, match=r"posture: it has the working mode \[-1, -1\]: expected .* \[1, -1\]"):
        control.begin_at(inverse_geometry(control.scenario.five_bar(), (-1, -1), 0.02, 0.13))
