# SPDX-License-Identifier: Apache-2.0
"""The run that a plan is predicted to become, by the compiled engine."""

from __future__ import annotations

import math

import numpy as np

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import Case, case_of
from fivebar_bringup.simulation.engine import traced_crossing
from fivebar_bringup.simulation.engine_table import TraceRow
from fivebar_control.laws.registry import TunedController
from fivebar_control.loop.sampled_plan import X, Y, sampled
from fivebar_control.planning.feasibility import is_predictable
from fivebar_control.planning.predicted_run import (
    Peak,
    PredictedRun,
    PredictedSample,
    judged_by,
    predict_run,
    prediction_settings,
)
from fivebar_control.safety.stages import NO_FAULT
from fivebar_control.trajectory.path_distance import TIMED
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar, without_cogging
from fivebar_sim.effects.settings import PlantSettings

PLACE = [TraceRow._fields.index(name) for name in ("estimated_x", "estimated_y")]

MOMENT = [
    TraceRow._fields.index(name)
    for name in ("estimated_x", "estimated_y", "estimated_vx", "estimated_vy", "command1", "command2")
]

DET_A = TraceRow._fields.index("det_a")

REQUESTED = [TraceRow._fields.index(name) for name in ("requested1", "requested2")]


def predict_on_engine(
    scenario: Scenario,
    robot: FiveBar,
    plan: Plan,
    rate_hz: int,
    follower: TunedController,
    torque_limit: float,
    judge: str = TIMED,
) -> PredictedRun:
    """Return what `predict_run` does for the robot of a scenario, by the compiled engine where that can.

    The engine predicts a plan up to the end of the motion, and none that is planned in the motors' angles in part.
    """
    if not is_predictable(plan):
        return predict_run(robot, plan, rate_hz, follower, torque_limit, judge)
    samples = sampled(robot, plan, rate_hz, scenario.lead_samples)
    rows = samples.rows[: len(samples.rows) - scenario.lead_samples]
    perfect = {"plant": PlantSettings(torque_limit=torque_limit), "estimator": "none", "rate_hz": rate_hz}
    numbers = case_of(scenario.model_copy(update=perfect), stop_at_fault=True).numbers
    # the plant of the prediction does not cog
    control = prediction_settings(without_cogging(robot), plan, rate_hz, follower, torque_limit)
    nothing = np.zeros(len(rows), dtype=np.bool_)
    numbers = numbers._replace(control=control, lost=nothing, missing=nothing)
    outcome, trace = traced_crossing(Case(follower.controller, numbers), samples._replace(rows=rows))
    places = trace[:, PLACE]
    distances = np.hypot(*(places - rows[: len(trace), [X, Y]]).T)
    requests = np.max(np.abs(trace[:, REQUESTED]), axis=1)
    signs = np.sign(trace[:, DET_A])
    changes = np.flatnonzero(signs[1:] * signs[:-1] < 0.0) + 1

    def peak(value: float, sample: int) -> Peak:
        x, y = places[sample].tolist()
        return Peak(value, sample / rate_hz, x, y)

    worst, largest = int(np.argmax(distances)), int(np.argmax(np.nan_to_num(requests, nan=math.inf)))
    lost = outcome.fault != NO_FAULT
    predicted = PredictedRun(
        error=peak(math.inf, len(trace) - 1) if lost else peak(float(distances[worst]), worst),
        torque=peak(float(requests[largest]), largest),
        mode_changes=peak(float(outcome.mode_changes), int(changes[-1]) if changes.size else 0),
        moments=tuple(PredictedSample(*row) for row in trace[:, MOMENT].tolist()),
    )
    return judged_by(judge, predicted, plan, rate_hz)
