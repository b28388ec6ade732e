# SPDX-License-Identifier: Apache-2.0
"""Effects that are assumed of a simulated robot whose file says how its robots differ from it.

A robot file has tolerances, loads and transmissions, but no ripple of the motors and no jitter of the bus. A robot that
is known within tolerances has these all the same, so that its motions are simulated with them wherever they are
simulated. A scenario's section `plant` overrides each.
"""

from __future__ import annotations

from typing import Any

from fivebar_description.known_drives import USUAL_TORQUE_LIMIT
from fivebar_description.robot_file import RobotFile
from fivebar_description.transmission import RIGID

STRIBECK = 1.3
"""Break-away over Coulomb friction."""

VISCOUS_TIME = 0.025
"""Viscous friction of a motor over the mean Coulomb friction of both (s/rad)."""

TORQUE_STEP, RIPPLE, COGGING = 1e-3, 0.03, 0.02
"""Resolution of the torque and cogging as shares of its limit, and ripple as a share of the torque."""

CURRENT_LOOP_HZ = 1000.0

LATE = 2.5e-4
"""Mean delay and jitter of commands and of readings, each (s)."""

PLATFORM_JOINT = {"stiffness": 3e5, "clearance": 2e-5}
"""Stiffness and clearance of a robot with elastic transmissions (N/m, m)."""


def assumed_effects(file: RobotFile) -> dict[str, Any]:
    """Return the keys of the section `plant` that are assumed of a robot; none where its file declares no errors."""
    if not file.declares_errors:
        return {}
    limit = file.drives.torque_limit or USUAL_TORQUE_LIMIT
    assumed: dict[str, Any] = {
        "torque_quantum": TORQUE_STEP * limit,
        "friction": {
            "stribeck": STRIBECK,
            "viscous": 0.5 * VISCOUS_TIME * (file.friction.f_s11 + file.friction.f_s21),
            "passive": file.loads.passive,
        },
        "motors": {"ripple": RIPPLE, "cogging": COGGING * limit, "current_loop_hz": CURRENT_LOOP_HZ},
        "timing": dict.fromkeys(("command_delay", "command_jitter", "reading_age", "reading_jitter"), LATE),
    }
    if file.transmission != RIGID:
        assumed["platform_joint"] = PLATFORM_JOINT
    return assumed
