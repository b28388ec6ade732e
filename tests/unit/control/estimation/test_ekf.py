# SPDX-License-Identifier: Apache-2.0
"""The filter as a whole: is it as good as it says, where does it lead, and what do the disturbances do."""

from __future__ import annotations

import math

import numpy as np
import pytest
from estimate_replay import OFF_MODEL, encoder_scenario, replay
from scipy.stats import chi2

from fivebar_bringup.simulation.offline import simulate
from fivebar_control.estimation.constants import estimator_model
from fivebar_control.estimation.covariance import CLOCK_ERROR, ERRORS, PASSIVE, SCALE, SIZE
from fivebar_control.estimation.ekf import (
    NO_ERRORS,
    STIFFNESS_LIMIT,
    Belief,
    Estimate,
    FilterModel,
    advanced,
    as_vector,
    filter_model,
    guessed,
    predicted,
    transition,
)
from fivebar_control.estimation.encoder import count_angle, first_angle
from fivebar_control.estimation.gyroscope import with_rate
from fivebar_control.estimation.history import keep_belief
from fivebar_control.estimation.measurements import corrected, homed_belief
from fivebar_control.estimation.platform_motion import (
    Applied,
    acceleration_derivatives,
    leg_motion,
    platform_acceleration,
)
from fivebar_control.estimation.readings import with_motors
from fivebar_control.estimation.settings import Drives, EkfSettings, Sensing
from fivebar_control.estimation.step import first_update, next_update
from fivebar_control.laws.ctc import ctc_torque
from fivebar_control.laws.reference import reference_from_platform
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.trajectory.path import Path
from fivebar_description.parameters import FiveBar
from fivebar_description.tolerances import EXACT, Tolerances
from fivebar_sim.sensors import Encoder

RATE_HZ, COUNTS = 500, 20000
PERIOD = 1.0 / RATE_HZ
MODES = (1, -1)
EXACTLY_KNOWN = Tolerances(gyro_scale=0.0)
WAY = Path.through([(0.02, 0.14), (-0.03, 0.11)], [0.3])


def model_of(robot: FiveBar, settings: EkfSettings | None = None) -> FilterModel:
    return filter_model(robot, MODES, RATE_HZ, settings if settings is not None else EkfSettings())


def finely_advanced(robot: FiveBar, estimate: Estimate, tau1: float, tau2: float, steps: int = 200) -> Estimate:
    """One period in many small steps of the midpoint rule."""
    x, y, vx, vy = estimate[:4]
    d1, d2, fx, fy = estimate.d1, estimate.d2, estimate.fx, estimate.fy
    h = PERIOD / steps
    for _ in range(steps):
        ax, ay = platform_acceleration(robot, MODES, x, y, vx, vy, Applied(tau1 + d1, tau2 + d2, fx, fy))
        middle = (x + 0.5 * h * vx, y + 0.5 * h * vy, vx + 0.5 * h * ax, vy + 0.5 * h * ay)
        ax, ay = platform_acceleration(robot, MODES, *middle, Applied(tau1 + d1, tau2 + d2, fx, fy))
        x, y, vx, vy = x + h * middle[2], y + h * middle[3], vx + h * ax, vy + h * ay
    return estimate._replace(x=x, y=y, vx=vx, vy=vy)


@pytest.mark.parametrize(
    ("start", "torque", "tolerance"),
    [
        (Estimate(0.01, 0.12, 0.2, -0.3, 0.1, -0.1), (0.5, -0.4), 1e-7),
        (Estimate(0.0, 0.0845, 0.01, -0.25, 0.0, 0.0), (-0.2, 0.6), 1e-4),
        # motors that stop and turn round within the period: the friction's steepest part
        (Estimate(0.01, 0.12, 0.0005, -0.0005, 0.0, 0.0), (0.6, -0.7), 3e-4),
        (Estimate(0.0, 0.15, 0.0, 0.0, 0.0, 0.0), (0.3, -0.3), 1e-4),
        # a force on the platform, which away from the locus the motors' disturbances could do as well
        (Estimate(0.0, 0.0845, 0.01, -0.25, 0.0, 0.0, fx=2.0, fy=-1.0), (-0.2, 0.6), 1e-4),
    ],
)
def test_a_period_is_integrated_accurately(
    dextar: FiveBar, start: Estimate, torque: tuple[float, float], tolerance: float
) -> None:
    found, exact = advanced(model_of(dextar), start, *torque), finely_advanced(dextar, start, *torque)
    # tolerance in m/s, and that over a period in m
    assert (found.x, found.y) == pytest.approx((exact.x, exact.y), abs=tolerance * PERIOD)
    assert (found.vx, found.vy) == pytest.approx((exact.vx, exact.vy), abs=tolerance)


