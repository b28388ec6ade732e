"""The answer to one sample: the chosen laws, weighed, as the node graph and the offline runner give it."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_bringup.simulation.case import (
    FULL_FRICTION,
    MIN_NORM,
    NO_LAW,
    REDUCED_CTC,
    UNIFIED,
    VHC_CARTESIAN,
    Case,
    Laws,
)
from fivebar_control.laws.adaptive_gain import GainMemory, gain_factors, gain_memory
from fivebar_control.laws.blend import blend
from fivebar_control.laws.ctc import ctc_torque
from fivebar_control.laws.multi_model import reduced_ctc_torque
from fivebar_control.laws.reference import Reference
from fivebar_control.laws.resolution import full_friction, full_inverse, min_norm
from fivebar_control.laws.torque import UNDEFINED, Torque
from fivebar_control.laws.unified import UnifiedMemory, unified_step
from fivebar_control.laws.vhc_cartesian import vhc_cartesian_torque
from fivebar_control.laws.vhc_joint import vhc_joint_torque
from fivebar_control.model.line import Line
from fivebar_control.model.state import State
from fivebar_description.parameters import FiveBar


class LawMemory(NamedTuple):
    """What the laws keep from sample to sample: the adaptive gain, and the law without switching."""

    gain: GainMemory
    unified: UnifiedMemory


class Answer(NamedTuple):
    """The torque for a sample (Nm), NaN where undefined, and the laws' memory."""

    torque: Torque
    memory: LawMemory


def answer(
    case: Case,
    state: State,
    reference: Reference,
    direction_x: float,
    direction_y: float,
    sigma: float,
    memory: LawMemory,
) -> Answer:
    """Return the torque for a sample; a law without weight is not worked out.

    Args:
        case: the case.
        state: measured state.
        reference: desired instant.
        direction_x, direction_y: unit vector along the current segment.
        sigma: the supervisor's weight of the law on the locus.
        memory: of the sample before.
    """
    laws, gain, unified = case.laws, memory.gain, memory.unified
    weight = 0.0 if laws.on_locus == NO_LAW else sigma
    away = on_locus = UNDEFINED
    if laws.away == UNIFIED:
        away, unified = unified_step(case.believed, state, reference, unified, laws.unified, 1.0 / case.rate_hz)
    elif not weight >= 1.0:
        away = ctc_torque(case.believed, state, reference, laws.kp, laws.kd)
    factor_p = factor_d = 1.0
    if laws.adaptive:
        error_x, error_y = state.x - reference.state.x, state.y - reference.state.y
        settings = laws.adaptive_gain
        gain = gain_memory(gain, sigma > 0.0, error_x, error_y)
        factor_p, factor_d = gain_factors(
            gain, error_x, error_y, settings.alpha, settings.error_limit, settings.keep_damping
        )
    if not weight <= 0.0:
        # through the reference, which on the plan is the segment itself
        line = Line(reference.state.x, reference.state.y, direction_x, direction_y)
        on_locus = _on_locus(laws, case.believed, case.mode1, case.mode2, state, reference, line, factor_p, factor_d)
    return Answer(blend(weight, away, on_locus), LawMemory(gain, unified))


def _on_locus(
    laws: Laws,
    robot: FiveBar,
    mode1: int,
    mode2: int,
    state: State,
    reference: Reference,
    line: Line,
    factor_p: float,
    factor_d: float,
) -> Torque:
    kp, kd = laws.kp_vhc, laws.kd_vhc
    if laws.on_locus == REDUCED_CTC:
        return reduced_ctc_torque(robot, state, reference, kp, kd)
    if laws.on_locus == VHC_CARTESIAN:
        if laws.resolution == FULL_FRICTION:
            return vhc_cartesian_torque(robot, state, reference, line, kp, kd, full_friction)
        if laws.resolution == MIN_NORM:
            return vhc_cartesian_torque(robot, state, reference, line, kp, kd, min_norm)
        return vhc_cartesian_torque(robot, state, reference, line, kp, kd, full_inverse)
    kp, kd = kp * factor_p, kd * factor_d
    if laws.resolution == FULL_FRICTION:
        return vhc_joint_torque(robot, mode1, mode2, state, reference, line, kp, kd, full_friction)
    if laws.resolution == MIN_NORM:
        return vhc_joint_torque(robot, mode1, mode2, state, reference, line, kp, kd, min_norm)
    return vhc_joint_torque(robot, mode1, mode2, state, reference, line, kp, kd, full_inverse)
