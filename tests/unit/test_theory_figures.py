# SPDX-License-Identifier: Apache-2.0
"""Figures that theory, bounds and motions state, worked out again by numbers instead of their formulas."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import linprog

from fivebar_control.laws.gains import UnifiedSettings
from fivebar_control.laws.unified import input_map
from fivebar_control.model.kinematics import state_from_motors, state_from_platform
from fivebar_control.model.singularity import inverse_condition, type1_margin
from fivebar_control.planning.limits import exceeded_share
from fivebar_control.trajectory.planner import plan_motion
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.parameters import FiveBar
from fivebar_sim.effects.settings import PlantSettings, has_effects
from tube import FloatArray, model_along

DOCS = Path(__file__).parents[2] / "docs"
PLANT, THEORY, MOTIONS = (
    (DOCS / name).read_text(encoding="utf-8") for name in ("theory.md", "bounds.md", "motions.md")
)
SERIAL_MARGIN = 0.15


def stated(pattern: str, text: str = THEORY) -> list[float]:
    """Return the numbers that the groups of a pattern find in the one place of a page where it fits."""
    (found,) = re.findall(pattern, text)
    return [float(number) for number in ((found,) if isinstance(found, str) else found)]


def per_kappa(robot: FiveBar) -> FloatArray:
    """Return [2], the acceleration along t_s by each motor's torque and kappa at the centre."""
    height = math.sqrt(0.09**2 - 0.031**2)
    above = state_from_platform(robot, (1, -1), 0.0, height + 1e-5, 0.0, 0.0)
    mapped = input_map(robot, above)
    assert mapped is not None
    # t_s is vertical there
    return np.array([mapped.g_y1, mapped.g_y2]) / inverse_condition(above)


def test_a_load_is_held_by_two_motors_each_up_to_its_own_limit(dextar: FiveBar) -> None:
    by_motor = per_kappa(dextar)
    # torques in the square of side 2 Nm, tried one by one
    sides = np.linspace(-1.0, 1.0, 21)
    held = max(abs(by_motor @ (one, two)) for one in sides for two in sides)
    gamma, euclidean = stated(
        r"entries of \$t_s\^T G/\\kappa\$, ([\d.]+) \(m/s²\)/Nm at the centre of\s+DexTAR."
        r" \(Their Euclidean norm, ([\d.]+),"
    )
    assert gamma == pytest.approx(held, rel=2e-3)
    assert euclidean == pytest.approx(np.linalg.norm(by_motor), rel=2e-3)
    rates = stated(
        r"the platform by 2 mm from \$\\dot\\kappa\$ = ([\d.]+) /s on, 2 N from ([\d.]+) /s on\."
        r" The middle crossing has ([\d.]+) /s"
    )
    for force, rate in zip((1.0, 2.0), rates, strict=False):
        assert moved(force / dextar.mass, held * rate, 1e-5) == pytest.approx(2e-3, rel=0.06)
    plan = plan_motion(dextar, (1, -1), ((0.0, 0.15), (0.0, 0.02)), [1.0], 500, ZoneRule())
    assert rates[2] == pytest.approx(plan.crossings[0].kappa_rate, rel=0.02)


def moved(load: float, grip: float, step: float) -> float:
    """Return how far (m) a load (m/s^2) moves a platform that the motors oppose with grip |t| (m/s^3) at most."""
    t, x, v = -load / grip, 0.0, 0.0
    while t < load / grip or v > 0.0:
        v += step * (load - grip * abs(t))
        x += step * v
        t += step
    return x


def least_displacement(known: float, lasts: bool = False, step: float = 0.05, end: float = 4.0) -> float:
    """Return the least of the largest |eta|, eta'' = load + u |s| with |u| <= 1, over all u from `known` before -1 on.

    In units of a_F t_F^2 and t_F; the platform is on its reference and at rest relative to it at the beginning, and at
    rest at the end.
    """
    edges = np.arange(-1.0 - known, end, step)
    middles = edges[:-1] + 0.5 * step
    load = np.where(lasts | (middles > -1.0), 1.0, 0.0)
    before = np.arange(len(edges))[:, None] - np.arange(len(middles))[None, :]
    place = np.where(before > 0, step * step * (before - 0.5), 0.0)
    one = np.ones((len(edges), 1))
    found = linprog(
        np.append(np.zeros(len(middles)), 1.0),
        A_ub=np.block([[place, -one], [-place, -one]]),
        b_ub=np.zeros(2 * len(edges)),
        A_eq=np.append(np.full(len(middles), step), 0.0)[None, :],
        b_eq=[0.0],
        bounds=[*zip(load - abs(middles), load + abs(middles), strict=True), (0.0, None)],
    )
    return float(found.fun)