@pytest.mark.parametrize("place", [(0.02, 0.13), (0.0, 0.0845), (-0.02, 0.04)])
def test_transition_is_the_derivative_of_a_period(dextar: FiveBar, place: tuple[float, float]) -> None:
    model = filter_model(dextar, MODES, RATE_HZ, EkfSettings())
    start = np.array([*place, 0.25, -0.2, 0.05, -0.05, 0.4, -0.7])
    torque = (0.4, -0.3)

    def estimate_of(state: np.ndarray) -> Estimate:
        *moving, fx, fy = state.tolist()
        return Estimate(*moving, fx=fx, fy=fy)

    def after(state: np.ndarray) -> np.ndarray:
        found = finely_advanced(dextar, estimate_of(state), *torque)
        return np.array([*found[:6], found.fx, found.fy])

    columns = []
    for index in range(8):
        shift = np.zeros(8)
        shift[index] = 1e-6
        columns.append((after(start + shift) - after(start - shift)) / 2e-6)
    expected = np.array(columns).T
    half = after(start)
    middle = estimate_of(0.5 * (start + half))
    found = np.vstack([np.array(transition(model, middle, *torque)), np.eye(8)[4:]])
    # what a period changes, to two parts in a hundred of its largest entry per block
    for rows in (slice(0, 2), slice(2, 4)):
        for columns_of in (slice(0, 2), slice(2, 4), slice(4, 6), slice(6, 8)):
            change = expected[rows, columns_of] - np.eye(8)[rows, columns_of]
            np.testing.assert_allclose(
                found[rows, columns_of] - np.eye(8)[rows, columns_of], change, atol=0.02 * np.abs(change).max()
            )


@pytest.mark.parametrize("rate_hz", [20, 500])
def test_transition_solves_the_trapezoidal_rule_of_the_linearised_motion(dextar: FiveBar, rate_hz: int) -> None:
    """dv' = dv + h (P (dp + dp') / 2 + V (dv + dv') / 2 + G dg) and dp' = dp + h (dv + dv') / 2, g torques and force.

    A long period makes every term of it count.
    """
    middle = Estimate(0.02, 0.13, 0.25, -0.2, 0.05, -0.05, fx=0.4, fy=-0.7)
    applied = Applied(0.4 + middle.d1, -0.3 + middle.d2, middle.fx, middle.fy)
    d = acceleration_derivatives(dextar, MODES, *middle[:4], applied)
    p = np.array([[d.p_xx, d.p_xy], [d.p_yx, d.p_yy]])
    v = np.array([[d.v_xx, d.v_xy], [d.v_yx, d.v_yy]])
    g = np.array([[d.t_x1, d.t_x2, d.f_xx, d.f_xy], [d.t_y1, d.t_y2, d.f_xy, d.f_yy]])
    rows, h = np.array(transition(filter_model(dextar, MODES, rate_hz, EkfSettings()), middle, 0.4, -0.3)), 1 / rate_hz
    for shift in np.eye(8):
        dp, dv, dg = shift[:2], shift[2:4], shift[4:]
        later = rows @ shift
        speed = 0.5 * (dv + later[2:])
        np.testing.assert_allclose(later[:2], dp + h * speed, rtol=1e-9, atol=1e-12)
        pull = 0.5 * p @ (dp + later[:2]) + v @ speed + g @ dg
        np.testing.assert_allclose(later[2:], dv + h * pull, rtol=1e-9, atol=1e-9)


