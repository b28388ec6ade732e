# SPDX-License-Identifier: Apache-2.0
"""The motion of a robot with effects as machine code, for a plant that is moved by Python."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

# beside the engine, of which it is a part
from fivebar_bringup.simulation import engine
from fivebar_bringup.simulation.robot import later_with_effects
from fivebar_control.laws.torque import Torque
from fivebar_description.parameters import FiveBar
from fivebar_sim.effects.mechanism import Mechanism
from fivebar_sim.effects.mechanism_state import MechanismState, Moved


def _later(robot: FiveBar, mechanism: Mechanism, plant: MechanismState, number: int, tau1: float, tau2: float) -> Moved:
    return later_with_effects(robot, mechanism, 1, 0.0, plant, number, Torque(tau1, tau2))


@cache
def compiled_motion() -> Callable[[Mechanism, MechanismState, int, float, float], Moved]:
    """Return `advanced` of `fivebar_sim.effects.motion` as machine code, which the engine shares.

    The first call compiles for a minute where no process has done so before; then it loads the code from disk.
    """
    assert later_with_effects in engine.PARTS, "its machine code is kept for both"
    # numba takes half a second to import
    from fivebar_control.compiling import compiled_and_kept

    later = compiled_and_kept(_later)

    def moved(mechanism: Mechanism, state: MechanismState, number: int, tau1: float, tau2: float) -> Moved:
        result: Moved = later(mechanism.robot, mechanism, state, number, tau1, tau2)
        return result

    return moved
