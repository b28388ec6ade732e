# SPDX-License-Identifier: Apache-2.0
"""What the filter's sensors measure, as it linearises it, against differences of the robot's geometry."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from fivebar_control.estimation import covariance as cov
from fivebar_control.estimation.camera import seen_at
from fivebar_control.estimation.ekf import (
    NO_ERRORS,
    Belief,
    ConstantErrors,
    Estimate,
    as_vector,
    error_deviations,
    filter_model,
)
from fivebar_control.estimation.encoder import Angle
from fivebar_control.estimation.gyroscope import turn_rate, turned
from fivebar_control.estimation.measurements import LINEARISATION, corrected, encoder_row, homed_belief, motor_speeds
from fivebar_control.estimation.passive_encoder import elbow_row, elbow_speed, elbow_turned
from fivebar_control.estimation.platform_motion import leg_motion
from fivebar_control.estimation.settings import EkfSettings
from fivebar_control.model.geometry import direct_geometry, inverse_geometry, wrap
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.model.state import State
from fivebar_description.parameters import FiveBar
from fivebar_description.tolerances import Tolerances

States = Callable[[int, int], list[State]]
Vector = NDArray[np.float64]

RATE_HZ = 500

LAG, SLOPE = -0.0005, 30.0
"""Of a gyroscope's reading: s from its sample to its stamp, and rad/s^2."""

CONSTANT = slice(cov.ERRORS, cov.ERRORS_END)
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
    """Return the robot with one of the constant errors of its geometry."""
    if error not in FIELDS:
        return robot
    leg, field = FIELDS[error]
    parameters = getattr(robot, leg)
    changed = parameters._replace(**{field: getattr(parameters, field) + size})
    return robot._replace(leg1=changed) if leg == "leg1" else robot._replace(leg2=changed)


def readings(robot: FiveBar, modes: tuple[int, int], x: float, y: float, error: int, size: float) -> Vector:
    """Return what both encoders read with the platform at (x, y) m on a robot with an error."""
    q = inverse_geometry(erring(robot, error, size), modes, x, y)
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
        q = inverse_geometry(erring(robot, error, size), modes, x, y)
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
    model = filter_model(robot, modes, RATE_HZ, EkfSettings(gyro_noise=1e-3))
    rate = leg_motion(robot.leg2, modes[1], *estimate[:4]).dtheta + estimate.bias + 1.0
    effect = turned(model, Belief(estimate, np.eye(cov.SIZE)), rate + SLOPE * (LAG - estimate.clock), LAG, SLOPE)
    # the innovation is 1, so that the misfit is the inverse of its variance
    variance = 1.0 / effect.misfit
    row = (as_vector(effect.belief.estimate) - as_vector(estimate)) * variance
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
        for error in FIELDS:
            ahead, behind = (
                leg_motion(erring(robot, error, size).leg2, modes[1], *point.tolist()).dtheta for size in (step, -step)
            )
            expected[error] = (ahead - behind) / (2.0 * step)
        expected[cov.BIAS], expected[cov.SCALE], expected[cov.CLOCK_ERROR] = 1.0, rate(point), -SLOPE
        found = row_of_gyro(robot, modes, Estimate(*point.tolist(), 0.1, -0.1, 0.02, 2e-4))
        scale = 1.0 + float(np.abs(expected).max())
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6 * scale)
        assert (found[cov.D1], found[cov.D2]) == (0.0, 0.0)


def test_a_gyroscope_that_reads_as_expected_changes_no_estimate_and_makes_it_surer(dextar: FiveBar) -> None:
    model = filter_model(dextar, (1, -1), RATE_HZ, EkfSettings())
    before = Belief(Estimate(0.01, 0.12, 0.2, -0.3, 0.1, -0.1, 0.02), homed_belief(model, 0.01, 0.12, 1e-8).covariance)
    rate = leg_motion(dextar.leg2, -1, *before.estimate[:4]).dtheta + 0.02
    after = turned(model, before, rate, 0.0, 20.0)
    np.testing.assert_allclose(as_vector(after.belief.estimate), as_vector(before.estimate), rtol=0.0, atol=1e-15)
    assert after.misfit == pytest.approx(0.0, abs=1e-20)
    for state in (cov.VX, cov.VY, cov.BIAS):
        assert after.belief.covariance[state, state] < before.covariance[state, state]


