# SPDX-License-Identifier: Apache-2.0
"""The path law: what it does not do along the path, how a late robot goes on, and what the torque limit leaves."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from fivebar_control.laws.gains import UnifiedSettings
from fivebar_control.laws.law import Instant
from fivebar_control.laws.path import (
    FASTEST_CHANGE,
    LAW,
    PathMemory,
    PathSettings,
    followed,
    nearest_clock,
    pace_change,
    path_memory,
    plan_at,
)
from fivebar_control.laws.reference import Reference, held_torque, reference_from_platform
from fivebar_control.laws.torque import ZERO, Torque
from fivebar_control.laws.unified import INITIAL_MEMORY as NOTHING_OBSERVED
from fivebar_control.laws.unified import input_map, normal_matrix, unified_law_step
from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.model.line import Line
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.model.state import Platform, State, WorkingMode
from fivebar_control.planning.predicted_run import advanced
from fivebar_control.trajectory.path import Path
from fivebar_control.trajectory.path_distance import path_distances
from fivebar_description.parameters import FiveBar
from fivebar_description.settings import as_numbers

FloatArray = NDArray[np.float64]

RATE, PERIOD, MODE = 500, 1.0 / 500, (1, -1)
PATH = Path.through([(0.0, 0.15), (0.015, 0.03)], [1.0])
"""A crossing that is not square to the locus."""

SAMPLES = PATH.samples(RATE)
REFERENCES = [PATH.at(number / RATE) for number in range(SAMPLES + 1)]


def settings(**changes: float) -> PathSettings:
    return as_numbers(PathSettings(torque_limit=10.0)._replace(**changes))


def memory_of(robot: FiveBar, one: PathSettings) -> PathMemory:
    return path_memory(robot, MODE, REFERENCES, PERIOD, one)


def reference(robot: FiveBar, sample: int) -> Reference:
    return reference_from_platform(robot, MODE, PATH.at(sample / RATE))


def instant(state: State, given: Reference) -> Instant:
    line = Line(given.state.x, given.state.y, math.nan, math.nan)
    return Instant(state, given, line, MODE, 0.0, PERIOD, None)


def on_plan(robot: FiveBar, sample: float, pace: float = 1.0, off: float = 0.0) -> State:
    x, y, vx, vy, *_ = PATH.at(sample / RATE)
    return state_from_platform(robot, MODE, x + off, y, pace * vx, pace * vy)


def torque_of(robot: FiveBar, state: State, sample: int, clock: float, one: PathSettings) -> Torque:
    memory = memory_of(robot, one)
    kept = PathMemory(memory.plan, max(sample - 1, 0), clock, memory.unified)
    torque, _ = LAW.step(robot, instant(state, reference(robot, sample)), kept, one)
    return torque


def test_a_robot_on_its_plan_gets_the_torque_of_the_unified_law(dextar: FiveBar) -> None:
    for sample, off in ((0, 0.0), (120, 0.0), (250, 2e-4), (400, -1e-4)):
        state = on_plan(dextar, sample)._replace() if off == 0.0 else on_plan(dextar, sample, 1.0, off)
        given = reference(dextar, sample)
        wanted, _ = unified_law_step(
            dextar, instant(state, given), NOTHING_OBSERVED, as_numbers(UnifiedSettings(torque_limit=10.0))
        )
        found = torque_of(dextar, state, sample, float(sample), settings())
        # beside the path the nearest place is a little further along a slanted path
        assert tuple(found) == pytest.approx(tuple(wanted), abs=1e-9 if off == 0.0 else 0.05)


def test_what_the_reference_compensates_besides_friction_is_compensated(dextar: FiveBar) -> None:
    state, given, one = on_plan(dextar, 120), reference(dextar, 120), settings()
    memory = PathMemory(memory_of(dextar, one).plan, 119, 120.0, NOTHING_OBSERVED._replace(d1=0.03, d2=0.04))
    more = given._replace(f1=given.f1 + 0.2, f2=given.f2 - 0.1)
    first, second = (LAW.step(dextar, instant(state, asked), memory, one)[0] for asked in (given, more))
    assert (second.tau1 - first.tau1, second.tau2 - first.tau2) == pytest.approx((0.2, -0.1), abs=1e-9)


@pytest.mark.parametrize(("sample", "pace"), [(60, 0.6), (60, 1.3), (400, 0.7)])
def test_a_robot_that_passes_slower_or_quicker_follows_the_path_and_comes_back_to_the_plan_s_pace(
    dextar: FiveBar, sample: int, pace: float
) -> None:
    """On its path at a pace p it accelerates by p^2 a + v dp/dt, and dp/dt is `pace_rate` (1 - p)."""
    one = settings(catch_up=0.0, weight=1e-9, slow=1e-6)
    state, desired, step = on_plan(dextar, sample, pace), PATH.at(sample / RATE), 1e-6
    torque = torque_of(dextar, state, sample, float(sample), one)
    after = advanced(dextar, MODE, state, torque, step, 1)
    speed = np.array((desired.vx, desired.vy))
    expected = pace**2 * np.array((desired.ax, desired.ay)) + one.pace_rate * (1.0 - pace) * speed
    found = np.array((after.vx - state.vx, after.vy - state.vy)) / step
    assert found == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())
    assert abs(1.0 - pace**2) * np.hypot(desired.ax, desired.ay) > 0.05 * np.abs(expected).max()


def test_no_force_pulls_a_late_robot_along_the_path_and_all_of_it_across(dextar: FiveBar) -> None:
    """50 samples late it goes on from where it is: unified would accelerate it by metres per second squared."""
    late, sample = 200, 250
    state = on_plan(dextar, late)
    free = settings(catch_up=0.0)
    found = torque_of(dextar, state, sample, float(late), free)
    there = torque_of(dextar, state, late, float(late), free)
    assert tuple(found) == pytest.approx(tuple(there), abs=1e-6)
    pulled, _ = unified_law_step(
        dextar,
        instant(state, reference(dextar, sample)),
        NOTHING_OBSERVED,
        as_numbers(UnifiedSettings(torque_limit=10.0)),
    )
    assert max(abs(pulled.tau1 - found.tau1), abs(pulled.tau2 - found.tau2)) > 5.0
    beside = torque_of(dextar, on_plan(dextar, late, 1.0, 1e-3), sample, float(late), free)
    assert max(abs(beside.tau1 - found.tau1), abs(beside.tau2 - found.tau2)) > 0.5


def test_the_clock_is_that_of_the_nearest_place_and_follows_the_plan_where_that_is_slow(dextar: FiveBar) -> None:
    plan = np.array(REFERENCES)
    for moment in (150.3, 250.7, 333.25):
        state = on_plan(dextar, moment)
        assert nearest_clock(plan, moment - 4.0, state, PERIOD, 1e-4) == pytest.approx(moment, abs=1e-3)
        x, y, vx, vy, ax, ay = PATH.at(moment / RATE)
        assert tuple(plan_at(plan, moment, PERIOD)) == pytest.approx((x, y, vx, vy, ax, ay), abs=3e-4)
        assert plan_at(plan, moment, PERIOD)[:2] == pytest.approx((x, y), abs=1e-9)
    still = on_plan(dextar, 0)
    assert nearest_clock(plan, 2.0, still, PERIOD, 0.03) == pytest.approx(2.0, abs=0.1)


def test_between_two_samples_and_at_its_end_the_plan_is_that_of_the_path(dextar: FiveBar) -> None:
    plan = memory_of(dextar, settings()).plan
    for clock in (0.5, 120.3, 250.75, SAMPLES - 0.4):
        found, there = plan_at(plan, clock, PERIOD), PATH.at(clock / RATE)
        assert found[:2] == pytest.approx(there[:2], abs=1e-10)
        assert found[2:4] == pytest.approx(there[2:4], abs=1e-7)
        assert found[4:6] == pytest.approx(there[4:6], abs=1e-3)
    assert plan_at(plan, float(SAMPLES), PERIOD) == pytest.approx(PATH.at(SAMPLES / RATE), abs=1e-12)


def test_the_nearest_place_is_never_beyond_the_end_of_the_plan(dextar: FiveBar) -> None:
    plan = np.array(REFERENCES[:251])
    assert nearest_clock(plan, 248.0, on_plan(dextar, 260), PERIOD, 1e-4) == 250.0


def test_the_clock_goes_on_with_the_pace_of_the_robot_and_over_missing_samples(dextar: FiveBar) -> None:
    one = settings()
    for pace, sample in ((0.8, 201), (1.2, 201), (1.0, 204)):
        # three samples are missing before the last one
        before = PathMemory(np.array(REFERENCES), 200, 200.0, NOTHING_OBSERVED)
        state = on_plan(dextar, sample, pace)
        _, after = LAW.step(dextar, instant(state, reference(dextar, sample)), before, one)
        assert after.sample == sample
        assert after.clock == pytest.approx(sample + pace, abs=0.02)


@pytest.mark.parametrize(("here", "sample"), [(250, 200), (200, 250)])
def test_a_robot_that_is_early_slows_down_and_a_late_one_hurries(dextar: FiveBar, here: int, sample: int) -> None:
    state = on_plan(dextar, here)
    mapped = input_map(dextar, state)
    assert mapped is not None
    forward = []
    for catch_up in (0.0, 0.2):
        u = torque_of(dextar, state, sample, float(here), settings(catch_up=catch_up))
        ax = mapped.g_x1 * u.tau1 + mapped.g_x2 * u.tau2
        ay = mapped.g_y1 * u.tau1 + mapped.g_y2 * u.tau2
        forward.append((ax * state.vx + ay * state.vy) / math.hypot(state.vx, state.vy))
    assert (forward[1] - forward[0]) * (sample - here) > 0.0
    assert abs(forward[1] - forward[0]) > 0.1


def test_the_clock_begins_with_a_motion_and_goes_on_where_the_motion_changes() -> None:
    plan, observed = np.array(REFERENCES), NOTHING_OBSERVED._replace(d1=0.1)
    under_way = PathMemory(plan, 200, 190.5, observed)
    stopping = plan.copy()
    stopping[210:] = plan[210]
    changed = followed(under_way, stopping)
    assert changed.plan is stopping
    assert changed[1:] == (200, 190.5, observed)
    elsewhere = np.array([Path.through([(0.015, 0.03), (0.0, 0.15)], [1.0]).at(n / RATE) for n in range(SAMPLES + 1)])
    begun = followed(PathMemory(plan, SAMPLES, float(SAMPLES), observed), elsewhere)
    assert begun.plan is elsewhere
    assert begun[1:] == (0, 0.0, observed)


def test_the_change_of_the_pace_is_what_the_torque_limit_leaves(dextar: FiveBar) -> None:
    state, desired = on_plan(dextar, 150, 0.8), PATH.at(150 / RATE)
    wide, narrow = settings(), settings(torque_limit=0.2)
    assert pace_change(dextar, state, desired, 0.8, 15.0, ZERO, wide) == 15.0
    assert pace_change(dextar, state, desired, 0.8, 99.0, ZERO, wide) == FASTEST_CHANGE
    found = pace_change(dextar, state, desired, 0.8, 15.0, ZERO, narrow)
    assert 0.0 < found < 15.0
    mapped = input_map(dextar, state)
    assert mapped is not None
    h = normal_matrix(mapped, narrow.weight)
    matrix = np.array([[h[0], h[1]], [h[1], h[2]]])
    gain = np.array([[mapped.g_x1, mapped.g_x2], [mapped.g_y1, mapped.g_y2]])
    error = narrow.kd * (0.8 * np.array(desired[2:4]) - [state.vx, state.vy])
    error += narrow.kp * (np.array(desired[:2]) - [state.x, state.y])
    wanted = 0.64 * np.array(desired[4:]) + found * np.array(desired[2:4]) + error - [mapped.a0_x, mapped.a0_y]
    assert np.abs(np.linalg.solve(matrix, gain.T @ wanted)).max() == pytest.approx(0.2, rel=1e-9)


@pytest.mark.parametrize("gravity", [0.0, -3.0])
def test_the_change_of_the_pace_keeps_both_torques_for_any_state_pace_and_load(dextar: FiveBar, gravity: float) -> None:
    """Against the least squares in matrices, whose torques are linear in the change: u = H^-1 (G^T a + w u_0) + off."""
    dextar = dextar._replace(gravity_y=gravity)
    drawn = np.random.default_rng(7)
    kinds = {"free": 0, "bounded": 0, "impossible": 0}
    for _ in range(300):
        x, y = drawn.uniform((-0.02, 0.02), (0.02, 0.14))
        state = state_from_platform(dextar, MODE, x, y, *drawn.uniform(-0.3, 0.3, 2))
        desired = Platform(*(np.array((x, y)) + drawn.uniform(-5e-4, 5e-4, 2)), *drawn.uniform(-0.5, 0.5, 2), 0.8, -0.5)
        pace, wanted = drawn.uniform(0.3, 1.5), drawn.uniform(-40.0, 40.0)
        off, limit = Torque(*drawn.uniform(-0.3, 0.3, 2)), drawn.uniform(0.3, 6.0)
        one = settings(torque_limit=limit, kp=900.0, kd=40.0, weight=0.3)
        mapped = input_map(dextar, state)
        assert mapped is not None
        matrix = np.array(((mapped.g_x1, mapped.g_x2), (mapped.g_y1, mapped.g_y2)))
        speed, along = np.array((state.vx, state.vy)), np.array((desired.vx, desired.vy))
        planned = np.array((desired.ax, desired.ay)) * pace**2
        target = planned + 40.0 * (pace * along - speed) + 900.0 * np.array((desired.x - x, desired.y - y))
        target -= (mapped.a0_x, mapped.a0_y)
        inverse = np.linalg.inv(matrix.T @ matrix + 0.3 * np.eye(2))
        rest = inverse @ (matrix.T @ target + 0.3 * np.array(held_torque(dextar, state, *planned))) + np.array(off)
        slope = inverse @ matrix.T @ along
        ends = np.sort(np.stack(((-limit - rest) / slope, (limit - rest) / slope)), axis=0)
        low, high = max(-FASTEST_CHANGE, *ends[0]), min(FASTEST_CHANGE, *ends[1])
        expected = np.clip(
            0.5 * (low + high) if low > high else np.clip(wanted, low, high), -FASTEST_CHANGE, FASTEST_CHANGE
        )
        kinds["impossible" if low > high else "free" if low < wanted < high else "bounded"] += 1
        assert pace_change(dextar, state, desired, pace, wanted, off, one) == pytest.approx(
            expected, abs=1e-6, rel=1e-7
        )
    assert min(kinds.values()) > 20, kinds


@pytest.mark.parametrize("held", [0, 60])
def test_a_robot_that_was_held_up_crosses_on_its_path_and_rests_at_the_goal(dextar: FiveBar, held: int) -> None:
    """It stands still at a quarter of the way for some samples; unified would have been pulled off its timing."""
    one = settings()
    memory, state = memory_of(dextar, one), on_plan(dextar, 0)
    begun, places, clocks = det_a(state), [], []
    for sample in range(SAMPLES + 101):
        torque, memory = LAW.step(dextar, instant(state, reference(dextar, sample)), memory, one)
        places.append((state.x, state.y))
        clocks.append(sample - memory.clock)
        if 200 <= sample < 200 + held:
            state = state_from_platform(dextar, MODE, state.x, state.y, 0.5 * state.vx, 0.5 * state.vy)
        else:
            state = advanced(dextar, MODE, state, torque, 1e-3, 2)
    assert path_distances(np.array(REFERENCES), np.array(places[: SAMPLES + 1])).max() < 5e-4
    assert math.dist(places[SAMPLES], PATH.at(1.0)[:2]) < 1e-3
    assert math.dist(places[-1], PATH.at(1.0)[:2]) < 1e-4
    assert math.hypot(state.vx, state.vy) < 0.01
    assert det_a(state) * begun < 0.0
    assert max(clocks) > 0.8 * held


def test_without_a_plan_and_for_a_reference_outside_of_it_it_is_the_unified_law(dextar: FiveBar) -> None:
    state, one = on_plan(dextar, 200), settings()
    held = reference_from_platform(dextar, MODE, Platform(0.01, 0.1, 0.0, 0.0, 0.0, 0.0))
    wanted, _ = unified_law_step(
        dextar, instant(state, held), NOTHING_OBSERVED, as_numbers(UnifiedSettings(torque_limit=10.0))
    )
    for memory in (memory_of(dextar, one), PathMemory(np.zeros((0, 6)), 0, 0.0, NOTHING_OBSERVED)):
        found, _ = LAW.step(dextar, instant(state, held), memory, one)
        assert found == wanted


class Pushed(NamedTuple):
    """A crossing whose platform is pushed across its path.

    Attributes:
        beside: float64[n], how far the push takes it off the path (m).
        bound: float64[n], what docs/bounds.md says it does at most (m).
        growth: factor by which the passage may multiply an error across the path.
    """

    beside: FloatArray
    bound: FloatArray
    growth: float


def yields(robot: FiveBar, mode: WorkingMode, at: State, normal: FloatArray) -> float:
    """Return the acceleration along a normal (m/s^2) by 1 N along it: the legs' inertia counts across t_s."""
    pushed = robot._replace(force_x=float(normal[0]), force_y=float(normal[1]))
    state = state_from_platform(robot, mode, at.x, at.y, 0.0, 0.0)
    one, other = (direct_dynamics(robot_, state, 0.0, 0.0, 0.0, 0.0) for robot_ in (pushed, robot))
    return float(normal @ (one.ax - other.ax, one.ay - other.ay))


