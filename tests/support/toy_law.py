# SPDX-License-Identifier: Apache-2.0
"""A law from outside the tree: computed torque with the model that lacks the platform, and an integral action."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_control.laws.law import Instant, Law
from fivebar_control.laws.multi_model import reduced_ctc_torque
from fivebar_control.laws.torque import Torque
from fivebar_description.parameters import FiveBar
from fivebar_description.settings import Setting


class ToySettings(NamedTuple):
    """Gains of the law."""

    kp: Annotated[float, Setting("Proportional gain.", "1/s^2", at_least=0.0, at_most=1e6)] = 900.0
    kd: Annotated[float, Setting("Derivative gain.", "1/s", at_least=0.0, at_most=1e5)] = 60.0
    ki: Annotated[float, Setting("Integral gain.", "Nm/(rad s)", at_least=0.0, at_most=1e5)] = 5.0


class ToyMemory(NamedTuple):
    """Integrals of the motors' errors (rad s)."""

    integral1: float
    integral2: float


def toy_step(robot: FiveBar, instant: Instant, memory: ToyMemory, settings: ToySettings) -> tuple[Torque, ToyMemory]:
    """Return the torque for a sample."""
    state, desired = instant.state, instant.reference.state
    integral1 = memory.integral1 + instant.period * (desired.leg1.q1 - state.leg1.q1)
    integral2 = memory.integral2 + instant.period * (desired.leg2.q1 - state.leg2.q1)
    torque = reduced_ctc_torque(robot, state, instant.reference, settings.kp, settings.kd)
    return (
        Torque(torque.tau1 + settings.ki * integral1, torque.tau2 + settings.ki * integral2),
        ToyMemory(integral1, integral2),
    )


def listed_step(robot: FiveBar, instant: Instant, memory: ToyMemory, settings: ToySettings) -> tuple[Torque, ToyMemory]:
    """Return the same, by way of what numba cannot compile."""
    return max([toy_step(robot, instant, memory, settings)], key=str)


LAW = Law(name="toy", title="toy law", settings=ToySettings, step=toy_step, memory=ToyMemory(0.0, 0.0))

UNCOMPILED = LAW._replace(name="toy_uncompiled", step=listed_step)
"""A law that does not say that it cannot be compiled."""

TAKEN = LAW._replace(name="ctc")
NOT_A_TOPIC = LAW._replace(name="Toy law")
NO_LAW = 3.0
