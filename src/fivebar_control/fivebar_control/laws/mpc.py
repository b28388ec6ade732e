# SPDX-License-Identifier: Apache-2.0
"""Model predictive control: the torques of the next samples that together keep the platform on its reference.

`unified` chooses the best torque for one sample, and near the Type 2 locus one direction of the platform is out of its
reach. Over an interval no direction is: the lost direction turns while the robot passes. This law predicts the
platform over a horizon with xddot = G u + a_0, G and a_0 of the present state and then of the reference's coming
states, and minimises over the torques tau_i = u_i + f_i - d

    sum_j rho_j (|e_j|^2 + T_v^2 |e_j'|^2) + r_s sum_i |w_i - w_(i-1)|^2 + r sum_i |w_i|^2,     w_i = u_i - p_i,

within the limits of every torque and of its change from sample to sample. The first torque is applied. p is the plan
that the sample before has made: what the motion needs is planned once and costs nothing, and what noise makes of it
from fivebar_control.laws.mpc_problem import TorqueBounds
from sample to sample is what the weights r_s and r keep small.

The quadratic program is solved by the active-set method of `daqp`, which is exact, within a fixed number of iterations;
where it does not finish, the torque is that of `unified`.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, NamedTuple

import numpy as np

from fivebar_control.laws.gains import (
    DEXTAR_WEIGHTS,
    DISTURBANCE_LIMIT,
    FALLBACK_KD,
    FALLBACK_KP,
    FALLBACK_WEIGHT,
    SPEED_TIME,
    TORQUE_LIMIT,
    UnifiedSettings,
)
from fivebar_control.laws.law import MOST_AHEAD, Feedback, Instant, Law
from fivebar_control.laws.mpc_problem import (
    NO_PLAN,
    ROW,
    FloatArray,
    Solution,
    TorqueBounds,
    compiled_problem_of,
    solve,
    warm_up,
    weights_of,
)
from fivebar_control.laws.reference import Reference, reference_from_platform
from fivebar_control.laws.torque import UNDEFINED, Torque
from fivebar_control.laws.unified import (
    INITIAL_MEMORY,
    InputMap,
    UnifiedMemory,
    acceleration,
    input_map,
    observed_disturbance,
    restarted,
    unified_step,
)
from fivebar_control.model.state import Platform, State, WorkingMode
from fivebar_description.parameters import FiveBar, lost_torque
from fivebar_description.settings import Setting


class MpcSettings(NamedTuple):
    """Settings of the predictive law.

    A robot's file may determine `disturbance_limit` and the settings of the law that stands in; see `UnifiedSettings`.
    """

    horizon: Annotated[int, Setting("Samples that the law looks ahead.", "samples", at_least=2, at_most=MOST_AHEAD)] = (
        25
    )
    speed_time: Annotated[float, replace(SPEED_TIME, tunable=True)] = 0.03
    end_weight: Annotated[
        float,
        Setting(
            "Weight of the error at the end of the horizon, as a multiple.", at_least=1.0, at_most=1e4, tunable=True
        ),
    ] = 10.0
    step_weight: Annotated[
        float,
        Setting(
            "Weight r_s of the change, from sample to sample, of what departs from the torques planned before.",
            "(m/Nm)^2",
            at_least=1e-16,
            at_most=1e6,
            tunable=True,
        ),
    ] = DEXTAR_WEIGHTS["mpc"]["step_weight"]
    weight: Annotated[
        float,
        Setting(
            "Weight r of what departs from the torques planned before.",
            "(m/Nm)^2",
            at_least=0.0,
            at_most=1e6,
            tunable=True,
        ),
    ] = DEXTAR_WEIGHTS["mpc"]["weight"]
    observer_rate: Annotated[
        float,
        Setting(
            "Bandwidth of the disturbance observer, 0 for none; an estimator's disturbance takes its place.",
            "1/s",
            at_least=0.0,
            at_most=1e4,
        ),
    ] = 40.0
    disturbance_limit: Annotated[float, DISTURBANCE_LIMIT] = 0.5
    torque_limit: Annotated[float | None, TORQUE_LIMIT] = None
    torque_rate_limit: Annotated[
        float | None,
        Setting(
            "Fastest change of either torque that the law may choose; by default that of the last node.",
            "Nm/s",
            above=0.0,
            at_most=1e9,
        ),
    ] = None
    fallback_kp: Annotated[float, FALLBACK_KP] = UnifiedSettings().kp
    fallback_kd: Annotated[float, FALLBACK_KD] = UnifiedSettings().kd
    fallback_weight: Annotated[float, FALLBACK_WEIGHT] = UnifiedSettings().weight


class ReferenceWindow(NamedTuple):
    """The reference of the samples that follow, and what the prediction needs of each.

    Attributes:
        ahead: the references.
        rows: float64[N, 14], of each its six numbers, its input map's six, and the friction of both motors (Nm); NaN
            where the robot has no input map.
    """

    ahead: tuple[Platform, ...]
    rows: FloatArray


class MpcMemory(NamedTuple):
    """State of the law from one sample to the next.

    Attributes:
        unified: of the disturbance observer, shared with the law that stands in.
        torque: the last torque (Nm), None before the first sample and after a gap.
        window: of the samples that were ahead; None for none.
        plan: float64[2N], torques beyond friction (Nm) that the last solution has planned from the next sample on; None
            for none.
        duals: of the last solution, float64[constraints], to start the next one from; None for none.
        unfinished: how many samples `unified` has answered.
    """

    unified: UnifiedMemory
    torque: Torque | None
    window: ReferenceWindow | None
    plan: FloatArray | None
    duals: FloatArray | None
    unfinished: int


FIRST_MEMORY = MpcMemory(INITIAL_MEMORY, None, None, None, None, 0)
"""The memory before the first sample."""


def after_gap(memory: MpcMemory) -> MpcMemory:
    """Return the memory after a gap in the samples: only the estimated disturbance is kept."""
    return MpcMemory(restarted(memory.unified), None, None, None, None, memory.unfinished)


def friction_of(robot: FiveBar, reference: Reference) -> tuple[float, float]:
    """Return what both motors lose (Nm) at the angles and speeds of a reference."""
    leg1, leg2 = reference.state.leg1, reference.state.leg2
    return lost_torque(robot, robot.leg1, leg1.q1, leg1.dq1), lost_torque(robot, robot.leg2, leg2.q1, leg2.dq1)


def row_of(robot: FiveBar, mode: WorkingMode, platform: Platform) -> tuple[float, ...]:
    """Return the row of a window for a reference."""
    reference = reference_from_platform(robot, mode, platform)
    mapped = input_map(robot, reference.state)
    if mapped is None:
        return (math.nan,) * ROW
    return (*platform, *mapped, reference.f1, reference.f2)


def window_of(robot: FiveBar, instant: Instant, horizon: int, before: ReferenceWindow | None) -> ReferenceWindow | None:
    """Return the window of a sample; None where the reference of fewer samples is known.

    Where it follows that of the sample before, only the last row is new.
    """
    ahead = (instant.ahead or ())[:horizon]
    if len(ahead) < horizon:
        return None
    rows = np.empty((horizon, ROW))
    new = 0
    if before is not None and len(before.ahead) == horizon and before.ahead[1:] == ahead[:-1]:
        new = horizon - 1
        rows[:new] = before.rows[1:]
    for number in range(new, horizon):
        rows[number] = row_of(robot, instant.mode, ahead[number])
    return ReferenceWindow(ahead, rows)


def mpc_step(robot: FiveBar, instant: Instant, memory: MpcMemory, settings: MpcSettings) -> tuple[Torque, MpcMemory]:
    """Return the torque (Nm) of the predictive law and its memory for the next sample."""
    state, reference, period = instant.state, instant.reference, instant.period
    # an estimator gives its disturbance with the reference's friction, and the observer then has nothing to do
    f1, f2 = friction_of(robot, reference)
    estimated = (f1, f2) != (reference.f1, reference.f2)
    standing_in = unified_settings(settings, 0.0 if estimated else settings.observer_rate)
    mapped = input_map(robot, state)
    if mapped is None:
        return UNDEFINED, after_gap(memory)
    window = window_of(robot, instant, settings.horizon, memory.window)
    solution = Solution(None, None)
    torque_limit = math.inf if settings.torque_limit is None else settings.torque_limit
    step = math.inf if settings.torque_rate_limit is None else settings.torque_rate_limit * period
    if window is not None and not np.isnan(window.rows).any():
        d1, d2 = observed_disturbance(mapped, state, memory.unified, standing_in, period)
        last = (math.nan, math.nan) if memory.torque is None else (memory.torque.tau1, memory.torque.tau2)
        problem = compiled_problem_of()(
            weights_of(
                settings.horizon,
                period,
                settings.speed_time,
                settings.end_weight,
                settings.step_weight,
                settings.weight,
            ),
            window.rows,
            np.array((state.x, state.y, state.vx, state.vy, *mapped, f1, f2)),
            (d1 + f1 - reference.f1, d2 + f2 - reference.f2),
            NO_PLAN if memory.plan is None else memory.plan,
            TorqueBounds(last, torque_limit, step),
        )
        solution = solve(problem, memory.duals, torque_unit(settings))
    if solution.torques is None:
        torque, kept = unified_step(robot, state, reference, memory.unified, standing_in, period)
        torque = changed_by_at_most(torque, memory.torque, step)
        return torque, MpcMemory(kept, torque, window, None, None, memory.unfinished + 1)
    u1, u2 = solution.torques[:2].tolist()
    torque = Torque(
        min(max(u1 + reference.f1 - d1, -torque_limit), torque_limit),
        min(max(u2 + reference.f2 - d2, -torque_limit), torque_limit),
    )
    torque = changed_by_at_most(torque, memory.torque, step)
    return torque, MpcMemory(
        observed_from(mapped, state, reference, torque, d1, d2),
        torque,
        window,
        np.concatenate((solution.torques[2:], solution.torques[-2:])),
        solution.duals,
        memory.unfinished,
    )


def torque_unit(settings: MpcSettings) -> float:
    """Return the torque (Nm) that weighs as much as 1 Nm does by default."""
    return math.sqrt(MpcSettings().step_weight / settings.step_weight)


def unified_settings(settings: MpcSettings, observer_rate: float) -> UnifiedSettings:
    """Return the settings of the law that stands in, whose disturbance observer (1/s) this law has."""
    return UnifiedSettings(
        kp=settings.fallback_kp,
        kd=settings.fallback_kd,
        weight=settings.fallback_weight,
        observer_rate=observer_rate,
        disturbance_limit=settings.disturbance_limit,
        torque_limit=settings.torque_limit,
    )


def changed_by_at_most(torque: Torque, last: Torque | None, step: float) -> Torque:
    """Return a torque (Nm) within a step of the last one."""
    if last is None or not math.isfinite(step):
        return torque
    return Torque(
        min(max(torque.tau1, last.tau1 - step), last.tau1 + step),
        min(max(torque.tau2, last.tau2 - step), last.tau2 + step),
    )


def observed_from(
    mapped: InputMap, state: State, reference: Reference, torque: Torque, d1: float, d2: float
) -> UnifiedMemory:
    """Return what the disturbance observer keeps of a sample for the next one."""
    net1, net2 = torque.tau1 - reference.f1, torque.tau2 - reference.f2
    ax, ay = acceleration(mapped, net1 + d1, net2 + d2)
    return UnifiedMemory(
        d1=d1,
        d2=d2,
        unset=False,
        net1=net1,
        net2=net2,
        vx=state.vx,
        vy=state.vy,
        ax=ax,
        ay=ay,
    )


def horizon_of(settings: MpcSettings) -> int:
    """Return of how many samples that follow the law needs the reference."""
    return settings.horizon


def fallback_feedback(settings: MpcSettings) -> Feedback:
    """Return the feedback of the law that takes over: the weights of a cost over time have other units than gains."""
    return Feedback(settings.fallback_kp, settings.fallback_kd, settings.fallback_weight, settings.observer_rate)


LAW = Law(
    name="mpc",
    title="model predictive law",
    settings=MpcSettings,
    step=mpc_step,
    memory=FIRST_MEMORY,
    after_gap=after_gap,
    samples_ahead=horizon_of,
    compiles=False,
    feedback=fallback_feedback,
    warm_up=warm_up,
)