def pushed_across(robot: FiveBar, mode: WorkingMode, middle: State, angle: float, duration: float) -> Pushed:
    """Push a platform by 1 N for 50 ms across a straight path at an angle (rad) from v1, under the path law alone."""
    svd, one = parallel_svd(middle), settings(observer_rate=0.0)
    turned, risen = math.cos(angle), math.sin(angle)
    d = np.array((turned * svd.v_x + risen * svd.t_x, turned * svd.v_y + risen * svd.t_y))
    normal, centre = np.array((-d[1], d[0])), np.array((middle.x, middle.y))
    ends = [tuple((centre + side * 0.04 * d).tolist()) for side in (-1.0, 1.0)]
    path = Path.through(ends, [duration])
    references = [path.at(number / RATE) for number in range(path.samples(RATE) + 1)]
    line, passed = Line(*ends[0], *d.tolist()), []
    for force in (0.0, 1.0):
        memory = path_memory(robot, mode, references, PERIOD, one)
        state = state_from_platform(robot, mode, *ends[0], 0.0, 0.0)
        acted_on = robot._replace(force_x=force * normal[0], force_y=force * normal[1])
        for number, desired in enumerate(references):
            passed.append(state)
            given = reference_from_platform(robot, mode, desired)
            torque, memory = LAW.step(robot, Instant(state, given, line, mode, 0.0, PERIOD, None), memory, one)
            is_pushed = abs(number / RATE - 0.5 * duration) <= 0.025
            state = advanced(acted_on if is_pushed else robot, mode, state, torque, 1e-3, 2)
    moved = np.array([(state.x, state.y) for state in passed]).reshape(2, -1, 2) @ normal
    slowest, ratio = one.kp / one.kd, one.kd**2 / one.kp
    norm, exponent, bound = 0.0, 0.0, []
    # along the pushed run itself: the law crosses when it does, not when the plan says
    for number, state in enumerate(passed[len(references) :]):
        mapped = input_map(robot, state)
        assert mapped is not None
        g = np.array(((mapped.g_x1, mapped.g_x2), (mapped.g_y1, mapped.g_y2)))
        given_up = np.eye(2) - g @ np.linalg.solve(g.T @ g + one.weight * np.eye(2), g.T)
        rate = slowest * max(-1.0, 1.0 - ratio * (1.0 - normal @ given_up @ normal))
        is_pushed = abs(number / RATE - 0.5 * duration) <= 0.025
        bound.append(norm / slowest)
        norm = norm * math.exp(rate * PERIOD) + is_pushed * PERIOD * yields(robot, mode, state, normal)
        exponent += max(rate, 0.0) * PERIOD
    return Pushed(moved[1] - moved[0], np.array(bound), math.exp(exponent))


