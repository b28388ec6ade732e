"""The predicted run on the compiled engine: for studies, to which the interpreted prediction is too slow."""

from __future__ import annotations

import math

import numpy as np

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import Sampled, X, Y, case_of
from fivebar_bringup.simulation.outcome import TraceRow
from fivebar_bringup.simulation.uncompiled import traced_crossing
from fivebar_control.planning.predicted_run import LOST, Peak, PredictedRun, PredictedSample
from fivebar_control.safety.stages import NO_FAULT, SafetySettings
from fivebar_description.parameters import without_cogging
from fivebar_sim.effects.settings import PlantSettings

PLACE = [TraceRow._fields.index(name) for name in ("estimated_x", "estimated_y")]
MOMENT = [
    TraceRow._fields.index(name)
    for name in ("estimated_x", "estimated_y", "estimated_vx", "estimated_vy", "command1", "command2")
]
ANGLES = [TraceRow._fields.index(name) for name in ("q11", "q12", "q21", "q22")]
REQUESTED = [TraceRow._fields.index(name) for name in ("requested1", "requested2")]


def predicted_on_engine(scenario: Scenario, samples: Sampled) -> PredictedRun:
    """Return what becomes of a scenario on the robot as modelled, up to the end of the motion.

    Args:
        scenario: of which robot, controller and torque limit count.
        samples: its sampled plan; a lead is left out.
    """
    perfect = scenario.model_copy(
        update={
            "plant": PlantSettings(torque_limit=scenario.plant.torque_limit),
            "estimator": "none",
            "safety": SafetySettings(
                torque_limit=scenario.safety.torque_limit, request_ratio=math.inf, type1_margin=0.0
            ),
            "tracking_error_limit": LOST,
        }
    )
    rate_hz, rows = scenario.rate_hz, samples.rows[: len(samples.rows) - scenario.lead_samples]
    case = case_of(perfect, stop_at_fault=True)
    control = case.numbers.control
    # the plant of the prediction does not cog
    known = case.numbers._replace(control=control._replace(robot=without_cogging(control.robot)))
    outcome, trace = traced_crossing(case._replace(numbers=known), samples._replace(rows=rows))
    places = trace[:, PLACE]
    distances = np.hypot(*(places - rows[: len(trace), [X, Y]]).T)
    requests = np.max(np.abs(trace[:, REQUESTED]), axis=1)
    # det A = sin(theta_2 - theta_1), theta_i = q_i1 + q_i2
    q11, q12, q21, q22 = trace[:, ANGLES].T
    signs = np.sign(np.sin(q21 + q22 - q11 - q12))
    changes = np.flatnonzero(signs[1:] * signs[:-1] < 0.0) + 1

    def peak(value: float, sample: int) -> Peak:
        x, y = places[sample].tolist()
        return Peak(value, sample / rate_hz, x, y)

    worst, largest = int(np.argmax(distances)), int(np.argmax(np.nan_to_num(requests, nan=math.inf)))
    lost = outcome.fault != NO_FAULT
    return PredictedRun(
        error=peak(math.inf, len(trace) - 1) if lost else peak(float(distances[worst]), worst),
        torque=peak(float(requests[largest]), largest),
        mode_changes=peak(float(outcome.mode_changes), int(changes[-1]) if changes.size else 0),
        moments=tuple(PredictedSample(*row) for row in trace[:, MOMENT].tolist()),
    )
