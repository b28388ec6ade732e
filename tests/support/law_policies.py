# SPDX-License-Identifier: Apache-2.0
"""Laws as policies that see all joints of DexTAR, and policies that fail."""

from __future__ import annotations

import math
from typing import Any

from fivebar_bringup.simulation.case import FloatArray
from fivebar_control.laws.ctc import CtcSettings, ctc_torque
from fivebar_control.laws.reference import Reference, reference_from_platform
from fivebar_control.laws.robot_sizes import ROBUST_WEIGHT
from fivebar_control.laws.torque import Torque
from fivebar_control.laws.unified import INITIAL_MEMORY, UnifiedSettings, unified_step
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.model.state import Platform, State
from fivebar_description.robot_file import load_robot

ROBOT = load_robot("dextar")


def understood(observation: FloatArray) -> tuple[State, Reference]:
    """Return state and reference of an observation."""
    values = observation.tolist()
    modes = int(values[17]), int(values[18])
    return state_from_joints(ROBOT, *values[:8]), reference_from_platform(ROBOT, modes, Platform(*values[8:14]))


class Unified:
    """The law `unified`, with its observer of disturbances."""

    def __init__(self) -> None:
        self.memory = INITIAL_MEMORY
        self.settings = UnifiedSettings(weight=ROBUST_WEIGHT, torque_limit=2.0)

    def __call__(self, observation: FloatArray) -> Torque:
        torque, self.memory = unified_step(ROBOT, *understood(observation), self.memory, self.settings, 2e-3)
        return torque


def ctc(observation: FloatArray) -> Torque:
    """Return the torque of computed torque control."""
    return ctc_torque(ROBOT, *understood(observation), *CtcSettings())


def silent(observation: FloatArray) -> None:
    """Return nothing."""


def undefined(observation: FloatArray) -> tuple[float, float]:
    """Return a torque that is not a number once the reference moves."""
    return (0.0 if observation[10] == 0.0 else math.nan), 0.0


def raising(observation: FloatArray) -> Any:
    """Raise an exception at the first sample."""
    return [][len(observation)]


def raising_later(observation: FloatArray) -> Any:
    """Raise one once the reference moves."""
    return (0.0, 0.0) if observation[10] == 0.0 else raising(observation)


def three(observation: FloatArray) -> list[float]:
    """Return one torque too many."""
    return [0.0, 0.0, 0.0]


def words(observation: FloatArray) -> str:
    """Return no torques."""
    return "left"


class Unmade:
    """A policy that cannot be made."""

    def __init__(self, weights: str) -> None:
        self.weights = weights


NUMBER = 3


def counting(observation: FloatArray) -> tuple[float, float]:
    """Return a thousandth of the number of observed values."""
    return 1e-3 * len(observation), 0.0
