# SPDX-License-Identifier: Apache-2.0
"""Robots, their Pinocchio models and sets of random postures for the unit tests."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import settings
from numpy.typing import NDArray
from scipy.optimize import brentq

from fivebar_control.model.geometry import reach_margin
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.model.state import State, WorkingMode
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import load_robot

settings.register_profile("unit", derandomize=True, deadline=None, database=None, max_examples=200)
settings.load_profile("unit")

WORKING_MODES = ((1, 1), (1, -1), (-1, 1), (-1, -1))

Vector = NDArray[np.float64]


class Postures:
    """Random reachable states of one robot, in all four working modes in turn, moving at up to 1 m/s."""

    def __init__(self, robot: FiveBar) -> None:
        self.robot = robot

    def regular(self, count: int, seed: int) -> list[State]:
        """States at least 5 mm from Type 1 and with |det A| of at least 0.05."""
        random = np.random.default_rng(seed)
        states: list[State] = []
        while len(states) < count:
            mode = WORKING_MODES[len(states) % 4]
            x, y = self._place(random)
            state = state_from_platform(self.robot, mode, x, y, *random.uniform(-0.7, 0.7, 2).tolist())
            if self._clear(x, y) and abs(det_a(state)) > 0.05:
                states.append(state)
        return states

    def on_locus(self, count: int, seed: int) -> list[State]:
        """States on the Type 2 locus, to rounding, at least 5 mm from Type 1."""
        random = np.random.default_rng(seed)
        states: list[State] = []
        while len(states) < count:
            state = self._crossing(WORKING_MODES[len(states) % 4], random)
            if state is not None:
                states.append(state)
        return states

    def _place(self, random: np.random.Generator) -> tuple[float, float]:
        return float(random.uniform(-0.2, 0.2)), float(random.uniform(-0.2, 0.2))

    def _clear(self, x: float, y: float) -> bool:
        return min(reach_margin(self.robot.leg1, x, y), reach_margin(self.robot.leg2, x, y)) > 0.005

    def _crossing(self, mode: WorkingMode, random: np.random.Generator) -> State | None:
        """Look for a change of sign of det A on a random line."""
        (x0, y0), (x1, y1) = self._place(random), self._place(random)

        def at(s: float) -> tuple[float, float]:
            return x0 + (x1 - x0) * s, y0 + (y1 - y0) * s

        def determinant(s: float) -> float:
            return det_a(state_from_platform(self.robot, mode, *at(s), 0.0, 0.0))

        for low, high in pairwise(np.linspace(0.0, 1.0, 40).tolist()):
            if self._clear(*at(low)) and self._clear(*at(high)) and determinant(low) * determinant(high) < 0.0:
                s = float(brentq(determinant, low, high, xtol=1e-17, rtol=1e-15))
                velocity = random.uniform(-0.7, 0.7, 2).tolist()
                state = state_from_platform(self.robot, mode, *at(s), *velocity)
                return state if abs(det_a(state)) < 1e-13 else None
        return None


def _joint_vectors(state: State) -> tuple[Vector, Vector]:
    leg1, leg2 = state.leg1, state.leg2
    return (
        np.array([leg1.q1, leg1.q2, leg2.q1, leg2.q2]),
        np.array([leg1.dq1, leg1.dtheta - leg1.dq1, leg2.dq1, leg2.dtheta - leg2.dq1]),
    )


def _matrices(state: State) -> tuple[Vector, Vector]:
    """A from the angles, B from the lever of each motor; not from the fields that the code under test computes."""
    theta1, theta2 = state.leg1.q1 + state.leg1.q2, state.leg2.q1 + state.leg2.q2
    a = np.array([[math.cos(theta1), math.sin(theta1)], [math.cos(theta2), math.sin(theta2)]])
    return a, np.diag([state.leg1.b, state.leg2.b])


@pytest.fixture(scope="session", params=["dextar", "unequal"])
def robot(request: pytest.FixtureRequest) -> FiveBar:
    """Both robots in turn."""
    return load_robot(request.param)


@pytest.fixture(scope="session")
def dextar() -> FiveBar:
    """The robot of the thesis."""
    return load_robot("dextar")


@pytest.fixture(scope="session")
def loop(robot: FiveBar) -> ClosedLoop:
    """Pinocchio's model of the robot."""
    return ClosedLoop(robot)


@pytest.fixture(scope="session")
def regular_states(robot: FiveBar) -> Callable[[int, int], list[State]]:
    """Gives `count` random states for a seed, away from every singularity."""
    return Postures(robot).regular


@pytest.fixture(scope="session")
def locus_states(robot: FiveBar) -> Callable[[int, int], list[State]]:
    """Gives `count` random states for a seed, on the Type 2 locus."""
    return Postures(robot).on_locus


@pytest.fixture(scope="session")
def joint_vectors() -> Callable[[State], tuple[Vector, Vector]]:
    """Gives q and v, each (q11, q12, q21, q22), of a state."""
    return _joint_vectors


@pytest.fixture(scope="session")
def matrices() -> Callable[[State], tuple[Vector, Vector]]:
    """Gives the matrices A and B of a state as arrays."""
    return _matrices
