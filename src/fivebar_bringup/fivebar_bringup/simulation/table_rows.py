# SPDX-License-Identifier: Apache-2.0
"""The table of a run, filled in the engine's loop sample by sample."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_bringup.simulation.case import EngineRun
from fivebar_bringup.simulation.engine_estimator import EngineKnown, MeasuredKnown, state_of
from fivebar_bringup.simulation.engine_robot import Robot
from fivebar_bringup.simulation.engine_table import RunEnd, TraceRow
from fivebar_control.estimation.readings import largest_offset, strain
from fivebar_control.laws.torque import UNDEFINED
from fivebar_control.loop.closed_loop import Answered
from fivebar_control.loop.plan_sample import PlanSample
from fivebar_control.model.kinematics import det_a
from fivebar_control.model.singularity import type1_distance
from fivebar_control.safety.stages import NO_FAULT
from fivebar_control.trajectory.path_distance import path_place
from fivebar_description.parameters import FiveBar
from fivebar_sim.sensors import encoder_resolution


class TableEnd(NamedTuple):
    """The end of a table that is being filled.

    Attributes:
        samples: rows so far.
        line: of the path to which the platform was nearest.
        state_is_exact: whether what is measured is the actual robot.
    """

    samples: int
    line: int
    state_is_exact: bool


class Watched(NamedTuple):
    """The estimator's watch at a sample, in the columns of the table."""

    deviations: float
    misfit: float
    offset: float
    jump: float
    error: float
    strain: float


UNWATCHED = Watched(math.inf, 0.0, 0.0, 0.0, 0.0, 0.0)
"""The same without an estimator."""


def empty_table(run: EngineRun) -> TableEnd:
    """Return the end of a table without a row."""
    case = run.case
    state_is_exact = (
        case.estimation is None
        and case.mechanism is None
        and encoder_resolution(case.equipment) == 0.0
        and same_lengths(case.control.robot, case.actual)
    )
    return TableEnd(0, 0, state_is_exact)


def recorded(
    run: EngineRun,
    end: TableEnd,
    number: int,
    robot: Robot,
    known: MeasuredKnown,
    planned: PlanSample,
    loop: Answered,
) -> TableEnd:
    """Fill a sample's row of the table; return the end."""
    return filled(run, end, number, robot, known, UNWATCHED, loop)


def recorded_estimate(
    run: EngineRun,
    end: TableEnd,
    number: int,
    robot: Robot,
    known: EngineKnown,
    planned: PlanSample,
    loop: Answered,
) -> TableEnd:
    """Fill a sample's row of the table of a run with an estimator; return the end."""
    misfit, pattern = known.memory.misfit, known.memory.pattern
    watched = Watched(
        known.deviations,
        # a mean that is not known is left out
        max(0.0, misfit.encoders, misfit.gyro, misfit.elbow, misfit.extra),
        largest_offset(pattern),
        pattern.jump,
        pattern.error,
        strain(run.case.estimation.model, pattern),
    )
    return filled(run, end, number, robot, known, watched, loop)


def filled(
    run: EngineRun,
    end: TableEnd,
    number: int,
    robot: Robot,
    known: MeasuredKnown | EngineKnown,
    watched: Watched,
    loop: Answered,
) -> TableEnd:
    """Fill a sample's row of the table; return the end.

    Args:
        run: of the engine.
        end: of the table.
        number: of the sample.
        robot: at the sample.
        known: of it by the controllers.
        watched: what the estimator's watch finds.
        loop: after the sample.
    """
    case, exact, cycle, state = run.case, robot.exact, loop.cycle, known.state
    requested = UNDEFINED if loop.latched else cycle.requested
    truth = state if end.state_is_exact and known.present else state_of(case.actual, exact)
    nearest = path_place(run.plan.rows, end.line, number, truth.x, truth.y)
    row = TraceRow(
        q11=exact.q11,
        q12=exact.q12,
        q21=exact.q21,
        q22=exact.q22,
        dq11=exact.dq11,
        dq12=exact.dq12,
        dq21=exact.dq21,
        dq22=exact.dq22,
        estimated_x=state.x,
        estimated_y=state.y,
        estimated_vx=state.vx,
        estimated_vy=state.vy,
        sigma=cycle.sigma,
        kappa=cycle.kappa,
        requested1=requested.tau1,
        requested2=requested.tau2,
        command1=cycle.command.tau1,
        command2=cycle.command.tau2,
        applied1=robot.applied1,
        applied2=robot.applied2,
        read1=robot.readings.q11,
        read2=robot.readings.q21,
        x=truth.x,
        y=truth.y,
        det_a=det_a(truth),
        type1_distance=type1_distance(case.actual, truth),
        from_path=nearest.distance,
        mirror_deviations=watched.deviations,
        misfit=watched.misfit,
        misfit_offset=watched.offset,
        misfit_jump=watched.jump,
        misfit_error=watched.error,
        misfit_strain=watched.strain,
        loop_gap=robot.gap,
    )
    for column, value in enumerate(row):
        run.trace[number, column] = value
    return TableEnd(end.samples + 1, nearest.line, end.state_is_exact)


def ends(run: EngineRun, fault: int) -> bool:
    """Return whether the run ends with a sample."""
    return fault != NO_FAULT and run.case.stop_at_fault


def concluded(run: EngineRun, end: TableEnd, robot: Robot, fault: int, fault_sample: int) -> RunEnd:
    """Return the end of the whole run."""
    return RunEnd(end.samples, fault, fault_sample, robot.applied1, robot.applied2)


def same_lengths(first: FiveBar, second: FiveBar) -> bool:
    """Return whether two robots have the same geometry, so that equal joints mean equal platform positions."""
    return (
        first.leg1.base_x == second.leg1.base_x
        and first.leg1.proximal == second.leg1.proximal
        and first.leg1.distal == second.leg1.distal
        and first.leg2.base_x == second.leg2.base_x
        and first.leg2.proximal == second.leg2.proximal
        and first.leg2.distal == second.leg2.distal
    )
