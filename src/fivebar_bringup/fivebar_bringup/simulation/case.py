# SPDX-License-Identifier: Apache-2.0
"""One crossing as numbers, the input of the compiled loop."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.engine_sensors import EngineSensors, engine_sensors
from fivebar_control.controller.estimator import estimator_model_of
from fivebar_control.controller.settings import cycle_settings
from fivebar_control.estimation.constants import EstimatorModel
from fivebar_control.laws.registry import Controller
from fivebar_control.loop.cycle import CycleSettings
from fivebar_control.loop.sampled_plan import Sampled
from fivebar_description.extra_sensor import ExtraSensor
from fivebar_description.parameters import FiveBar, with_floats
from fivebar_description.settings import as_numbers
from fivebar_description.strict_yaml import InputError
from fivebar_sim.effects.links import with_modelled_geometry
from fivebar_sim.effects.mechanism import actual_robot, mechanism_of, steps_of_period
from fivebar_sim.effects.settings import MUJOCO, PlantSettings, has_effects, without_effects
from fivebar_sim.effects.timing import lost_commands

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


class Estimation(NamedTuple):
    """The estimator.

    Attributes:
        feed_forward: whether the laws compensate its disturbances.
        model: its constants.
        sensors: whose readings come late.
    """

    feed_forward: bool
    model: EstimatorModel
    sensors: EngineSensors


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
    """One crossing.

    Attributes:
        controller: of it.
        numbers: its constants.
        extra: a sensor from another package, None for none.
    """

    controller: Controller
    numbers: Numbers
    extra: ExtraSensor | None = None


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
        estimation=_estimation(scenario, nominal) if scenario.estimated else None,
        stop_at_fault=stop_at_fault,
    )
    mounted = scenario.extra() if scenario.estimated else None
    return Case(scenario.scheme(), numbers, None if mounted is None else mounted.kind)


def _estimation(scenario: Scenario, robot: FiveBar) -> Estimation:
    """Return the estimator of a scenario, for its robot with other types of number."""
    samples = scenario.plan().path.samples(scenario.rate_hz) + 1 if scenario.reads_late else 0
    return Estimation(
        scenario.compensates_disturbance, estimator_model_of(scenario, robot), engine_sensors(scenario, samples)
    )


def _lost(scenario: Scenario, plant: PlantSettings) -> BoolArray:
    """Return which samples' commands are lost, for a sample longer than any run of the scenario."""
    lost = np.zeros(round(sum(scenario.durations()) * scenario.rate_hz) + 2, dtype=np.bool_)
    numbers = [command for command in lost_commands(plant.bus, plant.seed, scenario.rate_hz) if command < len(lost)]
    lost[numbers] = True
    return lost


def _unchanged_by(plant: PlantSettings) -> PlantSettings:
    """Return settings that leave the parameters of a robot as they are: it is the actual one already."""
    links = with_modelled_geometry(plant.links)
    return plant._replace(mass_scale=1.0, inertia_scale=1.0, friction_scale=1.0, links=links)