@pytest.mark.parametrize(
    ("folded", "degrees", "duration", "growth", "beside"),
    [
        (False, 90.0, 0.5, 1.0, 0.036),
        (False, 60.0, 0.5, 1.0, 0.155),
        (False, 90.0, 1.0, 1.0, 0.027),
        (False, 30.0, 1.0, 1.11, 0.935),
        (True, 0.0, 0.5, 1.34, 0.412),
        (True, 0.0, 1.0, 1.70, 0.991),
        (True, -35.0, 1.0, 1.13, 0.736),
    ],
)
def test_a_push_across_the_path_is_within_its_bound_which_grows_only_where_v1_has_little_of_the_normal(
    dextar: FiveBar, folded: bool, degrees: float, duration: float, growth: float, beside: float
) -> None:
    mode: WorkingMode = (1, 1) if folded else (1, -1)
    elbows = math.sqrt(0.09**2 - 0.059**2)
    place = (
        (0.0899999 * math.cos(math.pi / 6.0), elbows - 0.0899999 * math.sin(math.pi / 6.0))
        if folded
        else (0.0, math.sqrt(0.09**2 - 0.031**2))
    )
    middle = state_from_platform(dextar, mode, *place, 0.0, 0.0)
    found = pushed_across(dextar, mode, middle, math.radians(degrees), duration)
    assert found.growth == pytest.approx(growth, abs=0.01)
    assert 1e3 * np.abs(found.beside).max() == pytest.approx(beside, rel=0.02)
    # the push changes the timing too, and with it what the law gives up later, by up to 15 micrometres
    assert np.all(np.abs(found.beside) <= found.bound + 1.5e-5)
    assert found.bound.max() < 5.0 * np.abs(found.beside).max()