def test_who_knows_a_load_beforehand_is_displaced_less_than_the_theorem_says() -> None:
    rows = re.findall(r"^\| (?:begins|known|lasts).* \| ([\d./]+) \|$", THEORY, flags=re.MULTILINE)
    table = [1.0 / 3.0 if row == "1/3" else float(row) for row in rows]
    found = [least_displacement(known) for known in (0.0, 0.25, 0.5, 1.0, 2.0)] + [least_displacement(3.0, lasts=True)]
    assert found == pytest.approx(table, rel=0.01)
    assert found[0] == pytest.approx(1.0 + 2.0 * math.sqrt(2.0) / 3.0, rel=1e-3)


def test_two_loads_exceed_their_shares_less_often_than_one_does() -> None:
    random = np.random.default_rng(0)
    tilt, push = random.uniform(0.0, 1.0, (2, 400_000)) * np.cos(random.uniform(0.0, 2.0 * math.pi, (2, 400_000)))
    low, high = stated(r"\b0.1 means ([\d.]+) %, and 0.25 means ([\d.]+) %", MOTIONS)
    for risk, percent in ((0.1, low), (0.25, high)):
        beyond = np.mean(0.5 * abs(tilt + push) > exceeded_share(risk))
        assert 100.0 * beyond == pytest.approx(percent, abs=0.15)
    (bound,) = stated(r"is an upper bound up to ([\d.]+):", MOTIONS)
    for share in (0.5, 0.7, 0.9):
        assert np.mean(abs(share * tilt + (1.0 - share) * push) > exceeded_share(bound)) < bound


def growth(share: float | FloatArray, kp: float, kd: float) -> float | FloatArray:
    """Return mu (1/s) of the bound, for the larger eigenvalue of Q."""
    return kp / kd * np.maximum(-1.0, 1.0 - kd * kd / kp * (1.0 - share))


def test_errors_grow_no_faster_than_the_bound_however_q_turns() -> None:
    """e'' = -(I - Q)(K_d e' + K_p e) + f, for the gains of the law and those of the rig `good`."""
    random = np.random.default_rng(3)
    for kp, kd in ((6400.0, 160.0), (2500.0, 100.0), (3600.0, 100.0)):
        c, step = kp / kd, 1e-4
        for _ in range(20):
            rates, shares = random.uniform(-300.0, 300.0), random.uniform(0.0, 1.0, 2)
            error, speed, bound = random.normal(size=2), c * random.normal(size=2), 0.0
            bound = math.hypot(*(c * error), *(speed + c * error))
            for number in range(400):
                angle = rates * step * number
                # what the law gives up falls and rises as through a locus
                q = shares * math.exp(-(((number - 200) / 80.0) ** 2))
                turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
                kept = turn @ np.diag(1.0 - q) @ turn.T
                force = 3.0 * random.normal(size=2)
                middle_error = error + 0.5 * step * speed
                middle_speed = speed + 0.5 * step * (force - kept @ (kd * speed + kp * error))
                error = error + step * middle_speed
                speed = speed + step * (force - kept @ (kd * middle_speed + kp * middle_error))
                mu = float(growth(float(np.max(q)), kp, kd))
                bound = bound * math.exp(mu * step) + step * math.exp(abs(mu) * step) * float(np.linalg.norm(force))
                assert math.hypot(*(c * error), *(speed + c * error)) <= 1.001 * bound