@pytest.mark.parametrize(("x", "y"), [(0.03, 0.12), (-0.02, 0.05), (0.0, 0.15)])
def test_the_place_at_the_start_errs_as_the_geometry_makes_it(robot: FiveBar, x: float, y: float) -> None:
    """The platform is where the nominal robot has it with the readings of the actual one."""
    modes, step = (1, -1), 1e-6
    tolerances = Tolerances(length=2e-4, base=1e-4, zero=1e-3)
    model = filter_model(robot, modes, RATE_HZ, EkfSettings(), tolerances)
    deviations = np.array(error_deviations(tolerances))
    assembly = next(
        one for one in (1, -1) if math.dist(direct_geometry(robot, one, *home(robot, modes, x, y)), (x, y)) < 1e-9
    )

    def errors(error: int, size: float) -> Vector:
        """Actual minus believed place."""
        q11, q21 = readings(robot, modes, x, y, error, size).tolist()
        return np.array([x, y]) - direct_geometry(robot, assembly, q11, q21)

    share = np.zeros((2, cov.ERRORS_END - cov.ERRORS))
    for error in (*FIELDS, cov.ZERO1, cov.ZERO2):
        share[:, error - cov.ERRORS] = (errors(error, step) - errors(error, -step)) / (2.0 * step)
    p = homed_belief(model, x, y, 1e-8).covariance
    exact = homed_belief(filter_model(robot, modes, RATE_HZ, EkfSettings()), x, y, 1e-8).covariance
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
    q = inverse_geometry(robot, modes, x, y)
    return q.q11, q.q21


def test_a_tolerance_is_the_half_width_of_a_uniform_distribution() -> None:
    found = error_deviations(Tolerances(length=3e-4, base=6e-4, zero=9e-3, gyro_scale=0.03))
    expected = (9e-3, 9e-3, *[3e-4] * 4, 6e-4, 6e-4, 0.03)
    assert found == pytest.approx([one / math.sqrt(3.0) for one in expected], rel=1e-12)


FOUND = ConstantErrors(1e-3, -2e-3, 1e-4, -2e-4, 3e-4, -1e-4, 2e-4, -3e-4, 0.01)
MOVING = Estimate(0.02, 0.13, 0.3, -0.2, 0.1, -0.1, 0.02, 1e-3, 0.05, 0.4, -0.7, FOUND)
MODES = (1, -1)
SIZES = np.array([1e-3, 1e-3, 1e-2, 1e-2, 0.1, 0.1, 0.02, 1e-3, 1e-3, *[2e-4] * 6, 0.01, 1e-3, 1e-2, 0.5, 0.5])
"""Standard deviations of all states and constant errors."""


def unsure() -> Vector:
    """Return a covariance in which every state and constant error depends on every other."""
    root = np.random.default_rng(5).normal(size=(cov.SIZE, cov.SIZE)) * SIZES[:, None]
    return np.asarray(root @ root.T)


def expect_update(before: Belief, after: Belief, rows: Vector, innovations: Vector, noise: Vector) -> float:
    """Check an update against that of all readings at once; return the innovations' mean square in deviations."""
    p = before.covariance
    spread = rows @ p @ rows.T + np.diag(noise)
    change = p @ rows.T @ np.linalg.solve(spread, innovations)
    found = as_vector(after.estimate) - as_vector(before.estimate)
    np.testing.assert_allclose(found / SIZES, change / SIZES, atol=1e-9)
    left = p - p @ rows.T @ np.linalg.solve(spread, rows @ p)
    scale = np.outer(SIZES, SIZES)
    np.testing.assert_allclose(after.covariance / scale, left / scale, atol=1e-8)
    return float(innovations @ np.linalg.solve(spread, innovations)) / len(noise)


def test_both_motors_correct_as_one_measurement(dextar: FiveBar) -> None:
    model, before = filter_model(dextar, MODES, RATE_HZ, EkfSettings()), Belief(MOVING, unsure())
    q = inverse_geometry(dextar, MODES, MOVING.x, MOVING.y)
    off, noise = np.array([2e-3, -3e-3]), np.array([1e-6, 4e-6])
    legs = (dextar.leg1, MODES[0]), (dextar.leg2, MODES[1])
    rows = np.array([
        encoder_row(number, leg_motion(leg, mode, MOVING.x, MOVING.y, 0.0, 0.0))
        for number, (leg, mode) in enumerate(legs, start=1)
    ])  # fmt: skip
    error1, error2 = (rows[:, CONSTANT] @ FOUND).tolist()
    # a turn further, which a motor's encoder may have begun with
    one = Angle(q.q11 + error1 + off[0] + 2.0 * math.pi, noise[0])
    two = Angle(q.q21 + error2 + off[1], noise[1])
    after = corrected(model, before, one, two)
    mean = expect_update(before, after.belief, rows, off, noise)
    assert after.misfit == pytest.approx(2.0 * mean, rel=1e-6)


@pytest.mark.parametrize("number", [1, 2])
def test_a_passive_joint_corrects_by_its_row(dextar: FiveBar, number: int) -> None:
    model, before = filter_model(dextar, MODES, RATE_HZ, EkfSettings()), Belief(MOVING, unsure())
    q = inverse_geometry(dextar, MODES, MOVING.x, MOVING.y)
    angle, leg = ((q.q12, dextar.leg1), (q.q22, dextar.leg2))[number - 1]
    row = elbow_row(number, leg, leg_motion(leg, MODES[number - 1], *MOVING[:4]))
    known = MOVING.passive + float(row[CONSTANT] @ FOUND)
    after = elbow_turned(model, before, number, Angle(angle + known - 4e-3, 1e-6))
    mean = expect_update(before, after.belief, row[None, :], np.array([-4e-3]), np.array([1e-6]))
    assert after.misfit == pytest.approx(mean, rel=1e-9)