def test_transition_stays_bounded_where_friction_is_steepest(dextar: FiveBar) -> None:
    for rate_hz in (100, 250, 500, 1000):
        still = Estimate(0.0, 0.12, 0.0, 0.0, 0.0, 0.0)
        model = filter_model(dextar, MODES, rate_hz, EkfSettings())
        velocities = np.array(transition(model, still, 0.0, 0.0))[2:, 2:4]
        assert np.abs(np.linalg.eigvals(velocities)).max() < 1.0
        assert math.hypot(*advanced(model, still._replace(vx=1e-3), 0.0, 0.0)[2:4]) < 2e-3


def test_steps_of_the_integration_are_as_many_as_the_steepest_friction_needs(dextar: FiveBar) -> None:
    """Of either leg; twice as many for twice the friction, and one where there is none."""
    for leg1, leg2 in ((1.0, 0.0), (0.0, 1.0), (2.0, 1.0), (0.0, 0.0)):
        robot = dextar._replace(
            leg1=dextar.leg1._replace(coulomb=leg1, width=0.01, inertia=0.02),
            leg2=dextar.leg2._replace(coulomb=leg2, width=0.01, inertia=0.02),
        )
        model = model_of(robot)
        rate = 5000.0 * max(leg1, leg2)
        assert model.steps == max(1, math.ceil(0.5 * PERIOD * rate / STIFFNESS_LIMIT))
        assert model.step * model.steps == pytest.approx(0.5 * PERIOD, rel=1e-12)
        assert model.period == PERIOD


def test_constants_of_the_filter_are_the_settings(dextar: FiveBar) -> None:
    settings = EkfSettings(gyro_clock=0.003, gyro_clock_rate=0.01, force_deviation=2.0, force_time=0.05)
    model = filter_model(dextar, MODES, RATE_HZ, settings, Tolerances(passive_zero=0.03))
    assert model.passive_zero == pytest.approx(0.03 / math.sqrt(3.0), rel=1e-12)
    assert model.noise.clock == pytest.approx(0.01**2 * PERIOD, rel=1e-12)
    assert model.noise.force_kept == pytest.approx(math.exp(-PERIOD / 0.05), rel=1e-12)
    # an offset of the clock that is known exactly does not walk either
    assert model_of(dextar, settings._replace(gyro_clock=0.0)).noise.clock == 0.0


def test_a_force_fades_and_all_other_constants_stay(dextar: FiveBar) -> None:
    start = Estimate(0.01, 0.12, 0.2, -0.3, 0.1, -0.1, 0.02, 1e-3, 0.05, 2.0, -1.0)
    later = advanced(model_of(dextar, EkfSettings(force_time=0.05)), start, 0.3, -0.2)
    assert later[4:9] == start[4:9]
    kept = math.exp(-PERIOD / 0.05)
    assert (later.fx, later.fy) == pytest.approx((2.0 * kept, -kept), rel=1e-12)


def test_torques_that_are_guessed_move_as_known_ones_and_make_unsure(dextar: FiveBar) -> None:
    model = model_of(dextar)
    # fast enough that neither motor is where friction is steep
    start = Estimate(0.01, 0.12, 0.4, -0.6, 0.0, 0.0)
    belief = homed_belief(model, start.x, start.y, 1e-8)._replace(estimate=start)
    known = predicted(model, belief, 0.5, -0.4)
    same, unsure = (guessed(model, belief, 0.5, -0.4, *doubts) for doubts in ((0.0, 0.0), (0.3, 0.7)))
    assert same.estimate == unsure.estimate == known.estimate == advanced(model, belief.estimate, 0.5, -0.4)
    np.testing.assert_array_equal(same.covariance, known.covariance)
    effects = [
        np.array(advanced(model, belief.estimate, 0.5 + 0.3 * one, -0.4 + 0.7 * two)[:4]) - np.array(known.estimate[:4])
        for one, two in ((1e-3, 0.0), (0.0, 1e-3))
    ]
    expected = 1e6 * sum(np.outer(effect, effect) for effect in effects)
    more = (unsure.covariance - known.covariance)[:4, :4]
    np.testing.assert_allclose(more, expected, rtol=0.02)


