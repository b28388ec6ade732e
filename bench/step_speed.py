# SPDX-License-Identifier: Apache-2.0
"""The speed of controller and plant as objects, beside MuJoCo's steps of the same period."""

from __future__ import annotations

import statistics
from time import perf_counter
from typing import Any, NamedTuple

import mujoco

import fivebar
from fivebar_bringup.motions.model_file import model_text
from fivebar_bringup.motions.model_format import ModelFormat


class StepSpeed(NamedTuple):
    """Medians over the samples of a run (us).

    Attributes:
        samples: of the run.
        controller, plant: of a step of each.
    """

    samples: int
    controller: float
    plant: float


def step_speed(scenario: str, compiled: bool) -> StepSpeed:
    """Return the speed of a scenario's loop; nothing else runs between the steps."""
    control, plant = fivebar.Controller(scenario, compiled=compiled), fivebar.Plant(scenario)
    readings = plant.reset()
    answered, moved = [], []
    while not control.finished:
        began = perf_counter()
        command = control.step(readings)
        between = perf_counter()
        readings = plant.step(command.torque)
        answered.append(between - began)
        moved.append(perf_counter() - between)
    return StepSpeed(len(answered), statistics.median(answered) * 1e6, statistics.median(moved) * 1e6)


def mujoco_us(robot: str, period: float, periods: int) -> float:
    """Return the median time (us) that MuJoCo takes for a period (s) of the model that `fivebar model` writes."""
    model: Any = mujoco.MjModel.from_xml_string(model_text(ModelFormat.MJCF, robot))
    data: Any = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    steps, taken = round(period / model.opt.timestep), []
    for _ in range(periods):
        began = perf_counter()
        mujoco.mj_step(model, data, steps)
        taken.append(perf_counter() - began)
    return statistics.median(taken) * 1e6
