# SPDX-License-Identifier: Apache-2.0
"""The mirror mode: where it is, how far off it is, and that an estimate which may be the wrong one is not passed on."""

from __future__ import annotations

import math

import numpy as np
import pytest
from engine_agreement import columns, long_if_seldom_compiled, prepared
from estimate_replay import OFF_MODEL, encoder_scenario

from fivebar_bringup.simulation.engine import crossing, traced_crossing
from fivebar_bringup.simulation.offline import simulate
from fivebar_control.estimation.covariance import ERRORS, SIZE
from fivebar_control.estimation.ekf import Belief, Estimate, filter_model
from fivebar_control.estimation.mirror import (
    AmbiguityLimits,
    Mirror,
    ambiguity_reason,
    check_ambiguity,
    deviations,
    mirror_distance,
    mirrored,
)
from fivebar_control.estimation.platform_motion import leg_motion
from fivebar_control.estimation.settings import EkfSettings
from fivebar_control.loop.closed_loop import FAULT_NAMES
from fivebar_control.model.geometry import direct_geometry, inverse_geometry
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_description.parameters import FiveBar

MODES = (1, -1)
SURE = np.diag([1e-8, 1e-8, 1e-6, 1e-6, 1e-4, 1e-4, 1e-6, *(0.0,) * (SIZE - ERRORS)])
DOWN = [[0.0, 0.15], [0.0, 0.02]]
ASIDE = [[-0.025, 0.025], [-0.025, 0.125]]


def reasons(robot: FiveBar, beliefs: list[Belief], mirror_deviations: float = 5.0) -> list[str | None]:
    """Return for each of consecutive samples why its belief is ambiguous, None where it is not."""
    model, limits = filter_model(robot, MODES, 500, EkfSettings()), AmbiguityLimits(mirror_deviations, 0.2)
    found: list[str | None] = []
    near = 0
    for belief in beliefs:
        check = check_ambiguity(model, limits, near, belief)
        near = check.near
        found.append(ambiguity_reason(model, limits, check) if check.ambiguous else None)
    return found


@pytest.mark.parametrize(("x", "y"), [(0.01, 0.12), (-0.02, 0.09), (0.0, 0.08), (0.01, 0.05)])
def test_the_mirrored_platform_has_the_same_motor_angles_and_speeds(dextar: FiveBar, x: float, y: float) -> None:
    vx, vy, step = 0.2, -0.3, 1e-6

    def other(t: float) -> tuple[float, float]:
        place = (x + vx * t, y + vy * t)
        q = inverse_geometry(dextar, MODES, *place)
        assembly = 1 if det_a(state_from_platform(dextar, MODES, *place, 0.0, 0.0)) > 0.0 else -1
        return direct_geometry(dextar, -assembly, q.q11, q.q21)

    belief = Belief(Estimate(x, y, vx, vy, 0.0, 0.0), SURE)
    legs = (leg_motion(leg, mode, x, y, vx, vy) for leg, mode in zip(dextar[:2], MODES, strict=True))
    found = mirrored(dextar, *legs, belief)
    assert found is not None
    here, ahead, behind = other(0.0), other(step), other(-step)
    normal = np.array([found.normal_x, found.normal_y])
    np.testing.assert_allclose(np.array(here) - (x, y), found.position * normal, atol=1e-12)
    rate = (np.array(ahead) - np.array(behind)) / (2.0 * step) - (vx, vy)
    assert float(rate @ normal) == pytest.approx(found.velocity, abs=1e-5)


def test_deviations_are_the_distance_in_units_of_the_covariance() -> None:
    random = np.random.default_rng(3)
    for _ in range(20):
        root = random.normal(size=(SIZE, SIZE))
        covariance = root @ root.T
        angle = random.uniform(0.0, math.pi)
        normal = np.array([math.cos(angle), math.sin(angle)])
        pick = np.zeros((2, SIZE))
        pick[0, :2] = pick[1, 2:4] = normal
        difference = random.normal(size=2)
        expected = math.sqrt(difference @ np.linalg.solve(pick @ covariance @ pick.T, difference))
        found = deviations(Mirror(*normal.tolist(), *difference.tolist()), covariance)
        assert found == pytest.approx(expected, rel=1e-9)