class Robot:
    """A robot that moves as the filter believes: white acceleration noise, walking disturbances, counted angles.

    Its gyroscope is as the filter believes, too: white noise and a walking bias.
    """

    def __init__(self, robot: FiveBar, settings: EkfSettings, seed: int) -> None:
        self._robot, self._settings = robot, settings
        self._random = np.random.default_rng(seed)
        self._model = model_of(robot, settings)
        self._encoders = [Encoder(COUNTS, PERIOD) for _ in range(2)]
        d1, d2 = (settings.disturbance_initial * self._random.normal(size=2)).tolist()
        x, y = (np.array([0.02, 0.14]) + self._random.uniform(-1e-3, 1e-3, 2)).tolist()
        self.state = Estimate(x, y, 0.0, 0.0, d1, d2, settings.gyro_bias * float(self._random.normal()))

    def read(self) -> tuple[float, float]:
        q = inverse_geometry(self._robot, MODES, self.state.x, self.state.y)
        return self._encoders[0].read(q.q11)[0], self._encoders[1].read(q.q21)[0]

    def turn(self) -> float:
        """Return the gyroscope's reading."""
        rate = leg_motion(self._robot.leg2, MODES[1], *self.state[:4]).dtheta
        return rate + self.state.bias + self._settings.gyro_noise * float(self._random.normal())

    def following_torque(self, sample: int) -> tuple[float, float]:
        """Return what makes the robot go about its way, away from the locus."""
        now = state_from_platform(self._robot, MODES, *self.state[:4])
        desired = reference_from_platform(self._robot, MODES, WAY.at(sample * PERIOD))
        return ctc_torque(self._robot, now, desired, 900.0, 60.0)

    def move(self, tau1: float, tau2: float) -> None:
        x, y, vx, vy, d1, d2, bias, *_ = advanced(self._model, self.state, tau1, tau2)
        density = self._settings.acceleration_noise
        kick, drift = density * math.sqrt(PERIOD), density * math.sqrt(PERIOD**3 / 12.0)
        (ux, uy), (wx, wy) = self._random.normal(size=(2, 2)).tolist()
        walk = self._settings.disturbance_rate * math.sqrt(PERIOD)
        e1, e2 = (walk * self._random.normal(size=2)).tolist()
        # an acceleration that is white within the period moves the place by half a period of the kick, and some more
        self.state = Estimate(
            x + 0.5 * PERIOD * kick * ux + drift * wx,
            y + 0.5 * PERIOD * kick * uy + drift * wy,
            vx + kick * ux,
            vy + kick * uy,
            d1 + e1,
            d2 + e2,
            bias + self._settings.gyro_bias_rate * math.sqrt(PERIOD) * float(self._random.normal()),
        )


def normalised_error(belief: Belief, truth: Estimate, states: slice = slice(0, 6)) -> float:
    """NEES: the error squared in units of the covariance."""
    error = (as_vector(belief.estimate) - as_vector(truth))[states]
    return float(error @ np.linalg.solve(np.array(belief.covariance)[states, states], error))


