"""What the filter's sensors measure, as it linearises it, against differences of the robot's geometry."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from fivebar_control.estimation import covariance as cov
from fivebar_control.estimation.ekf import Belief, EkfSettings, Estimate, considered_errors, filter_model
from fivebar_control.estimation.measurements import elbow_row, encoder_row, homed_belief, turned
from fivebar_control.estimation.platform_motion import leg_motion
from fivebar_control.model.geometry import direct_geometry, inverse_geometry, wrap
from fivebar_control.model.kinematics import det_a
from fivebar_control.model.state import State
from fivebar_description.parameters import FiveBar
from fivebar_description.tolerances import Tolerances

States = Callable[[int, int], list[State]]
Vector = NDArray[np.float64]

RATE_HZ = 500

LAG, SLOPE = -0.0005, 30.0
"""Of a gyroscope's reading: s from its sample to its stamp, and rad/s^2."""

ESTIMATED = [*range(cov.CONSIDERED), cov.CLOCK, cov.PASSIVE, cov.FX, cov.FY]
CONSTANT = slice(cov.CONSIDERED, cov.CONSIDERED_END)
FIELDS = {
    cov.L11: ("leg1", "proximal"),
    cov.L12: ("leg1", "distal"),
    cov.L21: ("leg2", "proximal"),
    cov.L22: ("leg2", "distal"),
    cov.BASE1: ("leg1", "base_x"),
    cov.BASE2: ("leg2", "base_x"),
}


def modes_of(state: State) -> tuple[int, int]:
    return (-1 if state.leg1.sin_q2 > 0.0 else 1), (-1 if state.leg2.sin_q2 > 0.0 else 1)


def erring(robot: FiveBar, error: int, size: float) -> FiveBar:
    """Return the robot with one of its considered geometric errors."""
    if error not in FIELDS:
        return robot
    leg, field = FIELDS[error]
    parameters = getattr(robot, leg)
    changed = parameters._replace(**{field: getattr(parameters, field) + size})
    return robot._replace(leg1=changed) if leg == "leg1" else robot._replace(leg2=changed)


def readings(robot: FiveBar, modes: tuple[int, int], x: float, y: float, error: int, size: float) -> Vector:
    """Return what both encoders read with the platform at (x, y) m on a robot with an error."""
    q = inverse_geometry(erring(robot, error, size), *modes, x, y)
    return np.array([q.q11 + size * (error == cov.ZERO1), q.q21 + size * (error == cov.ZERO2)])


@pytest.mark.parametrize("where", ["regular_states", "locus_states"])
def test_encoder_rows_are_the_derivatives_of_the_readings(
    robot: FiveBar, where: str, request: pytest.FixtureRequest
) -> None:
    states: States = request.getfixturevalue(where)
    step, sides = 1e-7, set()
    for state in states(40, 7):
        modes = modes_of(state)
        sides.add(det_a(state) > 0.0)
        expected = np.zeros((2, cov.SIZE))
        for column, (dx, dy) in ((cov.X, (step, 0.0)), (cov.Y, (0.0, step))):
            ahead = readings(robot, modes, state.x + dx, state.y + dy, cov.SCALE, 0.0)
            behind = readings(robot, modes, state.x - dx, state.y - dy, cov.SCALE, 0.0)
            expected[:, column] = [wrap(float(one)) / (2.0 * step) for one in ahead - behind]
        for error in (*FIELDS, cov.ZERO1, cov.ZERO2):
            ahead = readings(robot, modes, state.x, state.y, error, step)
            behind = readings(robot, modes, state.x, state.y, error, -step)
            expected[:, error] = [wrap(float(one)) / (2.0 * step) for one in ahead - behind]
        legs = (robot.leg1, modes[0]), (robot.leg2, modes[1])
        for number, (leg, mode) in enumerate(legs, start=1):
            row = encoder_row(number, leg_motion(leg, mode, state.x, state.y, 0.0, 0.0))
            scale = 1.0 + float(np.abs(expected[number - 1]).max())
            np.testing.assert_allclose(row, expected[number - 1], rtol=1e-4, atol=1e-6 * scale)
    assert where == "locus_states" or sides == {True, False}


