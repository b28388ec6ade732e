# SPDX-License-Identifier: Apache-2.0
"""Results that the nodes of one process share: what several of them work out for a sample is worked out once."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from operator import is_
from typing import Any, Generic, TypeVar

from fivebar_control.laws.reference import Reference
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.model.state import Platform, State
from fivebar_control.trajectory.desired import desired_at
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar

Values = tuple[float, ...]
R = TypeVar("R")


class SharedResult(Generic[R]):
    """The last result of a pure function, for nodes that ask for the same one after the other.

    Objects are the same only if they are one object, since equal numbers may differ in the sign of zero. The nodes of a
    process get the values of a message as one object (`JointSample.read`), and have one robot (`one_robot`) and
    plan; a node that is alone in its process works everything out itself.
    """

    def __init__(self, function: Callable[..., R]) -> None:
        """Make one for a function of a number and of objects."""
        self._function = function
        self._number = -1.0
        self._objects: tuple[Any, ...] = ()
        self._result: R

    def __call__(self, number: float, *objects: Any) -> R:
        """Return the function's result for a sample, by its number or time, and objects; their count never changes."""
        if number != self._number or not self._objects or not all(map(is_, objects, self._objects)):
            self._result = self._function(number, *objects)
            # the objects are kept: no other one can take the place of one of them in memory
            self._number, self._objects = number, objects
        return self._result


def _state(sample: float, robot: FiveBar, position: Values, velocity: Values) -> State:
    q11, q12, q21, q22 = position
    return state_from_joints(robot, q11, q12, q21, q22, *velocity)


def _desired(t: float, robot: FiveBar, plan: Plan, position: Values, velocity: Values) -> Reference:
    x, y, vx, vy = position
    _, _, ax, ay = velocity
    return desired_at(robot, plan, t, Platform(x, y, vx, vy, ax, ay))


shared_state = SharedResult(_state)
"""The measured or estimated state: of a sample's number, robot, joint angles and rates, as `joint_states` has them."""

shared_desired = SharedResult(_desired)
"""The desired instant: of its time (s), robot, plan, and `position` and `velocity` of `reference`."""


@lru_cache(maxsize=8)
def one_robot(robot: FiveBar) -> FiveBar:
    """Return the one object that the nodes of this process have for a robot."""
    return robot