@pytest.mark.parametrize("late", [0.02, 0.15])
def test_a_late_robot_comes_back_in_time_as_the_dynamics_of_the_timing_say(dextar: FiveBar, late: float) -> None:
    """On its path: the delay has the rate -(its rate + k sat(delay / T_c)) r, whatever the path."""
    one = settings(weight=1e-9, slow=1e-6, observer_rate=0.0)
    path = Path.through([(-0.05, 0.13), (0.05, 0.13)], [2.0])
    references = [path.at(number / RATE) for number in range(path.samples(RATE) + 1)]
    first = 400
    state = state_from_platform(dextar, MODE, *references[first - round(late * RATE)][:4])
    memory = path_memory(dextar, MODE, references, PERIOD, one)._replace(sample=first - 1, clock=first - late * RATE)
    delay, rate, found, wanted = late, 0.0, [], []
    for sample in range(first, first + 250):
        given = reference_from_platform(dextar, MODE, references[sample])
        found.append((sample - nearest_clock(memory.plan, memory.clock, state, PERIOD, one.slow)) / RATE)
        wanted.append(delay)
        line = Line(-0.05, 0.13, 1.0, 0.0)
        torque, memory = LAW.step(dextar, Instant(state, given, line, MODE, 0.0, PERIOD, None), memory, one)
        state = advanced(dextar, MODE, state, torque, 1e-3, 2)
        for _ in range(20):
            wish = one.catch_up * min(max(delay / one.catch_up_time, -1.0), 1.0)
            rate -= PERIOD / 20.0 * one.pace_rate * (rate + wish)
            delay += PERIOD / 20.0 * rate
    assert found == pytest.approx(wanted, abs=0.02 * late)
    assert wanted[-1] < 0.6 * late
