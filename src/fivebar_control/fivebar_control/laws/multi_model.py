# SPDX-License-Identifier: Apache-2.0
"""Multi-model computed torque control (1.27 to 1.29, figure 1.10): the baseline of the virtual constraints.

Off the locus it is the computed torque law with the full model; on the locus it uses a model without the
platform, lambda = 0, which does not degenerate but is right only for a trajectory that meets the dynamic criterion
there. The transition is a sigmoid in time around each planned crossing (`fivebar_control.loop.supervisor`).
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_control.laws.ctc import linearised_acceleration
from fivebar_control.laws.gains import KD, KP
from fivebar_control.laws.law import MIN_AUTHORITY, Instant, Law
from fivebar_control.laws.reference import Reference
from fivebar_control.laws.resolution import Load, full_inverse, held_along
from fivebar_control.laws.torque import ZERO, Torque
from fivebar_control.model.residual import distal_moments, moment_torques
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.model.state import State
from fivebar_description.parameters import FiveBar, has_external_force, has_residual


def reduced_ctc_torque(robot: FiveBar, state: State, reference: Reference, kp: float, kd: float) -> Torque:
    """Return tau_B = ZZ v + f (1.29): computed torque with the wrench on the platform vanished.

    Of the distal links' moments the motors' part remains, and of gravity and a constant force on the platform the part
    along the controllable direction.
    """
    v1 = linearised_acceleration(state.leg1, reference.state.leg1, reference.ax, reference.ay, kp, kd)
    v2 = linearised_acceleration(state.leg2, reference.state.leg2, reference.ax, reference.ay, kp, kd)
    f1, f2 = reference.f1, reference.f2
    if has_residual(robot):
        on1, on2 = moment_torques(robot, state, distal_moments(robot, state, v1, v2, reference.ax, reference.ay))
        f1, f2 = f1 + on1, f2 + on2
    if has_external_force(robot):
        svd = parallel_svd(state)
        held = full_inverse(robot, state, svd, 0.0, Load(0.0, 0.0, held_along(robot, svd)), ZERO)
        f1, f2 = f1 + held.tau1, f2 + held.tau2
    return Torque(robot.leg1.inertia * v1 + f1, robot.leg2.inertia * v2 + f2)


class ReducedCtcSettings(NamedTuple):
    """Gains of the computed torque law with the reduced model."""

    kp: Annotated[float, KP] = 2500.0
    kd: Annotated[float, KD] = 100.0


def reduced_ctc_step(
    robot: FiveBar, instant: Instant, memory: None, settings: ReducedCtcSettings
) -> tuple[Torque, None]:
    """Return tau_B for a sample."""
    return reduced_ctc_torque(robot, instant.state, instant.reference, settings.kp, settings.kd), memory


LAW = Law(
    name="reduced_ctc",
    title="reduced model",
    settings=ReducedCtcSettings,
    step=reduced_ctc_step,
    topic_name="vhc",
    executable="vhc_controller",
    min_authority=MIN_AUTHORITY,
)