@pytest.mark.parametrize("drawn", ["plane", "angles"])
def test_the_common_lyapunov_function_holds_in_nearly_every_posture(dextar: FiveBar, drawn: str) -> None:
    random = np.random.default_rng(1)
    least, kappas = [], []
    while len(least) < 3000:
        one, other = random.choice([1, -1], 2).tolist()
        if drawn == "plane":
            place = random.uniform((-0.25, -0.2), (0.25, 0.2)).tolist()
            state = state_from_platform(dextar, (one, other), *place, 0.0, 0.0)
        else:
            state = state_from_motors(dextar, one, *random.uniform(-math.pi, math.pi, 2).tolist(), 0.0, 0.0)
        if type1_margin(state) > SERIAL_MARGIN:
            mapped = input_map(dextar, state)
            assert mapped is not None
            least.append(np.linalg.svd(np.array(mapped[:4]).reshape(2, 2), compute_uv=False)[1] ** 2)
            kappas.append(inverse_condition(state))
    settings = UnifiedSettings()
    given_up = settings.weight / (np.array(least) + settings.weight)
    falls = growth(given_up, settings.kp, settings.kd) < 0.0
    plane = stated(r"that is ([\d.]+) ± [\d.]+ % of\s+the postures .* in the plane, and ([\d.]+) % of those off")
    everywhere, off = plane if drawn == "plane" else stated(r"in the motors' angles, ([\d.]+) and ([\d.]+) %")
    assert 100.0 * np.mean(falls) == pytest.approx(everywhere, abs=1.0)
    assert 100.0 * np.mean(falls[np.array(kappas) > 0.06]) == pytest.approx(off, abs=0.3)
    if drawn == "plane":
        # the norm of e and e + e' / w, which takes all directions for the worst, falls in half of them
        assert np.mean(2.12 * given_up < 0.5) < 0.65


def test_the_factors_of_the_middle_crossing_are_those_of_its_reference(dextar: FiveBar) -> None:
    settings, period = UnifiedSettings(), 2e-3
    c = settings.kp / settings.kd
    (once,) = re.findall(r"at most ([\d.]+), ([\d.]+) and ([\d.]+) on the middle crossing", THEORY)
    (locally,) = re.findall(r"the factors become ([\d.]+), ([\d.]+) and ([\d.]+)\.", THEORY)
    (shares,) = re.findall(r"\$q_w L\$ is at most (\d+) %, (\d+) % and (\d+) % of \$\\omega_c\$", THEORY)
    for duration, *figures in zip((0.5, 1.0, 2.0), once, locally, shares, strict=True):
        plan = plan_motion(dextar, (1, -1), ((0.0, 0.15), (0.0, 0.02)), [duration], 500, ZoneRule())
        along = model_along(dextar, plan, 500, 1)
        least = np.linalg.svd(along.inputs, compute_uv=False)[:, 1]
        given_up = settings.weight / (least**2 + settings.weight)
        by_place, by_speed = (np.linalg.norm(part, 2, axis=(1, 2)) for part in np.split(along.slopes, 2, axis=2))
        # e = z_1 / c and e' = z_2 - z_1
        slope = given_up * np.hypot(by_place / c + by_speed, by_speed)
        mu = np.asarray(growth(given_up, settings.kp, settings.kd))
        sums = [np.concatenate(([0.0], np.cumsum(period * rate))) for rate in (mu, mu + slope)]
        factors = [float(np.exp(np.max(total - np.minimum.accumulate(total)))) for total in sums]
        assert factors == pytest.approx([float(one) for one in figures[:2]], rel=0.04)
        assert 100.0 * np.max(slope) / c == pytest.approx(float(figures[2]), abs=0.5)


def test_the_simulated_robot_has_the_effects_that_are_said_and_none_by_default() -> None:
    said = (
        "Elasticity, backlash, clearance, further friction, and the motors' ripple, cogging and current loops are [eff"
    )
    assert said in " ".join(PLANT.split())
    plant = PlantSettings()
    assert plant.transmission.backlash == plant.platform_joint.clearance == 0.0
    assert plant.motors.ripple == plant.motors.cogging == 0.0
    assert not has_effects(plant)
    for changed in (
        plant._replace(transmission=plant.transmission._replace(frequency=60.0)),
        plant._replace(transmission=plant.transmission._replace(frequency=60.0, backlash=1e-4)),
        plant._replace(platform_joint=plant.platform_joint._replace(stiffness=1e5, clearance=1e-5)),
    ):
        assert has_effects(changed)
