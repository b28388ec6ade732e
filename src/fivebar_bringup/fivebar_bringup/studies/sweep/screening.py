"""Plans a case of a sweep, and judges by a controller's screen, with the run predicted by the engine."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import lru_cache
from itertools import count

import numpy as np

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import Sampled, X, Y, case_of, sampled
from fivebar_bringup.simulation.outcome import TraceRow
from fivebar_bringup.simulation.uncompiled import traced_crossing
from fivebar_bringup.studies.sweep.drawing import PLANNED_FOR, RATE_HZ, Draw, plan_of
from fivebar_control.estimation.homing import check_declared
from fivebar_control.planning.feasibility import only_torque, screen, with_prediction, with_reserve, with_sensing
from fivebar_control.planning.figures import Feasibility
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.planning.predicted_run import LOST, Peak, PredictedRun, PredictedSample
from fivebar_control.safety.stages import NO_FAULT, SafetySettings
from fivebar_control.scenario.motion_limits import chosen_limits, given_limits
from fivebar_control.trajectory.path_distance import FloatArray, path_distances
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import without_cogging
from fivebar_description.strict_yaml import InputError
from fivebar_sim.effects.settings import PlantSettings

PLACE = [TraceRow._fields.index(name) for name in ("estimated_x", "estimated_y")]

MOMENT = [
    TraceRow._fields.index(name)
    for name in ("estimated_x", "estimated_y", "estimated_vx", "estimated_vy", "command1", "command2")
]

ANGLES = [TraceRow._fields.index(name) for name in ("q11", "q12", "q21", "q22")]

REQUESTED = [TraceRow._fields.index(name) for name in ("requested1", "requested2")]


def planned(case: Draw) -> Plan:
    """Return the plan of a case, the same for all controllers.

    Raises:
        InputError: the planner refuses the motion, or the estimator its start.
    """
    plan = plan_of(case)
    scenario = case.scenario(PLANNED_FOR)
    if scenario.estimated:
        check_declared(scenario.five_bar(), scenario.homing())
    return plan


def accepted(drawn: Callable[[int], Draw], controller: str = PLANNED_FOR) -> Iterator[Draw]:
    """Yield the cases that planner and screen accept for a controller, without end; `drawn` returns one by its number.

    A case that `drawn` refuses by an `InputError` is left out, too.
    """
    for number in count():
        try:
            case = drawn(number)
            planned(case)
            feasible = screened(case, controller).feasible
        except InputError:
            continue
        if feasible:
            yield case


@lru_cache(maxsize=8)
def screened(case: Draw, controller: str, judge_loads: bool = True) -> Feasibility:
    """Return the screen's judgement of a controller's run of a planned case; predicted where nothing else is.

    The declared loads are judged too, unless the odds decide about them.

    The last ones are remembered: a case is judged when it is timed, and again for its row.
    """
    plan, scenario = plan_of(case), case.scenario(controller)
    limits = limits_for(case, scenario)
    if not judge_loads:
        limits = limits.without_loads()
    verdict = screen(scenario.five_bar(), plan, RATE_HZ, scenario.tuned(), limits)
    if only_torque(verdict, scenario.tuned()):
        weaker = scenario.plant._replace(torque_limit=limits.torque_share * limits.torque)
        spare = predicted_on_engine(scenario.model_copy(update={"plant": weaker}), sampled_case(case))
        verdict = with_reserve(verdict, spare, limits)
    if not verdict.feasible:
        return verdict
    predicted = predicted_on_engine(scenario, sampled_case(case))
    return with_sensing(
        with_prediction(verdict, predicted, plan, limits),
        predicted,
        scenario.five_bar(),
        plan,
        RATE_HZ,
        limits,
        scenario.sensing(),
    )


def limits_for(case: Draw, scenario: Scenario) -> MotionLimits:
    """Return the limits of the screen for a case: with exact sensors those of a motion that is chosen, by a draw."""
    if case.encoder_counts is None:
        return chosen_limits(scenario, torque=case.torque_limit)
    return given_limits(scenario, plan_of(case), case.torque_limit)


@lru_cache(maxsize=4)
def sampled_case(case: Draw) -> Sampled:
    """Return the plan of a case at its samples, the same for all controllers."""
    scenario = case.scenario(PLANNED_FOR)
    return sampled(scenario.five_bar(), plan_of(case), RATE_HZ, scenario.lead_samples)


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
    off_path = path_distances(rows[:, [X, Y]], places)
    # at its end a motion is to have come to its goal
    off_path[len(rows) - 1 :] = distances[len(rows) - 1 :]
    requests = np.max(np.abs(trace[:, REQUESTED]), axis=1)
    # det A = sin(theta_2 - theta_1), theta_i = q_i1 + q_i2
    q11, q12, q21, q22 = trace[:, ANGLES].T
    signs = np.sign(np.sin(q21 + q22 - q11 - q12))
    changes = np.flatnonzero(signs[1:] * signs[:-1] < 0.0) + 1

    def peak(value: float, sample: int) -> Peak:
        x, y = places[sample].tolist()
        return Peak(value, sample / rate_hz, x, y)

    lost, largest = outcome.fault != NO_FAULT, int(np.argmax(np.nan_to_num(requests, nan=math.inf)))

    def error(values: FloatArray) -> Peak:
        worst = int(np.argmax(values))
        return peak(math.inf, len(trace) - 1) if lost else peak(float(values[worst]), worst)

    return PredictedRun(
        error=error(distances),
        path_error=error(off_path),
        torque=peak(float(requests[largest]), largest),
        mode_changes=peak(float(outcome.mode_changes), int(changes[-1]) if changes.size else 0),
        moments=tuple(PredictedSample(*row) for row in trace[:, MOMENT].tolist()),
    )
