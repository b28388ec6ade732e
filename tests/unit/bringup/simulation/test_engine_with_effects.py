# SPDX-License-Identifier: Apache-2.0
"""The compiled loop and the offline runner have one source for a robot with effects: they agree, effect by effect."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from engine_agreement import JOINTS, changed, columns, expect_agreement, places, prepared
from estimate_replay import summary_of

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.engine import crossing, traced_crossing
from fivebar_control.loop.closed_loop import FAULT_NAMES
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.settings import sections
from fivebar_sim.effects.settings import PlantSettings

pytestmark = pytest.mark.extra  # compiling two engines takes a minute

EFFECTS: dict[str, dict[str, Any]] = {
    "links": {
        "l_11": 1e-5,
        "l_12": -1e-5,
        "base_2": 1e-5,
        "distal_inertia": -5e-5,
        "distal_mass": 0.005,
        "base_rise": 1e-6,
    },
    "friction": {"stribeck": 1.3, "viscous": 0.01, "presliding": 1e-3, "presliding_damping": 0.2, "passive": 0.003},
    "heating": {"change": -0.3, "work": 1.0},
    "supply": {"half_power": 100.0},
    "motors": {"constant_1": 0.05, "constant_2": -0.05, "ripple": 0.03, "cogging": 0.04, "current_loop_hz": 1000.0},
    "transmission": {"frequency": 250.0, "backlash": 1e-4},
    "platform_joint": {"stiffness": 1e6, "clearance": 5e-6},
    "encoders": {"zero_1": 5e-5, "zero_2": -5e-5, "eccentricity": 1e-4, "interpolation": 2e-5},
    "gyroscope": {"scale": 0.01, "misalignment": 0.02, "bias_jump": 0.01, "clock_jitter": 5e-4},
    "tilt": {"angle": 0.03, "heading": 1.0, "leg_moment": 0.03},
    "vibration": {"amplitude": 1e-4, "heading": 1.0},
    "cable": {"force": 0.1, "stiffness": 1.0, "length": 0.2},
    "push": {"force": 0.7, "along": "locus", "start": 0.2, "length": 0.05},
    "bus": {"lost_commands": 40, "lost_within": 0.4},
    "timing": {"command_delay": 2e-4, "command_jitter": 3e-4, "reading_age": 1e-4, "reading_jitter": 2e-4},
}


def with_effects(name: str, effects: dict[str, Any], **fields: Any) -> Scenario:
    """One segment, through the locus."""
    common: dict[str, Any] = {"controller": "unified", "segment_duration": 0.4, "waypoints": [[0.0, 0.15], [0.0, 0.02]]}
    return changed(name, {**effects, "seed": 5}, **common, **fields)


def test_every_effect_is_here() -> None:
    assert EFFECTS.keys() == sections(PlantSettings).keys()


@pytest.mark.parametrize("effect", [name for name in EFFECTS if name != "gyroscope"])
def test_each_effect_is_that_of_the_offline_runner_and_makes_a_difference(effect: str) -> None:
    scenario = with_effects("middle", {effect: EFFECTS[effect]})
    _, outcome = expect_agreement(scenario, 1e-9)
    assert outcome.fault == NO_FAULT
    ideal = crossing(*prepared(with_effects("middle", {})))
    assert abs(outcome.error_peak - ideal.error_peak) > 1e-7


def test_all_effects_together_from_counted_encoders_are_those_of_the_offline_runner() -> None:
    effects = {**EFFECTS, "encoder_counts": 65_536, "delay_samples": 1, "torque_quantum": 0.002, "torque_limit": 2.0}
    known = {"length": 1e-5, "base": 1e-5, "zero": 1e-4}
    # beyond the limits that follow from these tolerances, as so many effects are
    ekf = {"disturbance_rate": 0.1, "gyro": True, "misfit_limit": 200.0, "offset_limit": 6.0, "jump_limit": 30.0}
    scenario = with_effects("middle_encoders", effects, tolerances=known, ekf=ekf)
    _, outcome = expect_agreement(scenario, 1e-9)
    assert outcome.fault == NO_FAULT
    assert 1e-5 < outcome.loop_gap < 1e-3


@pytest.mark.parametrize("name", ["middle_encoders", "middle"])
def test_the_outcome_is_that_of_the_robot_that_there_is_and_so_is_the_summary(name: str) -> None:
    """The summary takes the exact joints with the actual lengths, as the engine does, with and without estimator."""
    scenario = with_effects(name, {"links": {"l_11": 2e-5, "l_21": -2e-5}})
    summary, _ = summary_of(scenario)
    case, plan = prepared(scenario)
    outcome, trace = traced_crossing(case, plan)
    assert summary.tracking_error_peak_m == pytest.approx(outcome.error_peak, abs=1e-9)
    exact = places(scenario.actual_robot(), columns(trace, *JOINTS))
    assert np.hypot(*(exact - plan.rows[: len(exact), :2]).T).max() == pytest.approx(outcome.error_peak, abs=1e-9)


def test_a_robot_that_comes_apart_is_found_at_the_same_sample() -> None:
    effects = {"platform_joint": {"stiffness": 20.0}}
    run, outcome = expect_agreement(with_effects("middle", effects, tracking_error_limit=1.0))
    assert FAULT_NAMES[outcome.fault] == "plant_diverged"
    assert len(run.samples) == outcome.samples


GYRO: dict[str, Any] = {
    "ekf": {"disturbance_rate": 0.1, "gyro": True, "offset_limit": 6.0, "jump_limit": 12.0},
    "imu": {"gyro_noise": 0.01, "rate_hz": 250, "latency": 0.004},
    "tolerances": {"length": 1e-5, "base": 1e-5, "zero": 1e-4},
}
FAULTS: dict[str, tuple[dict[str, Any], dict[str, Any], str]] = {
    "slip": ({"encoders": {"slip_2": 100, "slip_time": 0.15}}, {}, "estimate_inconsistent"),
    "frozen encoder": ({"encoders": {"frozen_motor": 1, "frozen_from": 0.1}}, {}, "encoder_frozen"),
    "interpolation": ({"encoders": {"interpolation": 1e-5, "lines": 5000}}, {}, ""),
    "frozen gyroscope": ({"gyroscope": {"frozen_from": 0.1, "frozen_length": 1.0}}, {}, "gyroscope_frozen"),
    "bias": ({"gyroscope": {"bias_jump": 0.5, "bias_time": 0.15}}, {}, "estimate_inconsistent"),
    "missing from the start": ({"gyroscope": {"missing_length": 1e6}}, {}, "gyroscope_missing"),
    "missing for a while": ({"gyroscope": {"missing_from": 0.15, "missing_length": 0.06}}, {}, ""),
    "clip": ({}, {"gyro_range": 0.5}, "gyroscope_saturated"),
    "clock behind": ({}, {"clock_offset": -0.12}, "gyroscope_late"),
    "clock ahead": ({}, {"clock_offset": 0.12}, "gyroscope_early"),
    "drift and jitter": ({"gyroscope": {"clock_drift": 1e-3, "clock_jitter": 1e-3}}, {}, ""),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_each_fault_of_a_sensor_is_that_of_the_offline_runner_and_has_its_name(fault: str) -> None:
    plant, imu, name = FAULTS[fault]
    common = {"encoder_counts": 20_000, "delay_samples": 1, "torque_quantum": 0.002, "torque_limit": 2.0}
    scenario = with_effects("middle_encoders", {**plant, **common}, **{**GYRO, "imu": {**GYRO["imu"], **imu}})
    _, outcome = expect_agreement(scenario, 1e-6)
    assert FAULT_NAMES[outcome.fault] == name
    sound = crossing(*prepared(with_effects("middle_encoders", common, **GYRO)))
    assert (sound.fault, sound.estimate_error != outcome.estimate_error) == (NO_FAULT, True)
