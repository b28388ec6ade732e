"""The guard: when it commands zero torque, what it says, and that it stays so until reset."""

from __future__ import annotations

import math

import pytest

from fivebar_control.controllers.guard import Guard
from fivebar_control.controllers.torque import UNDEFINED, ZERO, Torque

AWAY, ON_LOCUS = Torque(1.0, 2.0), Torque(-1.0, 4.0)


def test_without_a_fault_it_is_the_blend() -> None:
    guard = Guard(0.05)
    assert guard.command(0, 0.0, 0.0, AWAY, UNDEFINED) == AWAY
    assert guard.command(1, 0.05, 1.0, UNDEFINED, ON_LOCUS) == ON_LOCUS
    assert guard.command(2, 0.01, 0.5, AWAY, ON_LOCUS) == (0.0, 3.0)
    assert guard.fault is None


@pytest.mark.parametrize(
    ("sigma", "away", "on_locus"),
    [
        (0.0, UNDEFINED, ON_LOCUS),
        (1.0, AWAY, UNDEFINED),
        (0.3, AWAY, UNDEFINED),
        (0.3, UNDEFINED, ON_LOCUS),
        (0.0, Torque(1.0, math.inf), ON_LOCUS),
        (0.5, Torque(-math.inf, 1.0), ON_LOCUS),
        (0.0, Torque(1.0, math.nan), ON_LOCUS),
        (math.nan, AWAY, ON_LOCUS),
    ],
)
def test_an_undefined_torque_with_weight_is_a_fault(sigma: float, away: Torque, on_locus: Torque) -> None:
    guard = Guard(0.05)
    assert guard.command(7, 0.0, sigma, away, on_locus) == ZERO
    assert guard.fault is not None
    assert guard.fault.name == "torque_undefined"
    assert "at sample 7" in str(guard.fault)
    assert str(guard.fault).startswith("torque_undefined: ")


@pytest.mark.parametrize("error", [0.0501, 1.0, math.inf, math.nan])
def test_a_platform_far_from_its_reference_is_a_fault(error: float) -> None:
    guard = Guard(0.05)
    assert guard.command(12, error, 0.0, AWAY, ON_LOCUS) == ZERO
    assert guard.fault is not None
    assert guard.fault.name == "tracking_lost"
    assert "sample 12" in guard.fault.detail
    assert "limit 50.0 mm" in guard.fault.detail


def test_the_distance_is_told_in_millimetres() -> None:
    guard = Guard(0.05)
    guard.command(3, 0.0626, 0.0, AWAY, ON_LOCUS)
    assert str(guard.fault) == "tracking_lost: 62.6 mm from the reference at sample 3, limit 50.0 mm"


def test_a_fault_stays_until_reset_and_the_first_one_is_kept() -> None:
    guard = Guard(0.05)
    guard.command(1, 0.06, 0.0, AWAY, ON_LOCUS)
    first = guard.fault
    assert guard.command(2, 0.0, 0.0, AWAY, ON_LOCUS) == ZERO
    assert guard.command(3, 0.0, 0.0, UNDEFINED, ON_LOCUS) == ZERO
    guard.trip("input_stale", "something later")
    assert guard.fault is first
    guard.reset()
    assert guard.fault is None
    assert guard.command(4, 0.0, 0.0, AWAY, ON_LOCUS) == AWAY


def test_others_can_trip_it() -> None:
    guard = Guard(0.05)
    guard.trip("input_stale", "no reference for 0.1 s")
    assert str(guard.fault) == "input_stale: no reference for 0.1 s"
    assert guard.command(0, 0.0, 0.0, AWAY, ON_LOCUS) == ZERO
