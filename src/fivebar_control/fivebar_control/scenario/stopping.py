# SPDX-License-Identifier: Apache-2.0
"""How long a torque is held in a run where something is late or missing, before the robot is stopped."""

from __future__ import annotations

import functools
import math

from fivebar_control.planning.ride_through import longest_hold
from fivebar_control.scenario.guard_settings import guard_settings
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_control.scenario.scenario import ControlScenario

_held = functools.lru_cache(maxsize=16)(longest_hold)

LEAST_STOP_CYCLES = 3
"""Bridge, blender and drives notice what is missing one after the other, so that the one reports it that knows what."""


def stop_cycles(scenario: ControlScenario) -> int:
    """Return for how many cycles the last torque is held at most in real time, when something is late or missing.

    Raises:
        InputError: the motion is refused, or the time follows from a law whose module was not imported.
    """
    if scenario.safety.stop_cycles is not None:
        return scenario.safety.stop_cycles
    held_ms = scenario.safety.stop_time_ms
    if held_ms is None:
        limit = guard_settings(scenario).torque_limit
        held_ms = _held(scenario.five_bar(), scenario.plan(), tuned_controller(scenario), limit).time * 1e3
    # a period that does not divide the time must not lose a cycle to rounding
    return max(LEAST_STOP_CYCLES, math.floor(held_ms * scenario.rate_hz / 1e3 + 1e-9))


def stops_by_its_law(scenario: ControlScenario) -> bool:
    """Return whether no setting says for how many cycles a torque is held, so that the motion and its law decide."""
    return scenario.safety.stop_cycles is None and scenario.safety.stop_time_ms is None


def brake_limit(scenario: ControlScenario) -> float:
    """Return for how long (s) the brake's torque is followed: until its last cycle, and the answer to that one.

    Raises:
        InputError: as `stop_cycles`.
    """
    return scenario.safety.brake_duration + stop_cycles(scenario) / scenario.rate_hz if scenario.safety.brake else 0.0