@pytest.mark.extra
@pytest.mark.parametrize("gyro", [False, True])
def test_the_filter_is_as_uncertain_as_it_says(dextar: FiveBar, gyro: bool) -> None:
    """Monte Carlo: the mean NEES over runs is within the chi-square bounds of 6 or, with the bias, 7 states."""
    # a bias that walks fast enough to be seen within the run
    settings, runs, looks = EkfSettings(gyro=gyro, gyro_bias_rate=0.02), 40, (30, 60, 90, 120)
    freedom = 7 if gyro else 6
    drives = Drives(encoder_counts=COUNTS)
    model = estimator_model(dextar, MODES, Sensing(RATE_HZ, drives, settings, EXACTLY_KNOWN))
    errors: dict[int, list[float]] = {look: [] for look in looks}
    for seed in range(runs):
        truth = Robot(dextar, settings, seed)
        reading = truth.read()
        # from the exact place with the covariance of the reading: the error of the first angles is not Gaussian
        variance = first_angle(model.resolution, reading[0]).variance
        exact = homed_belief(model.filter, truth.state.x, truth.state.y, variance)
        memory = first_update(model, 1, *reading)._replace(belief=exact)
        keep_belief(memory.history, 0, exact)
        for sample in range(1, max(looks) + 1):
            torque = truth.following_torque(sample)
            truth.move(*torque)
            memory = with_motors(memory, sample, 1, *truth.read(), *torque)
            if gyro:
                assert with_rate(model, memory, float(sample), truth.turn()).start == memory.newest
            memory = next_update(model, memory, memory.newest).memory
            if sample in errors:
                errors[sample].append(normalised_error(memory.belief, truth.state, slice(0, freedom)))
    low, high = (
        float(chi2.ppf(level, freedom * runs * len(looks))) / (runs * len(looks)) for level in (1e-3, 1.0 - 1e-3)
    )
    mean = float(np.mean([value for values in errors.values() for value in values]))
    assert low < mean < high
    for look, values in errors.items():
        bounds = [float(chi2.ppf(level, freedom * runs)) / runs for level in (1e-4, 1.0 - 1e-4)]
        assert bounds[0] < float(np.mean(values)) < bounds[1], look


@pytest.mark.parametrize("duration", [0.5, 1.0, pytest.param(2.5, marks=pytest.mark.extra)])
def test_it_is_not_surer_than_it_may_be_through_the_locus(duration: float) -> None:
    """In closed loop with the plant, which has less noise than is assumed: place and velocity, mean NEES below 4."""
    scenario = encoder_scenario("middle", duration)
    states = slice(0, 4)
    values = [
        normalised_error(one.belief, Estimate(*one.truth[2:], 0.0, 0.0), states)
        for one in replay(simulate(scenario), scenario)
    ]
    assert float(np.mean(values)) < 4.0


@pytest.mark.parametrize(
    ("name", "plant"),
    [
        ("middle", {}),
        ("middle", {"friction_scale": 1.2}),
        pytest.param("multiple", OFF_MODEL, marks=pytest.mark.extra),
    ],
    ids=["as believed", "rough", "off"],
)
def test_disturbances_stay_bounded_through_the_locus(name: str, plant: dict[str, float]) -> None:
    """There, one combination of the two cannot be told from the angles: neither it nor its deviation runs away."""
    scenario = encoder_scenario(name, 1.0, (1600.0, 80.0), plant)
    largest = deviation = 0.0
    for one in replay(simulate(scenario), scenario):
        assert one.fault is None
        largest = max(largest, abs(one.belief.estimate.d1), abs(one.belief.estimate.d2))
        deviation = max(deviation, one.belief.covariance[4][4], one.belief.covariance[5][5])
    # the friction torque that is missing or too much is 0.09 Nm at most
    assert largest < 0.4
    assert math.sqrt(deviation) < 0.4


@pytest.mark.parametrize("place", [(0.03, 0.12), (-0.02, 0.05), (0.0, 0.15)])
def test_at_the_start_the_place_is_as_uncertain_as_the_angles_make_it(
    dextar: FiveBar, place: tuple[float, float]
) -> None:
    """(N^T N)^-1 times the variance of the angles, N differenced; the rest is what the settings say."""
    step, settings = 1e-6, EkfSettings(disturbance_initial=0.3, gyro_clock=0.003)
    rows = []
    for shift in ((step, 0.0), (0.0, step)):
        ahead, behind = (
            inverse_geometry(dextar, MODES, place[0] + sign * shift[0], place[1] + sign * shift[1])
            for sign in (1.0, -1.0)
        )
        rows.append([(ahead.q11 - behind.q11) / (2.0 * step), (ahead.q21 - behind.q21) / (2.0 * step)])
    n = np.array(rows).T
    belief = homed_belief(model_of(dextar, settings), *place, 1e-6)
    assert belief.estimate == (*place, *(0.0,) * 9, NO_ERRORS)
    covariance = belief.covariance
    np.testing.assert_allclose(covariance[:2, :2], 1e-6 * np.linalg.inv(n.T @ n), rtol=1e-5, atol=1e-14)
    still = covariance[2, 2]
    assert 0.0 < still < 1e-3
    # of the constant errors there is the gyroscope's scale alone: its tolerance is not 0 by default
    expected = np.zeros(SIZE)
    expected[2:ERRORS] = still, still, 0.3**2, 0.3**2, settings.gyro_bias**2
    expected[SCALE], expected[CLOCK_ERROR] = EXACT.gyro_scale**2 / 3.0, settings.gyro_clock**2
    expected[PASSIVE] = EXACT.passive_zero**2 / 3.0
    np.testing.assert_allclose(covariance[2:, 2:], np.diag(expected[2:]), rtol=1e-12, atol=0.0)
    np.testing.assert_array_equal(covariance[:2, 2:], np.zeros((2, SIZE - 2)))
    np.testing.assert_array_equal(covariance[2:, :2], np.zeros((SIZE - 2, 2)))


