"""The torque that a reference needs of the motors: what a motion costs, known beforehand.

Off the Type 2 locus this is the inverse dynamics (1.30, 1.31). On it the inverse dynamics of a motion that knows
nothing of the locus is infinite, but no controller that crosses requests it: a blended controller hands over to its
constraint law, and a law that is regular there regularises the uncontrollable direction. There the torque is the
controller's own: what it requests while the robot is exactly on its reference, before limits.

A regular law leaves out a little everywhere, by its weight on torque. Off the locus that only postpones the torque, so
what counts there is the inverse dynamics, not what the law would request without an error.
"""

from __future__ import annotations

from typing import Any

from fivebar_control.laws.blend import blend
from fivebar_control.laws.reference import Reference
from fivebar_control.laws.registry import TunedController
from fivebar_control.laws.torque import Torque
from fivebar_control.loop.law_runner import LawRunner
from fivebar_control.loop.supervisor import Supervisor
from fivebar_control.model.dynamics import inverse_dynamics
from fivebar_control.model.kinematics import joint_acceleration
from fivebar_control.model.singularity import NEAR_LOCUS, inverse_condition, inverse_condition_rate
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar


class ReferenceTorque:
    """The torque that a controller needs on a plan, sample by sample."""

    def __init__(self, robot: FiveBar, plan: Plan, rate_hz: int, follower: TunedController) -> None:
        """Bind the controller to a robot, a plan and a sampling rate (Hz)."""
        self._robot = robot
        self._plan = plan
        self._rate_hz = rate_hz
        self._regular = follower.controller.needs_no_zones
        own = follower.nominal if self._regular else follower.constraint
        self._own = None if own is None else own.unlimited()
        self._memory: Any = None
        self._supervise = Supervisor(plan, rate_hz, follower.controller.weighting)
        self.forecasts = self._supervise.forecasts
        """Whether the share of its own answer depends on |d kappa / dt|."""

    def __call__(self, sample: int, reference: Reference) -> Torque:
        """Return the torque (Nm) for a sample of the reference; NaN where the controller has none."""
        state, full = reference.state, full_torque(self._robot, reference)
        kappa_rate = inverse_condition_rate(state) if self.forecasts else 0.0
        share = self.own_share(sample, inverse_condition(state), kappa_rate)
        if self._own is None or reference.by_motors or not share > 0.0:
            return full
        # every sample is answered with the memory before the first one
        runner = LawRunner(self._own, self._robot, self._plan, self._rate_hz, self._memory)
        self._memory = runner.memory
        return blend(share, full, runner(sample, state, reference))

    def own_share(self, sample: int, kappa: float, kappa_rate: float) -> float:
        """Return the share of the controller's own answer in its torque, from 0, for `full_torque`, to 1.

        |d kappa / dt| (1/s) counts where it `forecasts`.
        """
        if self._own is None:
            return 0.0
        if self._regular:
            return 1.0 if kappa < NEAR_LOCUS else 0.0
        return self._supervise.weight(sample / self._rate_hz, kappa, kappa_rate)


def full_torque(robot: FiveBar, reference: Reference) -> Torque:
    """Return the inverse dynamics of a reference (Nm)."""
    if reference.by_motors:
        return Torque(reference.u1 + reference.f1, reference.u2 + reference.f2)
    ddq11 = joint_acceleration(reference.state.leg1, reference.ax, reference.ay)
    ddq21 = joint_acceleration(reference.state.leg2, reference.ax, reference.ay)
    tau1, tau2 = inverse_dynamics(robot, reference.state, ddq11, ddq21, reference.f1, reference.f2)
    return Torque(tau1, tau2)


def limited_to(tuned: TunedController, torque: float) -> TunedController:
    """Return a controller whose laws keep a torque limit (Nm) themselves, or the lower one of their settings."""
    return tuned._replace(
        nominal=tuned.nominal.limited_to(torque),
        constraint=None if tuned.constraint is None else tuned.constraint.limited_to(torque),
    )