def test_at_rest_on_the_locus_both_modes_are_one_and_far_from_it_nothing_is_ambiguous(dextar: FiveBar) -> None:
    on_locus = Estimate(0.0, math.sqrt(0.0081 - 0.000961 - 1e-12), 0.0, 0.0, 0.0, 0.0)
    (reason,) = reasons(dextar, [Belief(on_locus, SURE)])
    assert "the other assembly mode is 0.0 standard deviations away" in (reason or "")
    # with 0.25 m/s, and a velocity known to 1 mm/s, the two are 500 standard deviations apart
    assert reasons(dextar, [Belief(on_locus._replace(vy=-0.25), SURE)]) == [None]
    away = on_locus._replace(y=0.12)
    assert reasons(dextar, [Belief(away, SURE)] * 500) == [None] * 500


def test_one_distance_is_that_of_the_check(dextar: FiveBar) -> None:
    """Of a belief by itself, and of one in a row of samples: the same, and infinite where nothing is tested."""
    model = filter_model(dextar, MODES, 500, EkfSettings())
    away = Belief(Estimate(0.0, 0.1, 0.0, 0.0, 0.0, 0.0), SURE)
    assert check_ambiguity(model, AmbiguityLimits(5.0, 0.2), 7, away) == (0, math.inf, False)
    for y, tested in ((0.0846, True), (0.0875, True), (0.1, False)):
        belief = Belief(Estimate(0.002, y, 0.03, -0.1, 0.0, 0.0), SURE)
        distance = mirror_distance(model, belief)
        assert distance == check_ambiguity(model, AmbiguityLimits(5.0, 0.2), 0, belief).deviations
        assert math.isfinite(distance) == tested


def test_where_both_elbows_coincide_there_is_no_line_to_mirror_in(dextar: FiveBar) -> None:
    """Every direction of the platform has the same motor angles: the assembly mode is not known."""
    robot = dextar._replace(
        leg1=dextar.leg1._replace(base_x=-0.25, proximal=0.5), leg2=dextar.leg2._replace(base_x=0.25, proximal=0.5)
    )
    leg = leg_motion(dextar.leg1, 1, 0.0, 0.1, 0.0, 0.0)
    one, two = leg._replace(r_x=0.5, r_y=0.75), leg._replace(r_x=-0.5, r_y=0.75)
    belief = Belief(Estimate(0.0, 0.5, 0.0, 0.0, 0.0, 0.0), SURE)
    assert mirrored(robot, one, two, belief) is None
    assert mirrored(robot, one, two._replace(r_x=-0.25), belief) is not None


def test_a_state_that_is_known_exactly_is_infinitely_far_from_its_mirror_image() -> None:
    assert deviations(Mirror(0.6, 0.8, 1e-3, 1e-3), np.zeros((SIZE, SIZE))) == math.inf


def test_the_default_limits_are_those_of_these_tests() -> None:
    settings = EkfSettings()
    assert (settings.mirror_deviations, settings.dwell_limit) == (5.0, 0.2)


def test_whoever_stays_near_the_locus_is_ambiguous_however_sure(dextar: FiveBar) -> None:
    near = Belief(Estimate(0.0, 0.086, 0.0, 0.0, 0.0, 0.0), SURE)
    found = reasons(dextar, [near] * 102, mirror_deviations=0.0)
    assert found[:100] == [None] * 100
    assert found[100] is not None
    assert found[101] is not None
    assert "1/cond(A) below 0.05 for 0.204 s, limit 0.2 s" in found[101]


def test_whoever_leaves_the_locus_in_between_does_not_stay_there(dextar: FiveBar) -> None:
    """The time counts from the last arrival: twice 0.19 s with a sample away between them are no stay of 0.2 s."""
    near = Belief(Estimate(0.0, 0.086, 0.0, 0.0, 0.0, 0.0), SURE)
    away = Belief(Estimate(0.0, 0.1, 0.0, 0.0, 0.0, 0.0), SURE)
    assert reasons(dextar, 3 * [*[near] * 95, away], mirror_deviations=0.0) == [None] * 288