def held_by_wrong_torque(robot: FiveBar, disturbed: bool) -> tuple[Belief, Estimate]:
    """Return belief and truth after a slow swing with 0.15 and -0.1 Nm that the filter is not told of."""
    base = EkfSettings(acceleration_noise=1e-3)
    settings = base if disturbed else base._replace(disturbance_rate=0.0, disturbance_initial=1e-9)
    model, count = model_of(robot, settings), count_angle(COUNTS)
    noise = count**2 / 12.0
    truth = Estimate(0.02, 0.14, 0.0, 0.0, 0.15, -0.1)
    belief = homed_belief(model, truth.x, truth.y, 1e-8)
    for sample in range(250):
        swing = math.sin(2.0 * math.pi * sample * PERIOD)
        torque = (0.9 * swing, 0.9 * swing)
        truth = advanced(model, truth, *torque)
        belief = predicted(model, belief, *torque)
        q = inverse_geometry(robot, MODES, truth.x, truth.y)
        belief = corrected(
            model,
            belief,
            first_angle(count, q.q11 - 0.5 * count)._replace(variance=noise),
            first_angle(count, q.q21 - 0.5 * count)._replace(variance=noise),
        ).belief
    return belief, truth


def test_disturbances_remove_the_steady_error_of_a_wrong_model(dextar: FiveBar) -> None:
    """A constant torque that is not modelled drags the estimate along, unless it is estimated too."""
    with_them, truth = held_by_wrong_torque(dextar, True)
    without, _ = held_by_wrong_torque(dextar, False)

    def distance(belief: Belief) -> float:
        return math.hypot(belief.estimate.x - truth.x, belief.estimate.y - truth.y)

    def slip(belief: Belief) -> float:
        return math.hypot(belief.estimate.vx - truth.vx, belief.estimate.vy - truth.vy)

    assert (with_them.estimate.d1, with_them.estimate.d2) == pytest.approx((0.15, -0.1), abs=0.02)
    assert distance(without) > 5.0 * distance(with_them)
    assert slip(without) > 5.0 * slip(with_them)


def test_measurement_row_is_the_derivative_of_the_motor_angles(dextar: FiveBar) -> None:
    step = 1e-7
    for x, y in ((0.01, 0.12), (0.0, 0.0845), (-0.02, 0.05)):
        leg1 = leg_motion(dextar.leg1, MODES[0], x, y, 0.0, 0.0)
        leg2 = leg_motion(dextar.leg2, MODES[1], x, y, 0.0, 0.0)
        for dx, dy in ((step, 0.0), (0.0, step)):
            ahead = inverse_geometry(dextar, MODES, x + dx, y + dy)
            behind = inverse_geometry(dextar, MODES, x - dx, y - dy)
            assert leg1.n_x * dx + leg1.n_y * dy == pytest.approx(0.5 * (ahead.q11 - behind.q11), rel=1e-5, abs=1e-12)
            assert leg2.n_x * dx + leg2.n_y * dy == pytest.approx(0.5 * (ahead.q21 - behind.q21), rel=1e-5, abs=1e-12)
