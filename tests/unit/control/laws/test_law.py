# SPDX-License-Identifier: Apache-2.0
"""What a law declares of its settings, and what follows for one that declares nothing."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import pytest

from fivebar_control.laws.gains import UnifiedSettings
from fivebar_control.laws.law import Feedback, Law, TunedLaw
from fivebar_control.laws.registry import CONTROLLERS, default_tuning


class Named(NamedTuple):
    """Settings that call limits and gains as they are called by default."""

    kp: float = 900.0
    torque_limit: float | None = None
    torque_rate_limit: float | None = None


class Other(NamedTuple):
    """Settings with other names."""

    stiffness: float = 400.0
    most: float | None = None


class Bare(NamedTuple):
    """Settings without any of it."""

    factor: float = 1.0


def law(settings: Any, **declared: Any) -> TunedLaw:
    return TunedLaw(Law("own", "own law", type(settings), CONTROLLERS["ctc"].nominal.step, **declared), settings)


def test_open_limits_are_those_of_the_drives_and_the_last_node() -> None:
    assert law(Named()).within(2.0, 50.0).settings == Named(torque_limit=2.0, torque_rate_limit=50.0)
    assert law(Named()).within(None, math.inf).settings == Named()
    own = Named(torque_limit=1.0, torque_rate_limit=9.0)
    assert law(own).within(2.0, 50.0).settings == own
    assert law(Other(), torque_limit="most").within(2.0, 50.0).settings == Other(most=2.0)
    assert law(Bare()).within(2.0, 50.0).settings == Bare()


def test_a_limit_is_lowered_and_taken_away() -> None:
    assert law(Named()).limited_to(1.5).settings == Named(torque_limit=1.5)
    assert law(Named(torque_limit=1.0)).limited_to(1.5).settings == Named(torque_limit=1.0)
    assert law(Named(torque_limit=1.0)).limited_to(math.inf).settings == Named(torque_limit=1.0)
    assert law(Other(most=1.0), torque_limit="most").unlimited().settings == Other()
    assert law(Bare()).limited_to(1.5).unlimited().settings == Bare()


def test_the_feedback_is_declared_or_read_by_its_names() -> None:
    assert law(Named()).feedback == Feedback(kp=900.0)
    assert law(Bare()).feedback == Feedback(UnifiedSettings().kp, UnifiedSettings().kd)
    assert law(Other(), feedback=lambda settings: Feedback(settings.stiffness)).feedback.kp == 400.0


@pytest.mark.parametrize(("name", "observer_rate"), [("mpc", 40.0), ("lqr", 0.0)])
def test_a_law_with_a_cost_over_time_is_judged_by_its_fallback(name: str, observer_rate: float) -> None:
    tuned = default_tuning(CONTROLLERS[name]).nominal
    settings: Any = tuned.settings
    assert tuned.feedback == (settings.fallback_kp, settings.fallback_kd, settings.fallback_weight, observer_rate)
