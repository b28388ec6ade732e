# SPDX-License-Identifier: Apache-2.0
"""Policies: functions of an observation that return both torques, in place of a law.

A policy is named as MODULE:NAME. A function is called with every observation, float64[n] with the values that
`stepped_run.observed` names, and returns two torques (Nm). A class is made anew for each crossing, without arguments,
and its object is called instead: so a policy has a memory.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np

from fivebar_bringup.simulation.case import Case, FloatArray
from fivebar_bringup.simulation.observation import Observation
from fivebar_bringup.simulation.run_metrics import RunMetrics
from fivebar_bringup.simulation.stepped_run import SteppedRun, columns_observed
from fivebar_control.loop.sampled_plan import Sampled
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.errors import InputError, quoted
from fivebar_description.modules import PLACE, error_with_place, load_part

Policy = Callable[[FloatArray], FloatArray]


class PolicyFailed(RuntimeError):
    """A policy raised an exception, or did not return two numbers."""


def find_policy(place: str) -> Any:
    """Return the function or the class at a place, MODULE:NAME.

    Raises:
        InputError: it cannot be loaded or called.
    """
    if not PLACE.fullmatch(place):
        raise InputError(f"{place!r}: expected MODULE:NAME")
    loaded = load_part(place)
    if not callable(loaded):
        raise InputError(f"{place}: is of type {type(loaded).__name__}: expected a function, or a class")
    return loaded


def new_policy(place: str) -> Policy:
    """Return a policy before its first sample; it raises `PolicyFailed` where it does not answer.

    Raises:
        InputError: it cannot be loaded or called.
        PolicyFailed: its object cannot be made.
    """
    loaded = find_policy(place)
    policy = _tried(loaded) if isinstance(loaded, type) else loaded

    def answer(observation: FloatArray) -> FloatArray:
        returned = _tried(policy, observation)
        with suppress(TypeError, ValueError):
            torques = np.asarray(returned, dtype=np.float64)
            if torques.shape == (2,):
                return torques
        raise PolicyFailed(f"returned {quoted(returned)}: expected two torques (Nm)")

    return answer


def _tried(function: Callable[..., Any], *arguments: FloatArray) -> Any:
    try:
        return function(*arguments)
    except Exception as error:
        raise PolicyFailed(error_with_place(error)) from error


def check_policy(place: str, case: Case, plan: Sampled, observation: Observation) -> None:
    """Check that a policy answers the first sample of a run.

    Raises:
        InputError: it cannot be loaded, or does not.
    """
    try:
        new_policy(place)(SteppedRun(case, plan, compiled=False).seen[columns_observed(observation)])
    except PolicyFailed as error:
        raise InputError(f"{place}: {error}") from error


def run_policy(place: str, case: Case, plan: Sampled, observation: Observation) -> RunMetrics:
    """Run a case by a new policy. Once the guard has stopped the robot, the policy is not asked any more.

    Raises:
        PolicyFailed: it does not answer a sample.
    """
    run, columns, policy = SteppedRun(case, plan), columns_observed(observation), new_policy(place)
    while not run.finished:
        if run.fault == NO_FAULT:
            run.torque[:] = policy(run.seen[columns])
        run.step()
    return run.outcome()
