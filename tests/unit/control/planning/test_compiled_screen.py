# SPDX-License-Identifier: Apache-2.0
"""The screen's functions of whole runs as machine code: bit for bit what the plain ones find."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fivebar_control import compiling
from fivebar_control.estimation.settings import Drives, EkfSettings, Sensing
from fivebar_control.laws.reference import Reference
from fivebar_control.laws.registry import CONTROLLERS, default_tuning
from fivebar_control.planning.passage import displacement
from fivebar_control.planning.predicted_estimate import predict_estimate
from fivebar_control.planning.predicted_run import predict_run
from fivebar_control.planning.reference_scan import samples_of
from fivebar_control.trajectory.desired import (
    REFERENCE_VALUES,
    desired_along,
    desired_at,
    reference_of,
    write_reference,
)
from fivebar_control.trajectory.path import StraightWay, locus_fractions, write_determinants
from fivebar_control.trajectory.path_distance import PATH, TIMED
from fivebar_control.trajectory.planner import Plan, plan_motion
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.loads import Loads
from fivebar_description.parameters import FiveBar
from fivebar_description.sensors import PassiveEncoder
from fivebar_description.tolerances import Tolerances

RATE_HZ = 500
FOLLOWER = default_tuning(CONTROLLERS["unified"])


@pytest.fixture
def plan(dextar: FiveBar) -> Plan:
    """Return a motion through the locus."""
    return plan_motion(dextar, (1, -1), ((0.0, 0.12), (0.0, 0.05)), [0.5], RATE_HZ, ZoneRule())


@pytest.fixture(autouse=True)
def as_in_a_sweep(monkeypatch: pytest.MonkeyPatch) -> None:
    """Judge motions by machine code, as a process of a sweep does."""
    monkeypatch.setattr(compiling, "_many_motions", True)


def test_only_who_judges_many_motions_loads_machine_code(monkeypatch: pytest.MonkeyPatch) -> None:
    assert compiling.as_machine_code(write_determinants) is not write_determinants
    monkeypatch.setattr(compiling, "_many_motions", False)
    assert compiling.as_machine_code(write_determinants) is write_determinants
    compiling.expect_many_motions()
    assert compiling.as_machine_code(write_determinants) is not write_determinants


@pytest.fixture
def plainly(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[], Any]], Any]:
    """Return what has something worked out by plain functions."""

    def worked_out(found: Callable[[], Any]) -> Any:
        with monkeypatch.context() as patch:
            patch.setattr(compiling, "_many_motions", False)
            return found()

    return worked_out


def test_where_a_way_crosses_the_locus(
    dextar: FiveBar, plan: Plan, plainly: Callable[[Callable[[], Any]], Any]
) -> None:
    segment = plan.path.straight(0)
    way = StraightWay(segment.start_x, segment.start_y, segment.end_x, segment.end_y)

    def places() -> tuple[float, ...]:
        locus_fractions.cache_clear()
        return locus_fractions(dextar, plan.mode, way)

    found = places()
    assert len(found) == 1
    assert repr(found) == repr(plainly(places))


def times_of(plan: Plan) -> list[float]:
    return [number / RATE_HZ for number in range(plan.path.samples(RATE_HZ) + 1)]


def test_the_reference_and_what_counts_of_it(
    dextar: FiveBar, plan: Plan, plainly: Callable[[Callable[[], Any]], Any]
) -> None:
    rows = desired_along(dextar, plan, times_of(plan))
    assert rows.tobytes() == plainly(lambda: desired_along(dextar, plan, times_of(plan))).tobytes()
    assert repr(samples_of(dextar, rows)) == repr(plainly(lambda: samples_of(dextar, rows)))
    t = times_of(plan)[100]
    assert repr(reference_of(rows[100].tolist())) == repr(desired_at(dextar, plan, t, plan.path.at(t)))


def test_a_reference_by_motors_has_its_own_torque_and_no_margin_to_type_1(dextar: FiveBar, plan: Plan) -> None:
    row = np.empty(REFERENCE_VALUES)
    given: Reference = desired_at(dextar, plan, 0.2, plan.path.at(0.2))._replace(by_motors=True, u1=0.3, u2=-0.4)
    write_reference(given, row)
    (sample,) = samples_of(dextar, row.reshape(1, -1))
    assert sample.torque == max(abs(0.3 + given.f1), abs(-0.4 + given.f2))
    assert sample.serial == math.inf


@pytest.mark.extra
@pytest.mark.parametrize(("controller", "judge"), [("unified", TIMED), ("unified", PATH), ("multi_cartesian", TIMED)])
def test_the_response_to_loads(
    dextar: FiveBar, plan: Plan, plainly: Callable[[Callable[[], Any]], Any], controller: str, judge: str
) -> None:
    loads = Loads(tilt=0.01, passive=1e-3, push=0.5, push_length=0.02)

    def moved() -> float:
        return displacement(dextar, plan, RATE_HZ, default_tuning(CONTROLLERS[controller]), 2.0, loads, judge).value

    found = moved()
    assert found > 0.0
    assert repr(found) == repr(plainly(moved))


@pytest.mark.extra
@pytest.mark.parametrize("judge", [TIMED, PATH])
def test_the_worth_of_an_estimate(
    dextar: FiveBar, plan: Plan, plainly: Callable[[Callable[[], Any]], Any], judge: str
) -> None:
    predicted = predict_run(dextar, plan, RATE_HZ, FOLLOWER, 2.0)
    settings = EkfSettings(gyro=True, camera=True)
    tolerances, encoder = Tolerances(length=2e-4, zero=1e-3), PassiveEncoder(1, 20_000)
    sensing = Sensing(RATE_HZ, Drives(20_000), settings, tolerances, encoder, gyro_every=2, camera_every=10)
    found = predict_estimate(dextar, plan, sensing, predicted, judge)
    plain = plainly(lambda: predict_estimate(dextar, plan, sensing, predicted, judge))
    # matrix products may come from two libraries
    assert np.array(found.mirror) == pytest.approx(np.array(plain.mirror), rel=1e-9)
    assert np.array(found.position) == pytest.approx(np.array(plain.position), rel=1e-9)
