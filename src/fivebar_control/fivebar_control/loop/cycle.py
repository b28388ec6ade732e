# SPDX-License-Identifier: Apache-2.0
"""One control cycle: from the measured or estimated state to the torque command.

Supervisor, laws, blending, guard. The offline runner calls it as it stands and the engine compiles it; the
nodes of the graph call the same parts, each its own: the supervisor `blending_weight`, the controllers the laws' steps
(`law_runner`), the blender `fivebar_control.safety.guard`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from fivebar_control.laws.blend import blend, blending_weight, forecast_width
from fivebar_control.laws.law import Instant, Step
from fivebar_control.laws.reference import Reference
from fivebar_control.laws.torque import ZERO, Torque
from fivebar_control.loop.plan_sample import PlanSample
from fivebar_control.model.line import Line
from fivebar_control.model.singularity import inverse_condition, inverse_condition_rate
from fivebar_control.model.state import State, WorkingMode
from fivebar_control.safety.brake import Brake, braking_after, stopping
from fivebar_control.safety.stages import NO_FAULT, Limits, excess_samples, first_fault, limited_torque
from fivebar_description.parameters import FiveBar


class CycleSettings(NamedTuple):
    """Constants of the control cycle.

    Attributes:
        robot: nominal robot of the controllers.
        mode: working mode of the motion.
        period: between two samples (s).
        nominal, constraint: settings of the laws as numbers (`as_numbers`); None for no constraint law.
        blended: whether there is a constraint law.
        weighted_in_time: sigma from the plan's time weight instead of from cond(A).
        zone_time: for which sigma is meant to be 1 (s), where the zones are as wide as the state's speed makes them; 0
            where they are the plan's.
        limits: of the guard.
        brake: of the guard.
    """

    robot: FiveBar
    mode: WorkingMode
    period: float
    nominal: Any
    constraint: Any
    blended: bool
    weighted_in_time: bool
    zone_time: float
    limits: Limits
    brake: Brake


class CycleMemory(NamedTuple):
    """State of the control cycle.

    Attributes:
        nominal, constraint: memories of the laws.
        command: last command (Nm).
        excess: excessive requests in a row.
        braking: for how many more samples the robot may be braked; 0 before a fault.
    """

    nominal: Any
    constraint: Any
    command: Torque
    excess: int
    braking: int


class Cycle(NamedTuple):
    """Result of a control cycle.

    Attributes:
        sigma, kappa: the supervisor's state.
        nominal, constraint: candidate torques (Nm), NaN where undefined.
        requested: their blend, before limits (Nm).
        command: torque command (Nm).
        fault: number of the fault detected at this sample, `NO_FAULT` for none.
        memory: for the next sample.
    """

    sigma: float
    kappa: float
    nominal: Torque
    constraint: Torque
    requested: Torque
    command: Torque
    fault: int
    memory: CycleMemory


def control_cycle(
    nominal_step: Step,
    constraint_step: Step,
    settings: CycleSettings,
    memory: CycleMemory,
    state: State,
    reference: Reference,
    plan: PlanSample,
    latched: bool,
    sound: bool,
) -> Cycle:
    """Return the result of one control cycle.

    Args:
        nominal_step, constraint_step: the laws; `no_step` where there is no constraint law.
        settings: constants.
        memory: of the sample before.
        state: measured or estimated state.
        reference: desired instant, that of the plan or with a disturbance compensated.
        plan: the plan at this sample.
        latched: whether a fault is latched, which brakes the robot or commands zero torque.
        sound: whether the state is to be trusted, so that the robot may be braked by it.
    """
    kappa = inverse_condition(state)
    zone_weight = blending_weight(kappa, plan.epsilon)
    sigma = plan.time_weight if settings.weighted_in_time else zone_weight
    if settings.zone_time > 0.0:
        width = forecast_width(inverse_condition_rate(state), settings.zone_time, plan.epsilon)
        sigma = blending_weight(kappa, width)
    line = Line(reference.state.x, reference.state.y, plan.direction_x, plan.direction_y)
    instant = Instant(state, reference, line, settings.mode, zone_weight, settings.period, plan.ahead)
    robot = settings.robot
    nominal, nominal_memory = nominal_step(robot, instant, memory.nominal, settings.nominal)
    constraint, constraint_memory = constraint_step(robot, instant, memory.constraint, settings.constraint)
    requested = blend(sigma, nominal, constraint) if settings.blended else nominal
    excess = excess_samples(settings.limits, requested, memory.excess)
    command, fault, braking = ZERO, NO_FAULT, memory.braking
    if not latched:
        fault = first_fault(
            settings.limits,
            robot,
            settings.mode,
            state,
            plan.platform.x,
            plan.platform.y,
            requested,
            excess,
        )
        if fault == NO_FAULT:
            command = limited_torque(settings.limits, requested, memory.command)
        else:
            braking = braking_after(settings.brake, fault)
    if latched or fault != NO_FAULT:
        command, braking = stopping(settings.brake, robot, state, braking if sound else 0)
    kept = CycleMemory(nominal_memory, constraint_memory, command, excess, braking)
    return Cycle(sigma, kappa, nominal, constraint, requested, command, fault, kept)
