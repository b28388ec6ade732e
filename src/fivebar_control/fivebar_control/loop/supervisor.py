"""The supervisor with the blending zones of a plan: the weight of the constraint law at each sample."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from fivebar_control.laws.registry import SIGMOID
from fivebar_control.laws.supervisor import blending_weight
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.model.state import State
from fivebar_control.trajectory.planner import Plan
from fivebar_control.trajectory.polynomial import rest_to_rest


class SupervisorState(NamedTuple):
    """The blending weight sigma and kappa = 1 / cond(A)."""

    sigma: float
    inverse_condition: float


class Supervisor:
    """The performance-based supervisor with the zone widths of a plan; in time for the multi-model method."""

    def __init__(self, plan: Plan, rate_hz: int, weighting: str) -> None:
        """Bind the supervisor to a plan; `weighting` is `CONDITION` (4.1.2) or `SIGMOID` (figure 1.10)."""
        self._plan = plan
        self._rate_hz = rate_hz
        self._in_time = weighting == SIGMOID

    def __call__(self, sample: int, state: State) -> SupervisorState:
        """Return sigma and kappa for a sample."""
        return self.at(sample / self._rate_hz, state)

    def at(self, t: float, state: State) -> SupervisorState:
        """Return sigma and kappa at time t (s)."""
        kappa = inverse_condition(state)
        return SupervisorState(self.weight(t, kappa), kappa)

    def weight(self, t: float, kappa: float) -> float:
        """Return sigma at time t (s) for a kappa."""
        return time_weight(self._plan, t) if self._in_time else blending_weight(kappa, self._plan.epsilon_at(t))


def time_weight(plan: Plan, t: float) -> float:
    """Return the blending weight of the multi-model method at time t (s) of a plan."""
    return sigmoid_weight(t, [crossing.time for crossing in plan.crossings], plan.zone_time)


def sigmoid_weight(t: float, crossing_times: Sequence[float], duration: float) -> float:
    """Return the weight of the reduced model at time t (s).

    1 within half a `duration` (s) of a crossing, 0 from one duration on, and the fifth-order step in between.
    """
    distance = min((abs(t - crossing) for crossing in crossing_times), default=duration)
    return 1.0 - rest_to_rest((distance - 0.5 * duration) / (0.5 * duration))[0]
