# SPDX-License-Identifier: Apache-2.0
"""The simulated robot in the compiled loop: rigid and ideal, or with the effects of `fivebar_sim.effects`.

Both come as three functions, which the engine binds to the loop as it does the laws, so that the code of effects is
compiled only where there are some.
"""

from __future__ import annotations

from typing import NamedTuple

from fivebar_bringup.simulation.plant import Closed, PlantState, advanced_plant, chain_at, closed
from fivebar_control.laws.torque import Torque
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.state import Joints, WorkingMode
from fivebar_description.parameters import FiveBar
from fivebar_sim.effects.mechanism import Mechanism
from fivebar_sim.effects.mechanism_state import MechanismState, Moved
from fivebar_sim.effects.motion import advanced, started
from fivebar_sim.effects.observation import joints_of, joints_seen


class Sensed(NamedTuple):
    """The joints of a robot: exact ones, and as encoders see them before they count."""

    exact: Joints
    seen: Joints


def ideal_start(robot: FiveBar, actual: FiveBar, mode: WorkingMode, mechanism: None, x: float, y: float) -> PlantState:
    """Return the robot at rest with its platform at (x, y) m in the working mode, on the closed loop."""
    q = inverse_geometry(actual, mode, x, y)
    return closed(actual, PlantState(chain_at(q.q11, q.q12, 0.0, 0.0), chain_at(q.q21, q.q22, 0.0, 0.0))).state


def ideal_later(
    actual: FiveBar, mechanism: None, steps: int, step: float, plant: PlantState, number: int, applied: Torque
) -> Closed:
    """Return the robot one sample after a sample's under motor torques (Nm), and the loop's gap (m) on the way.

    The sample is `steps` integration steps of `step` (s).
    """
    return advanced_plant(actual, plant, steps, step, applied.tau1, applied.tau2)


def ideal_sensed(mechanism: None, plant: PlantState) -> Sensed:
    """Return the joints."""
    leg1, leg2 = plant.leg1, plant.leg2
    exact = Joints(leg1.q1, leg1.q2, leg2.q1, leg2.q2, leg1.dq1, leg1.dq2, leg2.dq1, leg2.dq2)
    return Sensed(exact, exact)


def start_with_effects(
    robot: FiveBar, actual: FiveBar, mode: WorkingMode, mechanism: Mechanism, x: float, y: float
) -> MechanismState:
    """Return the robot at rest where its encoders say that the modelled platform is at (x, y) m."""
    q = inverse_geometry(robot, mode, x, y)
    return started(mechanism, q.q11, q.q12, q.q21, q.q22).state


def later_with_effects(
    actual: FiveBar,
    mechanism: Mechanism,
    steps: int,
    step: float,
    plant: MechanismState,
    number: int,
    applied: Torque,
) -> Moved:
    """Return the robot one sample after a sample's, as :func:`ideal_later` does."""
    return advanced(mechanism, plant, number, applied.tau1, applied.tau2)


def sensed_with_effects(mechanism: Mechanism, plant: MechanismState) -> Sensed:
    """Return the joints."""
    j, k = joints_of(plant), joints_seen(plant)
    return Sensed(
        Joints(j.q11, j.q12, j.q21, j.q22, j.dq11, j.dq12, j.dq21, j.dq22),
        Joints(k.q11, k.q12, k.q21, k.q22, k.dq11, k.dq12, k.dq21, k.dq22),
    )
