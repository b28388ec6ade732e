# SPDX-License-Identifier: Apache-2.0
"""A run whose torques come from outside is the engine's run, sample by sample."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fivebar_bringup.simulation.case import Case, FloatArray, case_of
from fivebar_bringup.simulation.engine import traced_crossing
from fivebar_bringup.simulation.engine_table import columns_of
from fivebar_bringup.simulation.observation import Observation
from fivebar_bringup.simulation.stepped_run import (
    OUTSIDE,
    Seen,
    SteppedRun,
    columns_observed,
    observed,
    outside_case,
)
from fivebar_control.loop.closed_loop import PLANT_DIVERGED
from fivebar_control.loop.sampled_plan import Sampled, sampled
from fivebar_control.safety.stages import NO_FAULT, TORQUE_UNDEFINED
from fivebar_studies.benchmark.crossings import benchmark
from fivebar_studies.sweep.drawing import plan_of

NUMBER = 1
"""A crossing of 0.438 s."""


def prepared(rig: str) -> tuple[Case, Sampled, Case]:
    """The crossing on the robot of a rig: its case for torques from outside, its plan, and its case by `unified`."""
    draw = benchmark()[NUMBER].on(rig)
    scenario = draw.scenario(OUTSIDE)
    plan = sampled(scenario.five_bar(), plan_of(draw), scenario.rate_hz)
    by_law = draw.scenario("unified").model_copy(update={"estimator": "none"})
    return outside_case(scenario), plan, case_of(by_law)


def seen_of(run: SteppedRun) -> Seen:
    return Seen(*run.seen.tolist())


def repeated(run: SteppedRun, torques: FloatArray) -> FloatArray:
    """What is seen at each sample of a run to which torques are given."""
    rows = []
    for one in torques:
        rows.append(run.seen.copy())
        run.torque[:] = one
        run.step()
    return np.array(rows)


@pytest.mark.parametrize("rig", ["ideal", "calibrated"])
def test_the_torques_of_a_law_from_outside_make_its_run_again(rig: str) -> None:
    case, plan, by_law = prepared(rig)
    outcome, table = traced_crossing(by_law, plan)
    row = columns_of(table)
    run = SteppedRun(case, plan)
    rows = repeated(run, np.column_stack((row.requested1, row.requested2)))
    assert run.finished and run.outcome() == outcome
    assert (
        rows[:, [Seen._fields.index(name) for name in ("q11", "q21")]].tobytes()
        == np.column_stack((row.read1, row.read2)).tobytes()
    )
    distances = np.hypot(row.x - plan.rows[:, 0], row.y - plan.rows[:, 1])
    assert rows[:, Seen._fields.index("distance")] == pytest.approx(distances, abs=1e-15)
    assert rows[-1, Seen._fields.index("farthest")] == pytest.approx(outcome.error_peak, abs=1e-15)
    before = run.seen.copy()
    run.step()
    assert run.seen.tobytes() == before.tobytes(), "nothing comes after the last sample"


def test_plain_python_sees_the_same_as_machine_code() -> None:
    case, plan, _ = prepared("ideal")
    torques = np.random.default_rng(3).uniform(-0.2, 0.2, (20, 2))
    plain, fast = (repeated(SteppedRun(case, plan, compiled=one), torques) for one in (False, True))
    assert plain == pytest.approx(fast, rel=1e-9, abs=1e-12)


def test_a_sample_shows_its_task() -> None:
    case, plan, _ = prepared("encoders")
    crossing, run = benchmark()[NUMBER], SteppedRun(case, plan)
    seen = seen_of(run)
    assert (seen.x, seen.y) == pytest.approx((crossing.start_x, crossing.start_y))
    assert (seen.goal_x, seen.goal_y) == pytest.approx((crossing.end_x, crossing.end_y))
    assert (seen.mode1, seen.mode2) == (crossing.mode1, crossing.mode2)
    assert seen.time_left == pytest.approx(crossing.duration)
    # the drives obey one sample later
    run.torque[:] = 0.5, 0.5
    run.step()
    assert seen_of(run)[:8] == seen[:8]
    for _ in range(9):
        run.step()
    later = seen_of(run)
    count = math.tau / case.numbers.equipment.encoder_counts  # type: ignore[operator]
    counts = (later.q11 - seen.q11) / count
    assert counts == pytest.approx(round(counts), abs=1e-6) and abs(counts) >= 3
    assert later.dq11 / (500 * count) == pytest.approx(round(later.dq11 / (500 * count)), abs=1e-6)
    assert later.time_left == pytest.approx(crossing.duration - 10 / 500)


def test_the_motors_encoders_leave_out_the_passive_joints() -> None:
    everything, motors = observed(Observation.ALL), observed(Observation.ENCODERS)
    assert (len(everything), len(motors)) == (19, 15)
    assert [name for name in everything if name not in motors] == ["q12", "q22", "dq12", "dq22"]
    assert [Seen._fields[column] for column in columns_observed(Observation.ENCODERS)] == motors


def test_the_guard_stops_the_robot_and_the_run_goes_on_to_its_end() -> None:
    case, plan, _ = prepared("ideal")
    run = SteppedRun(case, plan)
    run.torque[0] = math.nan
    run.step()
    assert run.fault == TORQUE_UNDEFINED and not run.finished
    while not run.finished:
        run.step()
    outcome = run.outcome()
    assert (outcome.fault, outcome.fault_sample, outcome.samples) == (TORQUE_UNDEFINED, 0, len(plan.rows))


def test_a_motion_that_is_too_fast_to_be_simulated_ends_the_run() -> None:
    """Links that are nearly without inertia, turned by drives without limits, which no guard stops."""
    case, plan, _ = prepared("ideal")
    limits = case.numbers.control.limits._replace(
        torque_limit=math.inf, joint_speed=math.inf, tracking_error=math.inf, torque_request=math.inf, type1_margin=0.0
    )
    numbers = case.numbers._replace(
        control=case.numbers.control._replace(limits=limits),
        equipment=case.numbers.equipment._replace(torque_limit=math.inf),
    )
    run = SteppedRun(case._replace(numbers=numbers), plan)
    assert run.fault == NO_FAULT
    run.torque[:] = 1e6, -1e6
    run.step()
    assert run.fault == PLANT_DIVERGED and run.finished
    assert (run.outcome().samples, run.outcome().applied1) == (1, 1e6)
