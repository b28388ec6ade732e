"""Multi-model computed torque control (1.27 to 1.29, figure 1.10): the method that the virtual constraints improve on.

Away from the locus it is the computed torque law with the full model; on the locus it uses a model without the
platform, lambda = 0, which does not degenerate but is right only for a trajectory that meets the dynamic criterion
there. The transition is a sigmoid in time around each planned crossing.
"""

from __future__ import annotations

from collections.abc import Sequence

from fivebar_control.laws.ctc import linearised_acceleration
from fivebar_control.laws.reference import Reference
from fivebar_control.laws.torque import Torque
from fivebar_control.model.state import State
from fivebar_control.trajectory.polynomial import rest_to_rest
from fivebar_description.parameters import FiveBar


def reduced_ctc_torque(robot: FiveBar, state: State, reference: Reference, kp: float, kd: float) -> Torque:
    """Return tau_B = ZZ v + f (1.29): computed torque with the wrench on the platform vanished."""
    v1 = linearised_acceleration(state.leg1, reference.state.leg1, reference.ax, reference.ay, kp, kd)
    v2 = linearised_acceleration(state.leg2, reference.state.leg2, reference.ax, reference.ay, kp, kd)
    return Torque(robot.leg1.inertia * v1 + reference.f1, robot.leg2.inertia * v2 + reference.f2)


def sigmoid_weight(t: float, crossing_times: Sequence[float], duration: float) -> float:
    """Return the weight of the reduced model at time t (s).

    1 within half a `duration` (s) of a crossing, 0 from one duration on, and the fifth-order step in between.
    """
    distance = min((abs(t - crossing) for crossing in crossing_times), default=duration)
    return 1.0 - rest_to_rest((distance - 0.5 * duration) / (0.5 * duration))[0]
