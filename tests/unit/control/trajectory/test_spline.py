# SPDX-License-Identifier: Apache-2.0
"""Splines through points at given times: what is given is kept, and what is not is smooth."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from fivebar_control.model.kinematics import assembly_mode, state_from_platform
from fivebar_control.trajectory.path import Path
from fivebar_control.trajectory.spline import SplineSegment, completed
from fivebar_control.trajectory.time_scaling import rest_to_rest
from fivebar_description.parameters import FiveBar

REST = (0.0, 0.0)
TIMES = [0.0, 0.3, 0.5, 1.1, 1.15, 2.0]
PLACES = [(0.1, -0.3), (0.5, 0.2), (0.4, 0.3), (-0.7, 0.1), (-0.75, 0.05), (0.2, 0.6)]


def test_alternative_courses_alone_give_the_spline_of_fifth_degree_between_rests(dextar: FiveBar) -> None:
    open_ends = [REST, *[None] * 4, REST]
    segment = SplineSegment(completed(TIMES, PLACES, open_ends, open_ends), dextar, 0, start_time=1.0)
    ends = [(1, np.zeros(2)), (2, np.zeros(2))]
    wanted = make_interp_spline(TIMES, np.array(PLACES), 5, bc_type=(ends, ends))
    for t in np.linspace(0.0, 1.999, 101):
        found = np.reshape(segment.at(1.0 + t), (3, 2))
        np.testing.assert_allclose(found, [wanted(t), wanted(t, 1), wanted(t, 2)], atol=1e-11)
    assert segment.at(0.5) == (*PLACES[0], 0.0, 0.0, 0.0, 0.0)
    assert Path([segment]).at(9.0) == (*PLACES[-1], 0.0, 0.0, 0.0, 0.0)


def test_two_points_give_the_polynomial_of_all_motions(dextar: FiveBar) -> None:
    segment = SplineSegment(completed([0.0, 0.5], [REST, (1.0, 2.0)], [REST] * 2, [REST] * 2), dextar, 0)
    s, ds, dds = rest_to_rest(0.3)
    assert segment.at(0.15) == pytest.approx((s, 2 * s, 2 * ds, 4 * ds, 4 * dds, 8 * dds), rel=1e-12)


def test_given_speeds_are_kept_and_the_jerk_does_not_step(dextar: FiveBar) -> None:
    rates = [REST, (1.0, 2.0), (-0.5, 0.3), (0.1, -0.2), (0.7, 0.7), REST]
    knots = completed(TIMES, PLACES, rates, [REST, *[None] * 4, REST])
    assert [knot[3:5] for knot in knots] == rates
    segment = SplineSegment(knots, dextar, 0)
    step = 1e-8
    for knot in knots[1:-1]:
        before, at, after = (np.array(segment.at(knot.time + shift))[4:] for shift in (-step, 0.0, step))
        np.testing.assert_allclose((after - at) / step, (at - before) / step, rtol=1e-2, atol=1.0)


def test_the_platform_moves_as_the_motors_do(dextar: FiveBar) -> None:
    begin = state_from_platform(dextar, (1, -1), 0.0, 0.15, 0.0, 0.0)
    here = (begin.leg1.q1, begin.leg2.q1)
    knots = completed([0.0, 0.4], [here, (here[0] + 0.2, here[1] - 0.1)], [REST] * 2, [REST] * 2)
    segment = SplineSegment(knots, dextar, assembly_mode(begin))
    assert segment.at(0.0)[:2] == pytest.approx((0.0, 0.15), abs=1e-12)
    step = 1e-5
    for before, after in pairwise([segment.at(t) for t in (0.2 - step, 0.2 + step)]):
        middle = segment.at(0.2)
        change = (np.array(after) - np.array(before)) / (2.0 * step)
        np.testing.assert_allclose(change[:4], middle[2:], rtol=1e-6, atol=1e-6)
        assert abs(middle.vx) > 0.01
