# SPDX-License-Identifier: Apache-2.0
"""A robot at rest near the Type 2 locus: where it may be, which torque moves it off, and which way it falls."""

from __future__ import annotations

import math

import pytest

from fivebar_control.laws.torque import Torque
from fivebar_control.model.geometry import direct_geometry, elbow_position, inverse_geometry
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.model.state import State
from fivebar_control.planning.predicted_run import advanced
from fivebar_control.planning.standstill import Standstill, mode_by_turn, standstill_at, way_out
from fivebar_description.parameters import FiveBar
from fivebar_description.tolerances import EXACT, Tolerances

LOCUS_Y = math.sqrt(0.0081 - 0.000961)


def standing(robot: FiveBar, state: State, tolerances: Tolerances = EXACT) -> Standstill:
    found = standstill_at(robot, tolerances, state.leg1.q1, state.leg2.q1)
    assert found is not None
    return found


def test_away_from_the_locus_both_assembly_modes_are_named(dextar: FiveBar) -> None:
    state = state_from_platform(dextar, (1, -1), 0.02, 0.12, 0.0, 0.0)
    stand = standing(dextar, state)
    here, there = (stand.plus, stand.minus) if det_a(state) > 0.0 else (stand.minus, stand.plus)
    assert here == pytest.approx((0.02, 0.12), abs=1e-12)
    assert math.dist(here, there) == pytest.approx(2.0 * stand.side, rel=1e-12)
    assert not stand.near
    # on the side of + by the normal
    middle = [0.5 * (a + b) for a, b in zip(here, there, strict=True)]
    assert (stand.plus[0] - middle[0]) * stand.normal_x + (stand.plus[1] - middle[1]) * stand.normal_y > 0.0


def test_the_gap_varies_as_the_tolerances_let_the_elbows_vary(dextar: FiveBar) -> None:
    """Against difference quotients: one tolerance after the other, each uniform."""
    angles = inverse_geometry(dextar, (1, -1), 0.01, 0.09)
    step = 1e-6

    def gap(robot: FiveBar, q11: float, q21: float) -> float:
        return (
            robot.leg1.distal
            + robot.leg2.distal
            - math.dist(elbow_position(robot.leg1, q11), elbow_position(robot.leg2, q21))
        )

    at = gap(dextar, angles.q11, angles.q21)
    by_zero = [(gap(dextar, angles.q11 + one, angles.q21 + two) - at) / step for one, two in ((step, 0.0), (0.0, step))]
    by_length = [
        (gap(dextar._replace(**{leg: getattr(dextar, leg)._replace(**{link: 0.09 + step})}), *angles[::2]) - at) / step
        for leg in ("leg1", "leg2")
        for link in ("proximal", "distal")
    ]
    found = standstill_at(dextar, Tolerances(zero=1e-3), angles.q11, angles.q21)
    assert found is not None
    assert found.gap == pytest.approx(at, rel=1e-9)
    assert found.gap_deviation == pytest.approx(1e-3 / math.sqrt(3.0) * math.hypot(*by_zero), rel=1e-4)
    found = standstill_at(dextar, Tolerances(length=1e-4), angles.q11, angles.q21)
    assert found is not None
    assert found.gap_deviation == pytest.approx(1e-4 / math.sqrt(3.0) * math.hypot(*by_length), rel=1e-4)


@pytest.mark.parametrize("offset", [3e-4, -3e-4])
def test_the_torque_makes_it_fall_to_its_side_and_the_gyroscope_tells_which(dextar: FiveBar, offset: float) -> None:
    """Just beside the locus the model knows the side; half a second of the torque moves it out of the way."""
    state = state_from_platform(dextar, (1, -1), 0.0, LOCUS_Y + offset, 0.0, 0.0)
    side = det_a(state)
    stand = standing(dextar, state, Tolerances(length=1e-4))
    assert stand.near
    assert stand.stretched
    assert any(f"{stand.tau1:+.3f} Nm" in sentence for sentence in way_out(stand))
    torque = Torque(stand.tau1, stand.tau2)
    while abs(state.y - LOCUS_Y) < 5e-3:
        state = advanced(dextar, (1, -1), state, torque, 1e-3, 1)
        assert abs(state.leg1.dq1) < 10.0
    assert det_a(state) * side > 0.0
    assert mode_by_turn(stand, state.leg2.dtheta, 0.03) == (1 if side > 0.0 else -1)
    assert mode_by_turn(stand, 0.02, 0.03) == 0


def test_elbows_too_far_apart_put_it_on_the_locus(dextar: FiveBar) -> None:
    state = state_from_platform(dextar, (1, -1), 0.0, LOCUS_Y, 0.0, 0.0)
    found = standstill_at(dextar, EXACT, state.leg1.q1 + 0.01, state.leg2.q1 - 0.01)
    assert found is not None
    assert found.gap < 0.0
    assert found.side == 0.0
    assert found.near
    assert all(math.isnan(one) for one in direct_geometry(dextar, 1, state.leg1.q1 + 0.01, state.leg2.q1 - 0.01))