@pytest.mark.parametrize("lag", [0.0015, -0.001])
def test_a_camera_corrects_both_coordinates_at_its_exposure(lag: float) -> None:
    before, off = Belief(MOVING, unsure()), np.array([7e-4, -9e-4])
    x, y = MOVING.x + lag * MOVING.vx + off[0], MOVING.y + lag * MOVING.vy + off[1]
    rows = np.zeros((2, cov.SIZE))
    rows[0, cov.X] = rows[1, cov.Y] = 1.0
    rows[0, cov.VX] = rows[1, cov.VY] = lag
    after = seen_at(before, x, y, lag, 1e-8, 6.0)
    mean = expect_update(before, after.belief, rows, off, np.full(2, 1e-8))
    assert after.misfit == pytest.approx(mean, rel=1e-9)
    # the gate is a number of standard deviations; beyond it only the misfit is told
    gate = math.sqrt(2.0 * mean)
    assert seen_at(before, x, y, lag, 1e-8, 1.001 * gate).belief.estimate == after.belief.estimate
    refused = seen_at(before, x, y, lag, 1e-8, 0.999 * gate)
    assert refused.belief is before
    assert refused.misfit == after.misfit


@pytest.mark.parametrize("number", [1, 2])
def test_a_part_of_the_constant_errors_adds_to_the_noise(dextar: FiveBar, number: int) -> None:
    """Of the two motors, of which the other is not believed at all, and of the passive joint."""
    tolerances = Tolerances(length=2e-4, base=1e-4, zero=1e-3)
    model = filter_model(dextar, MODES, RATE_HZ, EkfSettings(), tolerances)
    deviations, p = np.array(error_deviations(tolerances)), np.zeros((cov.SIZE, cov.SIZE))
    # by now, no two of them are equally uncertain
    known = np.arange(1.0, 10.0)
    p[CONSTANT, CONSTANT] = np.diag(known * deviations**2)
    before = Belief(MOVING._replace(errors=NO_ERRORS), p)
    q, noise = inverse_geometry(dextar, MODES, MOVING.x, MOVING.y), 1e-6
    parameters, mode = ((dextar.leg1, MODES[0]), (dextar.leg2, MODES[1]))[number - 1]
    leg = leg_motion(parameters, mode, *MOVING[:4])
    angles = [Angle(q.q11, 1e9), Angle(q.q21, 1e9)]
    angles[number - 1] = Angle(angles[number - 1].value + 0.01, noise)
    elbow = Angle((q.q12, q.q22)[number - 1] + MOVING.passive + 0.01, noise)
    for misfit, row in (
        (corrected(model, before, *angles).misfit, encoder_row(number, leg)),
        (elbow_turned(model, before, number, elbow).misfit, elbow_row(number, parameters, leg)),
    ):
        effects = (row[CONSTANT] * deviations) ** 2
        variance = float(known @ effects + LINEARISATION**2 * np.sum(effects)) + noise
        assert 0.01**2 / misfit == pytest.approx(variance, rel=1e-6)


def test_speeds_of_an_estimate_are_those_of_the_robot(dextar: FiveBar) -> None:
    model, state = (
        filter_model(dextar, MODES, RATE_HZ, EkfSettings()),
        state_from_platform(dextar, MODES, *MOVING[:4]),
    )
    assert motor_speeds(model, MOVING) == pytest.approx((state.leg1.dq1, state.leg2.dq1), rel=1e-12)
    assert turn_rate(model, MOVING) == pytest.approx(state.leg2.dtheta, rel=1e-12)
    for number, leg in ((1, state.leg1), (2, state.leg2)):
        assert elbow_speed(model, MOVING, number) == pytest.approx(leg.dtheta - leg.dq1, rel=1e-12)


def test_what_is_not_known_at_the_start_is_as_the_settings_say(dextar: FiveBar) -> None:
    settings = EkfSettings(
        acceleration_noise=0.3,
        disturbance_initial=0.2,
        gyro_bias=0.03,
        gyro_clock=1e-3,
        force_deviation=1.5,
    )
    tolerances = Tolerances(passive_zero=0.02)
    belief = homed_belief(filter_model(dextar, MODES, RATE_HZ, settings, tolerances), 0.02, 0.13, 1e-8)
    assert belief.estimate == (0.02, 0.13, *(0.0,) * 9, NO_ERRORS)
    variances = np.diag(belief.covariance)
    expected = {
        cov.VX: 0.3**2 / RATE_HZ,
        cov.VY: 0.3**2 / RATE_HZ,
        cov.D1: 0.2**2,
        cov.D2: 0.2**2,
        cov.BIAS: 0.03**2,
        cov.CLOCK_ERROR: 1e-6,
        cov.PASSIVE: 0.02**2 / 3.0,
        cov.FX: 1.5**2,
        cov.FY: 1.5**2,
    }
    assert {at: variances[at] for at in expected} == pytest.approx(expected, rel=1e-12)
