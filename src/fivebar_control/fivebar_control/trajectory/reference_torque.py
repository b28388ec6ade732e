"""The torque that a reference needs of the motors: what a motion costs, known beforehand.

Off the Type 2 locus this is the inverse dynamics (1.30, 1.31). On it the inverse dynamics of a motion that knows
nothing of the locus is infinite, but no controller here asks for it: a blended controller hands over to its law on the
locus, and the law without switching lets go of the direction in which nothing can be asked. There the figure is the
controller's own: what it asks while the robot is exactly on its reference, before limits.

The law without switching lets go a little everywhere, by its price on torque. Away from the locus that only postpones
the torque, so what counts there is the inverse dynamics, not what it would ask without an error.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.laws.blend import blend
from fivebar_control.laws.laws import SCHEMES, CtcLaw, Gains, Law, Supervisor, UnifiedLaw, on_locus_law
from fivebar_control.laws.reference import Reference
from fivebar_control.laws.torque import Torque
from fivebar_control.laws.unified import UnifiedSettings
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar

NO_GAINS = Gains(0.0, 0.0)
"""Without errors gains have nothing to multiply."""

NEAR_LOCUS = 0.05
"""Below this kappa = 1/cond(A) the platform counts as near the Type 2 locus."""


class Follower(NamedTuple):
    """Who is to follow a motion.

    Attributes:
        controller: one of `SCHEMES`.
        resolution: of the torque on the locus, for the blended controllers.
        weight: price of torque beyond friction, for the unified one ((m/s^2 / Nm)^2).
    """

    controller: str = "unified"
    resolution: str = "full_friction"
    weight: float = UnifiedSettings().weight

    @property
    def blended(self) -> bool:
        """Whether another law takes over on the locus."""
        return SCHEMES[self.controller].on_locus is not None


class ReferenceTorque:
    """The torque that a controller needs on a plan, sample by sample."""

    def __init__(self, robot: FiveBar, plan: Plan, rate_hz: int, follower: Follower) -> None:
        """Put the controller together.

        Raises:
            InputError: there is no such resolution.
        """
        scheme = SCHEMES[follower.controller]
        self._full: Law = CtcLaw(robot, NO_GAINS)
        self._unified = (
            UnifiedLaw(robot, UnifiedSettings(0.0, 0.0, follower.weight, math.inf))
            if scheme.away == "unified"
            else None
        )
        self._on_locus = (
            on_locus_law(scheme.on_locus, robot, plan, rate_hz, NO_GAINS, follower.resolution, None)
            if scheme.on_locus is not None
            else None
        )
        self._supervise = Supervisor(plan, rate_hz, scheme.weighting)

    def __call__(self, sample: int, reference: Reference) -> Torque:
        """Return the torque (Nm) for a sample of the reference; NaN where the controller has none."""
        if reference.by_motors:
            return Torque(reference.u1 + reference.f1, reference.u2 + reference.f2)
        state = reference.state
        if self._unified is not None and inverse_condition(state) < NEAR_LOCUS:
            return self._unified(sample, state, reference)
        full = self._full(sample, state, reference)
        if self._on_locus is None:
            return full
        sigma = self._supervise(sample, state).sigma
        return blend(sigma, full, self._on_locus(sample, state, reference)) if sigma > 0.0 else full
