"""Settings of laws that follow from the robot: from the torque of its crossings and the bandwidth that suits it.

The defaults of the laws are those of DexTAR, whose nominal crossing takes 0.55 Nm beyond friction. On a robot whose
crossing takes tau_0 a disturbance that matters as much is tau_0 / 0.55 Nm as large, and the weight of the torque in
`unified` is w = (a_0 / tau_0)^2 with a_0 = 0.95 m/s^2: the torque that the law saves is the torque of this robot, and
the error of acceleration that it admits for that is the same.
"""

from __future__ import annotations

from fivebar_control.laws.unified import UnifiedSettings
from fivebar_description.parameters import RobotFile

DEXTAR_CROSSING = 0.55
"""Torque (Nm) beyond friction of the robot whose torques the defaults are."""


def law_sizes(file: RobotFile) -> dict[str, dict[str, float]]:
    """Return the settings that a robot determines, by law and key; what it leaves open has the law's default."""
    usual, unified = UnifiedSettings(), dict[str, float]()
    if file.drives.crossing_torque is not None:
        ratio = file.drives.crossing_torque / DEXTAR_CROSSING
        unified |= {"weight": usual.weight / ratio**2, "disturbance_limit": usual.disturbance_limit * ratio}
    if file.tuning.bandwidth is not None:
        bandwidth = file.tuning.bandwidth
        unified |= {
            "kp": bandwidth**2,
            "kd": 2.0 * bandwidth,
            "observer_rate": usual.observer_rate * bandwidth**2 / usual.kp,
        }
    fallback = {f"fallback_{name}": unified[name] for name in ("kp", "kd", "weight") if name in unified}
    limit = {name: unified[name] for name in ("disturbance_limit",) if name in unified}
    return {"unified": unified, "mpc": {**fallback, **limit}, "lqr": fallback}
