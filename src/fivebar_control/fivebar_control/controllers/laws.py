"""The control laws of a run, each bound to its robot, plan and gains: what nodes and the offline runner both call."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from fivebar_control.controllers.ctc import ctc_torque
from fivebar_control.controllers.reference import Reference
from fivebar_control.controllers.resolution import RESOLUTIONS
from fivebar_control.controllers.supervisor import blending_weight
from fivebar_control.controllers.torque import Torque
from fivebar_control.controllers.vhc_cartesian import vhc_cartesian_torque
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.model.state import State
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar
from fivebar_description.strict_yaml import InputError


class Gains(NamedTuple):
    """Proportional gain (1/s^2) and derivative gain (1/s)."""

    kp: float
    kd: float


class Law(Protocol):
    """A control law that answers every sample."""

    def __call__(self, sample: int, state: State, reference: Reference) -> Torque:
        """Return the torque (Nm) for a sample, NaN where the law is undefined."""


class CtcLaw:
    """Computed torque control u1."""

    def __init__(self, robot: FiveBar, gains: Gains) -> None:
        """Bind the law to a robot and gains."""
        self._robot = robot
        self._gains = gains

    def __call__(self, sample: int, state: State, reference: Reference) -> Torque:
        """Return u1 (Nm)."""
        return ctc_torque(self._robot, state, reference, self._gains.kp, self._gains.kd)


class VhcCartesianLaw:
    """Virtual holonomic constraint law u3 along the planned path."""

    def __init__(self, robot: FiveBar, plan: Plan, rate_hz: int, gains: Gains, resolution: str) -> None:
        """Bind the law to a robot, a path, gains and one of the torque resolutions.

        Raises:
            InputError: there is no such resolution.
        """
        if resolution not in RESOLUTIONS:
            raise InputError(f"vhc_resolution: {resolution!r}: expected one of {', '.join(RESOLUTIONS)}")
        self._robot = robot
        self._path = plan.path
        self._rate_hz = rate_hz
        self._gains = gains
        self._resolve = RESOLUTIONS[resolution]

    def __call__(self, sample: int, state: State, reference: Reference) -> Torque:
        """Return u3 (Nm)."""
        line = self._path.line_at(sample / self._rate_hz)
        return vhc_cartesian_torque(self._robot, state, reference, line, self._gains.kp, self._gains.kd, self._resolve)


class SupervisorState(NamedTuple):
    """The blending weight sigma and kappa = 1 / cond(A)."""

    sigma: float
    inverse_condition: float


class Supervisor:
    """The performance-based supervisor with the zone widths of a plan."""

    def __init__(self, plan: Plan, rate_hz: int) -> None:
        """Bind the supervisor to a plan."""
        self._plan = plan
        self._rate_hz = rate_hz

    def __call__(self, sample: int, state: State) -> SupervisorState:
        """Return sigma and kappa for a sample."""
        kappa = inverse_condition(state)
        return SupervisorState(blending_weight(kappa, self._plan.epsilon_at(sample / self._rate_hz)), kappa)
