# SPDX-License-Identifier: Apache-2.0
"""One crossing as numbers, the input of the compiled loop."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_bringup.scenario import Scenario
from fivebar_control.controller.estimator import estimator_model_of
from fivebar_control.controller.settings import cycle_settings
from fivebar_control.estimation.constants import EstimatorModel
from fivebar_control.laws.registry import Controller
from fivebar_control.loop.cycle import CycleSettings
from fivebar_control.loop.sampled_plan import Sampled
from fivebar_description.optional import CAMERA_FRAMES, CAMERA_ON, optional_part
from fivebar_description.parameters import FiveBar, with_floats
from fivebar_description.settings import as_numbers
from fivebar_description.strict_yaml import InputError
from fivebar_sim.effects.gyroscope import ImuClock, SampleSpan, frozen_samples, gain, jumps, missing_samples
from fivebar_sim.effects.links import with_modelled_geometry
from fivebar_sim.effects.mechanism import actual_robot, mechanism_of, steps_of_period
from fivebar_sim.effects.settings import MUJOCO, PlantSettings, has_effects, without_effects
from fivebar_sim.effects.timing import lost_commands
from fivebar_sim.sensors import PASSIVE_LOSSES, PassiveNumbers, gyro_errors, gyro_stream, made_readings, passive_numbers

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


class Estimation(NamedTuple):
    """The estimator.

    Attributes:
        feed_forward: whether the laws compensate its disturbances.
        model: its constants.
        latency: samples from a gyroscope reading to its arrival.
        stamps: float64[N + 1], moment of the stamp of the reading that is made at each sample, in samples; [0] without
            a gyroscope.
        gyro_keep: of its low-pass, see `ImuSettings.gyro_keep`.
        gyro_errors: float64[N + 1], error of its reading at each sample (rad/s); [0] without a gyroscope.
        gyro_made: bool[N + 1], at which samples a reading of it is made that arrives; [0] without one.
        gyro_gain: how much it reads of a rate.
        gyro_limit: rate (rad/s) from which on it is at the end of its range.
        gyro_frozen: samples whose readings repeat the one before.
        passive: the encoder on a passive joint, whose leg is that of the model.
        passive_latency: samples from a reading of it to its arrival.
        passive_made: bool[N + 1], at which samples a reading of it is made that arrives; [0] without one.
        frames: float64[n, 4], the camera's positions by arrival: samples of exposure and arrival, and the errors in x
            and y (m); [0, 4] without a camera. Pictures are not rendered here.
        seen_deviation: of either coordinate (m), as the positions say of themselves.
    """

    feed_forward: bool
    model: EstimatorModel
    latency: int
    stamps: FloatArray
    gyro_keep: float
    gyro_errors: FloatArray
    gyro_made: BoolArray
    gyro_gain: float
    gyro_limit: float
    gyro_frozen: SampleSpan
    passive: PassiveNumbers
    passive_latency: int
    passive_made: BoolArray
    frames: FloatArray
    seen_deviation: float


class Numbers(NamedTuple):
    """Constants of one crossing for the compiled loop.

    Attributes:
        control: settings of the control cycle, with the nominal robot of controllers and estimator.
        actual: the simulated robot, whose parameters, lengths included, may differ from the nominal ones.
        rate_hz: samples per second.
        lead: samples from a measurement to the instant for which its state holds.
        steps, step: integration steps per sample, and their length (s).
        equipment: encoders and drives, as numbers; its sections of effects are empty.
        mechanism: the robot with effects (`Mechanism`), None without any.
        lost: bool[N + 1 + lead], the samples whose commands do not reach the drives.
        missing: bool[N + 1 + lead], the samples that do not reach the control chain, never sample 0. What motors,
            gyroscope and passive joint would have read with them is lost, and there is no command, so that the drives
            hold the last one. Positions by the camera come with the next sample.
        estimation: the estimator (`Estimation`), None without one.
        stop_at_fault: end the run at its first fault; the offline runner lets the robot coast instead.
    """

    control: CycleSettings
    actual: FiveBar
    rate_hz: int
    lead: int
    steps: int
    step: float
    equipment: PlantSettings
    mechanism: Any
    lost: BoolArray
    missing: BoolArray
    estimation: Any
    stop_at_fault: bool


class EngineRun(NamedTuple):
    """The run that the functions of the engine's loop take.

    Attributes:
        case: the crossing.
        plan: its sampled plan.
        trace: float64[N + 1, columns of `TraceRow`] to be filled.
    """

    case: Numbers
    plan: Sampled
    trace: FloatArray


class Case(NamedTuple):
    """One crossing: the controller and its constants."""

    controller: Controller
    numbers: Numbers


class GyroReadings(NamedTuple):
    """The readings of a gyroscope, sample by sample, as `Estimation` has them."""

    stamps: FloatArray
    errors: FloatArray
    made: BoolArray


def gyro_readings(scenario: Scenario, samples: int) -> GyroReadings:
    """Return the readings of a scenario's gyroscope at so many samples; none where the estimator uses none."""
    if not scenario.gyro:
        return GyroReadings(np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.bool_))
    faults, rate_hz, seed = scenario.plant.gyroscope, scenario.rate_hz, scenario.plant.seed
    errors = gyro_errors(scenario.imu, gyro_stream(seed), samples) + jumps(faults, rate_hz, samples)
    made = made_readings(scenario.imu, rate_hz, seed, samples, missing=missing_samples(faults, rate_hz))
    return GyroReadings(ImuClock(scenario.imu, faults, rate_hz, seed).moments(samples), errors, made)


