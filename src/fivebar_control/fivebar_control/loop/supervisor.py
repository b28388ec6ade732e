# SPDX-License-Identifier: Apache-2.0
"""The supervisor with the blending zones of a plan: the weight of the constraint law at each sample."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from fivebar_control.laws.blend import blending_weight, forecast_width
from fivebar_control.laws.registry import ESTIMATE, SIGMOID
from fivebar_control.model.singularity import inverse_condition, inverse_condition_rate
from fivebar_control.model.state import State
from fivebar_control.trajectory.planner import Plan
from fivebar_control.trajectory.time_scaling import rest_to_rest


class SupervisorState(NamedTuple):
    """The blending weight sigma and kappa = 1 / cond(A)."""

    sigma: float
    inverse_condition: float


class Supervisor:
    """The supervisor: by performance with the zone widths of a plan, prerouted in time, or by the estimated state."""

    def __init__(self, plan: Plan, rate_hz: int, weighting: str) -> None:
        """Bind the supervisor to a plan; `weighting` is one of `SUPERVISIONS`."""
        self._plan = plan
        self._rate_hz = rate_hz
        self._in_time = weighting == SIGMOID
        self.forecasts = weighting == ESTIMATE
        """Whether the weight depends on |d kappa / dt|."""

    def __call__(self, sample: int, state: State) -> SupervisorState:
        """Return sigma and kappa for a sample."""
        return self.at(sample / self._rate_hz, state)

    def at(self, t: float, state: State) -> SupervisorState:
        """Return sigma and kappa at time t (s)."""
        kappa = inverse_condition(state)
        kappa_rate = inverse_condition_rate(state) if self.forecasts else 0.0
        return SupervisorState(self.weight(t, kappa, kappa_rate), kappa)

    def weight(self, t: float, kappa: float, kappa_rate: float) -> float:
        """Return sigma at time t (s) for a kappa, and for |d kappa / dt| (1/s) where it `forecasts`."""
        if self._in_time:
            return time_weight(self._plan, t)
        epsilon = self._plan.epsilon_at(t)
        if self.forecasts:
            epsilon = forecast_width(kappa_rate, self._plan.zone_time, epsilon)
        return blending_weight(kappa, epsilon)


def time_weight(plan: Plan, t: float) -> float:
    """Return the blending weight of the multi-model method at time t (s) of a plan."""
    return sigmoid_weight(t, [crossing.time for crossing in plan.crossings], plan.zone_time)


def sigmoid_weight(t: float, crossing_times: Sequence[float], duration: float) -> float:
    """Return the weight of the reduced model at time t (s).

    1 within half a `duration` (s) of a crossing, 0 from one duration on, and the fifth-order step in between.
    """
    distance = min((abs(t - crossing) for crossing in crossing_times), default=duration)
    return 1.0 - rest_to_rest((distance - 0.5 * duration) / (0.5 * duration))[0]