@pytest.mark.parametrize("where", ["regular_states", "locus_states"])
def test_rows_of_passive_joints_are_the_derivatives_of_their_angles(
    robot: FiveBar, where: str, request: pytest.FixtureRequest
) -> None:
    states: States = request.getfixturevalue(where)
    step = 1e-7

    def passive(modes: tuple[int, int], x: float, y: float, error: int, size: float) -> Vector:
        q = inverse_geometry(erring(robot, error, size), *modes, x, y)
        return np.array([q.q12, q.q22])

    for state in states(40, 9):
        modes, place = modes_of(state), (state.x, state.y)
        expected = np.zeros((2, cov.SIZE))
        expected[:, cov.PASSIVE] = 1.0
        for column, (dx, dy) in ((cov.X, (step, 0.0)), (cov.Y, (0.0, step))):
            change = passive(modes, place[0] + dx, place[1] + dy, cov.SCALE, 0.0)
            change -= passive(modes, place[0] - dx, place[1] - dy, cov.SCALE, 0.0)
            expected[:, column] = [wrap(float(one)) / (2.0 * step) for one in change]
        for error in FIELDS:
            change = passive(modes, *place, error, step) - passive(modes, *place, error, -step)
            expected[:, error] = [wrap(float(one)) / (2.0 * step) for one in change]
        for number, (leg, mode) in enumerate(((robot.leg1, modes[0]), (robot.leg2, modes[1])), start=1):
            row = elbow_row(number, leg, leg_motion(leg, mode, *place, 0.0, 0.0))
            scale = 1.0 + float(np.abs(expected[number - 1]).max())
            np.testing.assert_allclose(row, expected[number - 1], rtol=1e-4, atol=1e-6 * scale)


def row_of_gyro(robot: FiveBar, modes: tuple[int, int], estimate: Estimate) -> Vector:
    """Return the row by which `turned` corrects, from its effect on a covariance that is the unit matrix."""
    model = filter_model(robot, *modes, RATE_HZ, EkfSettings(gyro_noise=1e-3))
    rate = leg_motion(robot.leg2, modes[1], *estimate[:4]).dtheta + estimate.bias + 1.0
    effect = turned(model, Belief(estimate, np.eye(cov.SIZE)), rate + SLOPE * LAG, LAG, SLOPE)
    # the innovation is 1, so that the misfit is the inverse of its variance
    variance, gain = 1.0 / effect.misfit, np.array(effect.belief.estimate) - np.array(estimate)
    row = np.zeros(cov.SIZE)
    row[ESTIMATED] = gain * variance
    row[CONSTANT] = -effect.belief.covariance[cov.BIAS, CONSTANT] / gain[cov.BIAS]
    assert variance == pytest.approx(float(row @ row) + 1e-6, rel=1e-9)
    return row


@pytest.mark.parametrize("where", ["regular_states", "locus_states"])
def test_the_row_of_the_gyroscope_is_the_derivative_of_the_links_rate(
    robot: FiveBar, where: str, request: pytest.FixtureRequest
) -> None:
    states: States = request.getfixturevalue(where)
    for state in states(40, 8):
        modes = modes_of(state)
        point, step = np.array([state.x, state.y, state.vx, state.vy]), 1e-6

        def rate(place: Vector, mode: int = modes[1]) -> float:
            return leg_motion(robot.leg2, mode, *place.tolist()).dtheta

        expected = np.zeros(cov.SIZE)
        for column in (cov.X, cov.Y, cov.VX, cov.VY):
            shift = np.zeros(4)
            shift[column] = step
            expected[column] = (rate(point + shift) - rate(point - shift)) / (2.0 * step)
        expected[cov.BIAS], expected[cov.SCALE], expected[cov.CLOCK] = 1.0, rate(point), -SLOPE
        found = row_of_gyro(robot, modes, Estimate(*point.tolist(), 0.1, -0.1, 0.02))
        scale = 1.0 + float(np.abs(expected).max())
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6 * scale)
        assert (found[cov.D1], found[cov.D2]) == (0.0, 0.0)