def _passive_made(scenario: Scenario, samples: int) -> BoolArray:
    """Return at which samples the encoder on a passive joint reads, as `Estimation` has it."""
    if not scenario.passive.leg:
        return np.zeros(0, dtype=np.bool_)
    return made_readings(scenario.passive, scenario.rate_hz, scenario.plant.seed, samples, PASSIVE_LOSSES)


def _frames(scenario: Scenario, samples: int) -> FloatArray:
    """Return the camera's positions that the estimator takes, as `Estimation` has them."""
    if not (scenario.sees and scenario.ekf.camera):
        return np.zeros((0, 4))
    frame_of = optional_part(CAMERA_FRAMES, CAMERA_ON)
    camera, rate_hz = scenario.camera, scenario.rate_hz
    made = [frame_of(camera, rate_hz, scenario.plant.seed, sample) for sample in range(samples)]
    frames = sorted((one for one in made if one is not None and one.arrival >= 0), key=lambda one: one.arrival)
    spread = camera.deviation
    rows = [(one.sample, one.arrival, spread * one.noise_x, spread * one.noise_y) for one in frames]
    return np.array(rows, dtype=np.float64).reshape(len(rows), 4)


def case_of(scenario: Scenario, actual: FiveBar | None = None, stop_at_fault: bool = False) -> Case:
    """Return a scenario's case; `actual` replaces the robot that its section `plant` describes.

    Of the section `imu` only the gyroscope is used: no controller reads the accelerometer.

    Raises:
        InputError: the robot is MuJoCo's, which cannot be compiled, or the scenario says where the robot stands.
    """
    if scenario.plant.engine == MUJOCO:
        raise InputError(
            f"{scenario.name}: plant.engine: mujoco cannot be compiled: expected pinocchio here; fivebar run, simulate"
            " and compare take it"
        )
    if scenario.stands is not None:
        raise InputError(
            f"{scenario.name}: stands: the compiled simulation begins where the motion does: expected none here;"
            " fivebar run and simulate take it"
        )
    control = cycle_settings(scenario)
    plant, nominal = scenario.plant, control.robot
    if actual is None:
        actual = actual_robot(nominal, plant)
    else:
        plant = _unchanged_by(plant)
    mechanism = None
    if has_effects(plant):
        mechanism = mechanism_of(nominal if plant is scenario.plant else actual, plant, scenario.rate_hz)
    steps = steps_of_period(actual, scenario.rate_hz)
    lost = _lost(scenario, plant)
    numbers = Numbers(
        control=control,
        actual=with_floats(actual),
        rate_hz=scenario.rate_hz,
        lead=scenario.lead_samples,
        steps=steps,
        step=control.period / steps,
        equipment=as_numbers(without_effects(plant)),
        mechanism=mechanism,
        lost=lost,
        missing=np.zeros_like(lost),
        estimation=_estimation(scenario, nominal, control.period) if scenario.estimated else None,
        stop_at_fault=stop_at_fault,
    )
    return Case(scenario.scheme(), numbers)


def _estimation(scenario: Scenario, robot: FiveBar, period: float) -> Estimation:
    """Return the estimator of a scenario, for its robot with other types of number."""
    samples = scenario.plan().path.samples(scenario.rate_hz) + 1 if scenario.reads_late else 0
    gyro = gyro_readings(scenario, samples)
    return Estimation(
        scenario.compensates_disturbance,
        estimator_model_of(scenario, robot),
        scenario.imu.schedule(scenario.rate_hz).latency,
        gyro.stamps,
        scenario.imu.gyro_keep(period),
        gyro.errors,
        gyro.made,
        gain(scenario.plant.gyroscope),
        scenario.imu.gyro_limit(),
        frozen_samples(scenario.plant.gyroscope, scenario.rate_hz),
        passive_numbers(scenario.passive, scenario.plant.seed),
        scenario.passive.schedule(scenario.rate_hz).latency,
        _passive_made(scenario, samples),
        _frames(scenario, samples),
        scenario.camera.deviation,
    )


def _lost(scenario: Scenario, plant: PlantSettings) -> BoolArray:
    """Return which samples' commands are lost, for a sample longer than any run of the scenario."""
    lost = np.zeros(round(sum(scenario.durations()) * scenario.rate_hz) + 2, dtype=np.bool_)
    numbers = [one for one in lost_commands(plant.bus, plant.seed, scenario.rate_hz) if one < len(lost)]
    lost[numbers] = True
    return lost


def _unchanged_by(plant: PlantSettings) -> PlantSettings:
    """Return settings that leave the parameters of a robot as they are: it is the actual one already."""
    links = with_modelled_geometry(plant.links)
    return plant._replace(mass_scale=1.0, inertia_scale=1.0, friction_scale=1.0, links=links)
