# SPDX-License-Identifier: Apache-2.0
"""The guard before the drives: limits the commanded torque, and stops the robot once a fault is latched."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_control.fault import Fault
from fivebar_control.laws.blend import blend
from fivebar_control.laws.torque import ZERO, Torque
from fivebar_control.model.state import State, WorkingMode
from fivebar_control.safety.brake import brake_of, braking_after, stopping
from fivebar_control.safety.settings import SafetySettings
from fivebar_control.safety.stages import (
    NO_FAULT,
    excess_samples,
    fastest_motor,
    fault_of,
    first_fault,
    guard_limits_of,
    limited_torque,
)
from fivebar_description.parameters import FiveBar

ESTIMATE_FAULTS = (
    "estimate_ambiguous",
    "estimate_lost",
    "estimate_inconsistent",
    "gyroscope_missing",
    "gyroscope_late",
    "gyroscope_early",
    "gyroscope_saturated",
    "gyroscope_frozen",
)
"""Faults that an estimator clears which has found the robot again."""

FINAL_FAULTS = (
    *ESTIMATE_FAULTS,
    "homing_contradicted",
    "encoder_frozen",
    "recording_failed",
    "plant_diverged",
    "nodes_missing",
    "node_died",
    "command_timeout",
)
"""Faults of other nodes that only a new run clears, since the robot's posture is no longer known or a node is lost."""


class Decision(NamedTuple):
    """The torques (Nm) of a sample: requested by the laws, None while a fault is latched, and commanded."""

    requested: Torque | None
    applied: Torque


class Guard:
    """Blends the candidate torques, applies the stages of `safety` to them, and latches the first fault."""

    def __init__(
        self, robot: FiveBar, working_mode: WorkingMode, rate_hz: int, settings: SafetySettings | None = None
    ) -> None:
        """Make a guard of a robot in a working mode, at a sampling rate (Hz)."""
        self._robot = robot
        self._rate_hz = rate_hz
        self._mode = working_mode
        self._settings = settings if settings is not None else SafetySettings()
        self._limits = guard_limits_of(self._settings, rate_hz)
        self._brake = brake_of(self._settings, robot, rate_hz)
        self._braking = 0
        self._last_command = ZERO
        self._limited_samples = 0
        self._excess = 0
        self._final: Fault | None = None
        self._obstacle: str | None = "no sample has been complete since"
        self.fault: Fault | None = None
        """The latched fault, None while the robot may move."""

    def carry(self, robot: FiveBar) -> None:
        """Go on with another mass of the platform."""
        self._robot = robot
        self._brake = brake_of(self._settings, robot, self._rate_hz)

    @property
    def limited_samples(self) -> int:
        """Samples whose torque was reduced by the torque limit or the rate limit."""
        return self._limited_samples

    @property
    def brakes(self) -> bool:
        """Whether the robot is being braked after a fault."""
        return self._braking > 0

    def stop_braking(self) -> None:
        """Command zero torque from now on."""
        self._braking = 0

    def trip(self, fault: Fault) -> None:
        """Latch a fault that was found elsewhere, unless one is latched already; there is no torque from now on."""
        if fault != self.fault:
            self._braking = 0
            self._latch(fault)

    def _latch(self, fault: Fault) -> None:
        if fault.name in FINAL_FAULTS and self._final is None:
            self._final = fault
        if self.fault is None:
            self.fault = fault
            self._last_command = ZERO
            self._obstacle = "no sample has been complete since"

    def begin_run(self) -> None:
        """Begin a new run: faults that only a new run clears may be reset from now on; a latched fault stays."""
        self._final = None
        self._last_command = ZERO
        self._excess = 0
        self._braking = 0

    def find_again(self) -> None:
        """Let a reset clear a lost estimate: the estimator has begun again where the robot rests."""
        if self._final is not None and self._final.name in ESTIMATE_FAULTS:
            self._final = None
            self._obstacle = "no sample has been complete since"

    def reset(self) -> str | None:
        """Clear the latched fault if its cause is gone; else keep it and return the reason."""
        if self.fault is None:
            return None
        if self._final is not None:
            return f"only a new run clears {self._final}"
        if self._obstacle is not None:
            return self._obstacle
        self.fault = None
        self._braking = 0
        return None

    def stop(self, state: State) -> Torque:
        """Return the torque of a sample while a fault is latched: that of the brake, or zero; once for each sample."""
        torque, self._braking = stopping(self._brake, self._robot, state, self._braking)
        return torque

    def command(
        self, sample: int, state: State, desired: tuple[float, float], sigma: float, nominal: Torque, constraint: Torque
    ) -> Decision:
        """Return the torques of a sample: the blend before and after the limits; with a fault, what stops the robot.

        While a fault is latched, the inputs are only checked; the torque is that of `stop`.

        Args:
            sample: number of the sample, for the fault's text.
            state: measured or estimated state.
            desired: where the platform should be (m).
            sigma: blending weight.
            nominal: candidate for sigma = 0.
            constraint: candidate for sigma = 1.
        """
        limits, robot, mode = self._limits, self._robot, self._mode
        requested = blend(sigma, nominal, constraint)
        self._excess = excess_samples(limits, requested, self._excess)
        number = first_fault(limits, robot, mode, state, *desired, requested, self._excess)
        fault = None
        if number != NO_FAULT:
            fault = fault_of(number, limits, robot, mode, state, *desired, requested, sigma)
        if self.fault is not None:
            self._obstacle = str(fault) if fault is not None else motion_left(state, self._settings.rest_speed)
            return Decision(None, ZERO)
        if fault is not None:
            self._latch(Fault(fault.name, f"at sample {sample}: {fault.detail}"))
            self._braking = braking_after(self._brake, number)
            return Decision(requested, self.stop(state))
        torque = limited_torque(limits, requested, self._last_command)
        self._last_command = torque
        self._limited_samples += torque != requested
        return Decision(requested, torque)


def motion_left(state: State, rest_speed: float) -> str | None:
    """Return why a robot is not at rest, with the motor speed (rad/s) below which it is; None where it is."""
    speed = fastest_motor(state)
    if speed <= rest_speed:
        return None
    return f"the motors still turn at {speed:.2f} rad/s, at rest is below {rest_speed:g} rad/s"
