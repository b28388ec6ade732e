"""The control laws of a run, each bound to its robot, plan and gains: what nodes and the offline runner both call."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

from fivebar_control.laws.adaptive_gain import AdaptiveGain, AdaptiveGainSettings
from fivebar_control.laws.ctc import ctc_torque
from fivebar_control.laws.multi_model import reduced_ctc_torque, sigmoid_weight
from fivebar_control.laws.reference import Reference
from fivebar_control.laws.resolution import RESOLUTIONS, Resolution
from fivebar_control.laws.supervisor import blending_weight
from fivebar_control.laws.torque import Torque
from fivebar_control.laws.unified import NOTHING_KNOWN, UnifiedSettings, unified_step
from fivebar_control.laws.vhc_cartesian import vhc_cartesian_torque
from fivebar_control.laws.vhc_joint import vhc_joint_torque
from fivebar_control.model.line import Line
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


class ReducedCtcLaw:
    """Computed torque control with the model that lacks the platform, tau_B."""

    def __init__(self, robot: FiveBar, gains: Gains) -> None:
        """Bind the law to a robot and gains."""
        self._robot = robot
        self._gains = gains

    def __call__(self, sample: int, state: State, reference: Reference) -> Torque:
        """Return tau_B (Nm)."""
        return reduced_ctc_torque(self._robot, state, reference, self._gains.kp, self._gains.kd)


class UnifiedLaw:
    """The law that needs no other beside it: nearest to the wanted acceleration within the torque limit."""

    def __init__(self, robot: FiveBar, settings: UnifiedSettings, rate_hz: int | None = None) -> None:
        """Bind the law to a robot and its settings; without a sampling rate it observes no disturbance."""
        self._robot = robot
        self._settings = settings if rate_hz is not None else settings._replace(observer_rate=0.0)
        self._period = 1.0 / rate_hz if rate_hz is not None else math.inf
        self._memory = NOTHING_KNOWN
        self._last: int | None = None

    def __call__(self, sample: int, state: State, reference: Reference) -> Torque:
        """Return the torque (Nm); call it for every sample, since the estimated disturbance has a memory."""
        if self._last is not None and sample != self._last + 1:
            # what happened over the gap is not known; the disturbance stays
            self._memory = self._memory._replace(fresh=True)
        self._last = sample
        torque, self._memory = unified_step(self._robot, state, reference, self._memory, self._settings, self._period)
        return torque


class VhcCartesianLaw:
    """Virtual holonomic constraint law u3 along the planned path."""

    def __init__(self, robot: FiveBar, plan: Plan, rate_hz: int, gains: Gains, resolution: str) -> None:
        """Bind the law to a robot, a path, gains and one of the torque resolutions.

        Raises:
            InputError: there is no such resolution.
        """
        self._robot = robot
        self._path = plan.path
        self._rate_hz = rate_hz
        self._gains = gains
        self._resolve = _resolution(resolution)

    def __call__(self, sample: int, state: State, reference: Reference) -> Torque:
        """Return u3 (Nm)."""
        line = _through(self._path.line_at(sample / self._rate_hz), reference)
        return vhc_cartesian_torque(self._robot, state, reference, line, self._gains.kp, self._gains.kd, self._resolve)


class VhcJointLaw:
    """Virtual holonomic constraint law u2 along the planned path, with adaptive gain unless it is switched off."""

    def __init__(
        self,
        robot: FiveBar,
        plan: Plan,
        rate_hz: int,
        gains: Gains,
        resolution: str,
        adaptive_gain: AdaptiveGainSettings | None,
    ) -> None:
        """Bind the law to a robot, a path, gains, one of the torque resolutions and the adaptive gain.

        Raises:
            InputError: there is no such resolution.
        """
        self._robot = robot
        self._plan = plan
        self._rate_hz = rate_hz
        self._gains = gains
        self._resolve = _resolution(resolution)
        self._adaptive_gain = AdaptiveGain(adaptive_gain) if adaptive_gain is not None else None

    def __call__(self, sample: int, state: State, reference: Reference) -> Torque:
        """Return u2 (Nm); call it once for every sample, since the adaptive gain has a memory."""
        t = sample / self._rate_hz
        factor_p, factor_d = self._factors(t, state, reference)
        return vhc_joint_torque(
            self._robot,
            self._plan.mode1,
            self._plan.mode2,
            state,
            reference,
            _through(self._plan.path.line_at(t), reference),
            self._gains.kp * factor_p,
            self._gains.kd * factor_d,
            self._resolve,
        )

    def _factors(self, t: float, state: State, reference: Reference) -> tuple[float, float]:
        if self._adaptive_gain is None:
            return 1.0, 1.0
        in_zone = blending_weight(inverse_condition(state), self._plan.epsilon_at(t)) > 0.0
        return self._adaptive_gain.factors(in_zone, state.x - reference.state.x, state.y - reference.state.y)


def _through(line: Line, reference: Reference) -> Line:
    """Return a line in the same direction through the reference.

    On the plan the reference lies on the line, and it is the same. After a fault it rests where the robot stands, and
    a constraint on the planned line would pull the robot there.
    """
    return line._replace(x=reference.state.x, y=reference.state.y)


def _resolution(name: str) -> Resolution:
    if name not in RESOLUTIONS:
        raise InputError(f"vhc_resolution: {name!r}: expected one of {', '.join(RESOLUTIONS)}")
    return RESOLUTIONS[name]


class SupervisorState(NamedTuple):
    """The blending weight sigma and kappa = 1 / cond(A)."""

    sigma: float
    inverse_condition: float


class Supervisor:
    """The performance-based supervisor with the zone widths of a plan; in time for the multi-model method."""

    def __init__(self, plan: Plan, rate_hz: int, weighting: str) -> None:
        """Bind the supervisor to a plan; `weighting` is "condition" (4.1.2) or "sigmoid" (figure 1.10)."""
        self._plan = plan
        self._rate_hz = rate_hz
        self._times = [crossing.time for crossing in plan.crossings] if weighting == SIGMOID else None

    def __call__(self, sample: int, state: State) -> SupervisorState:
        """Return sigma and kappa for a sample."""
        t = sample / self._rate_hz
        kappa = inverse_condition(state)
        if self._times is not None:
            return SupervisorState(sigmoid_weight(t, self._times, self._plan.zone_time), kappa)
        return SupervisorState(blending_weight(kappa, self._plan.epsilon_at(t)), kappa)


CONDITION, SIGMOID = "condition", "sigmoid"


class Scheme(NamedTuple):
    """How a controller is put together.

    Attributes:
        on_locus: its law on the locus, None for no blending.
        weighting: what weighs the two laws.
        away: its law away from the locus, or the only one: "ctc" or "unified".
    """

    on_locus: str | None
    weighting: str = CONDITION
    away: str = "ctc"


SCHEMES = {
    "ctc": Scheme(None),
    "multi_joint": Scheme("vhc_joint"),
    "multi_cartesian": Scheme("vhc_cartesian"),
    "multi_model_ctc": Scheme("reduced_ctc", SIGMOID),
    "unified": Scheme(None, away="unified"),
}
"""The controllers that a run can choose, by name."""

ON_LOCUS_LAWS = tuple(scheme.on_locus for scheme in SCHEMES.values() if scheme.on_locus is not None)


def on_locus_law(
    name: str,
    robot: FiveBar,
    plan: Plan,
    rate_hz: int,
    gains: Gains,
    resolution: str,
    adaptive_gain: AdaptiveGainSettings | None,
) -> Law:
    """Return the law on the locus by its name, one of `ON_LOCUS_LAWS`.

    Raises:
        InputError: there is no such resolution.
    """
    if name == "reduced_ctc":
        return ReducedCtcLaw(robot, gains)
    if name == "vhc_joint":
        return VhcJointLaw(robot, plan, rate_hz, gains, resolution, adaptive_gain)
    return VhcCartesianLaw(robot, plan, rate_hz, gains, resolution)