def test_an_estimate_at_the_limit_of_deviations_is_not_ambiguous(dextar: FiveBar) -> None:
    belief = Belief(Estimate(0.0, 0.0846, 0.0, -0.01, 0.0, 0.0), SURE)
    model = filter_model(dextar, MODES, 500, EkfSettings())
    distance = check_ambiguity(model, AmbiguityLimits(5.0, 0.2), 0, belief).deviations
    assert 1.0 < distance < 100.0
    for limit, ambiguous in ((distance, False), (math.nextafter(distance, math.inf), True)):
        assert check_ambiguity(model, AmbiguityLimits(limit, 0.2), 0, belief).ambiguous == ambiguous


@pytest.mark.parametrize("controller", long_if_seldom_compiled(["unified", "multi_cartesian"]))
@pytest.mark.parametrize("plant", [{}, OFF_MODEL], ids=["as believed", "off"])
@pytest.mark.parametrize(
    ("duration", "ambiguous"), [(0.5, False), (1.0, False), (2.0, False), (3.0, False), (12.0, True), (15.0, True)]
)
@pytest.mark.parametrize("waypoints", [DOWN, ASIDE], ids=["down", "aside"])
def test_slow_crossings_are_ambiguous_and_ballistic_ones_are_not(
    waypoints: list[list[float]], duration: float, ambiguous: bool, plant: dict[str, float], controller: str
) -> None:
    """In the compiled engine, which has this test of the estimator."""
    fields = {"waypoints": waypoints, "tracking_error_limit": 0.2, "controller": controller}
    scenario = encoder_scenario("middle", duration, plant=plant, **fields)
    outcome, trace = traced_crossing(*prepared(scenario))
    assert FAULT_NAMES[outcome.fault] == ("estimate_ambiguous" if ambiguous else "")
    if ambiguous:
        # from that sample on there is no torque
        commands = columns(trace, "command1", "command2")
        assert not commands[outcome.fault_sample :].any()
        assert commands[outcome.fault_sample - 1].all()


@pytest.mark.extra
@pytest.mark.parametrize(("way", "duration", "faults"), [(0.13, 2.0, []), (0.03, 2.8, ["estimate_ambiguous"])])
def test_the_whole_estimator_finds_nothing_else(way: float, duration: float, faults: list[str]) -> None:
    """With all its checks, fast and slow; the slow one moves through the middle as if it took 12 s from end to end."""
    waypoints = [[0.0, 0.085 + way / 2.0], [0.0, 0.085 - way / 2.0]]
    scenario = encoder_scenario("middle", duration, plant=OFF_MODEL, waypoints=waypoints, tracking_error_limit=0.2)
    run = simulate(scenario)
    assert [fault.partition(":")[0] for fault in run.faults] == faults
    if faults:
        number = int(run.faults[0].split()[3].rstrip(":"))
        assert all(sample.command == (0.0, 0.0) for sample in run.samples[number:])
        assert run.samples[number - 1].command != (0.0, 0.0)


@pytest.mark.parametrize("controller", long_if_seldom_compiled(["unified", "multi_cartesian"]))
@pytest.mark.parametrize(
    ("duration", "friction", "mass", "inertia"),
    [(5.0, 1.2, 0.9, 1.1), (4.0, 0.5, 1.0, 1.0), (5.0, 1.5, 1.2, 1.0), (8.0, 0.8, 1.1, 0.9), (12.0, 0.8, 1.1, 0.9)],
)
def test_a_wrong_estimate_is_never_passed_on_in_silence(
    duration: float, friction: float, mass: float, inertia: float, controller: str
) -> None:
    """Robots that are not as believed, some of which stop on the locus: no estimate is 2 mm off without the fault."""
    plant = {"friction_scale": friction, "mass_scale": mass, "inertia_scale": inertia}
    fields = {"waypoints": DOWN, "tracking_error_limit": 0.2, "controller": controller}
    scenario = encoder_scenario("middle", duration, plant=plant, **fields)
    assert 0.0 < crossing(*prepared(scenario, stop_at_fault=True)).estimate_error < 2e-3