def test_a_gyroscope_that_reads_as_expected_changes_no_estimate_and_makes_it_surer(dextar: FiveBar) -> None:
    model = filter_model(dextar, 1, -1, RATE_HZ, EkfSettings())
    before = Belief(Estimate(0.01, 0.12, 0.2, -0.3, 0.1, -0.1, 0.02), homed_belief(model, 0.01, 0.12, 1e-8).covariance)
    rate = leg_motion(dextar.leg2, -1, *before.estimate[:4]).dtheta + 0.02
    after = turned(model, before, rate, 0.0, 20.0)
    assert after.belief.estimate == pytest.approx(before.estimate, abs=1e-15)
    assert after.misfit == pytest.approx(0.0, abs=1e-20)
    for state in (cov.VX, cov.VY, cov.BIAS):
        assert after.belief.covariance[state, state] < before.covariance[state, state]


@pytest.mark.parametrize(("x", "y"), [(0.03, 0.12), (-0.02, 0.05), (0.0, 0.15)])
def test_the_place_at_the_start_errs_as_the_geometry_makes_it(robot: FiveBar, x: float, y: float) -> None:
    """The platform is where the nominal robot has it with the readings of the actual one."""
    modes, step = (1, -1), 1e-6
    tolerances = Tolerances(length=2e-4, base=1e-4, zero=1e-3)
    model = filter_model(robot, *modes, RATE_HZ, EkfSettings(), tolerances)
    deviations = np.array(considered_errors(tolerances))
    assembly = next(
        one for one in (1, -1) if math.dist(direct_geometry(robot, one, *home(robot, modes, x, y)), (x, y)) < 1e-9
    )

    def errors(error: int, size: float) -> Vector:
        """Actual minus believed place."""
        q11, q21 = readings(robot, modes, x, y, error, size).tolist()
        return np.array([x, y]) - direct_geometry(robot, assembly, q11, q21)

    share = np.zeros((2, cov.CONSIDERED_END - cov.CONSIDERED))
    for error in (*FIELDS, cov.ZERO1, cov.ZERO2):
        share[:, error - cov.CONSIDERED] = (errors(error, step) - errors(error, -step)) / (2.0 * step)
    p = homed_belief(model, x, y, 1e-8).covariance
    exact = homed_belief(filter_model(robot, *modes, RATE_HZ, EkfSettings()), x, y, 1e-8).covariance
    scale = np.sqrt(np.diag(p)[[cov.X, cov.Y]])
    np.testing.assert_allclose(
        p[:2, CONSTANT] / np.outer(scale, deviations), share * deviations / scale[:, None], atol=1e-5
    )
    expected = exact[:2, :2] + share * deviations**2 @ share.T
    np.testing.assert_allclose(p[:2, :2] / np.outer(scale, scale), expected / np.outer(scale, scale), atol=1e-5)
    np.testing.assert_array_equal(p, p.T)
    np.testing.assert_array_equal(p[CONSTANT, CONSTANT], np.diag(deviations**2))
    sizes = np.sqrt(np.where(np.diag(p) > 0.0, np.diag(p), 1.0))
    assert np.linalg.eigvalsh(p / np.outer(sizes, sizes)).min() > -1e-12


def home(robot: FiveBar, modes: tuple[int, int], x: float, y: float) -> tuple[float, float]:
    q = inverse_geometry(robot, *modes, x, y)
    return q.q11, q.q21


def test_a_tolerance_is_the_half_width_of_a_uniform_distribution() -> None:
    found = considered_errors(Tolerances(length=3e-4, base=6e-4, zero=9e-3, gyro_scale=0.03))
    expected = (9e-3, 9e-3, *[3e-4] * 4, 6e-4, 6e-4, 0.03)
    assert found == pytest.approx([one / math.sqrt(3.0) for one in expected], rel=1e-12)
