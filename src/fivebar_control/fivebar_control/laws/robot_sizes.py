# SPDX-License-Identifier: Apache-2.0
"""Settings of laws that follow from the robot: from the torque of its crossings and the bandwidth that suits it.

The defaults of the laws are those of DexTAR, whose nominal crossing takes 0.55 Nm beyond friction. On a robot whose
crossing takes tau_0 a disturbance that matters as much is tau_0 / 0.55 Nm as large, and the weight of the torque in
`unified` is w = (a_0 / tau_0)^2 with a_0 = 0.95 m/s^2: the torque that the law saves is the torque of this robot, and
the error of acceleration that it admits for that is the same. Likewise with the weights of the torque in `mpc` and
`lqr`.
"""

from __future__ import annotations

import math
from typing import Any

from fivebar_control.laws.gains import DEXTAR_WEIGHTS, Gains, UnifiedSettings
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import RobotFile
from fivebar_description.tuning import Tuning

DEXTAR_CROSSING = 0.55
"""Torque (Nm) beyond friction of the robot whose torques the defaults are."""

DEXTAR_INERTIA = 0.201
"""`inertia_of` that robot (Nm per m/s^2)."""

DEXTAR_LINK = 0.09
"""Mean length (m) of that robot's links."""

CROSSING_SHARE = 0.5
"""Torque of a nominal crossing over the drives' limit, where the former is not known."""

MOTOR_SIDE, LINK_SIDE = 0.1, 0.05
"""Largest bandwidth of the unified law (rad/s) per lowest frequency of the transmissions (rad/s), where it feeds back
what an estimator makes of the motors' encoders, and where it feeds back the links' own motion. docs/robustness.md has
the derivation and what was measured."""

ELASTIC_DISTURBANCE_RATE = 0.1
"""Rate of the estimator's disturbance noise on a robot whose bandwidth the transmissions limit, for DexTAR's
torques (Nm per root s): a faster disturbance follows the oscillation between motor and link, which the estimator's
model does not have."""


def inertia_of(robot: FiveBar) -> float:
    """Return about how much torque an acceleration of the platform takes (Nm per m/s^2), away from singularities."""
    legs = robot.leg1, robot.leg2
    return 0.5 * sum(leg.inertia / leg.proximal + robot.mass * leg.proximal for leg in legs)


def size_ratio(robot: FiveBar) -> float:
    """Return the size of a robot over that of DexTAR: the mean length of its links."""
    legs = robot.leg1, robot.leg2
    return 0.25 * sum(leg.proximal + leg.distal for leg in legs) / DEXTAR_LINK


def torque_ratio(file: RobotFile) -> float:
    """Return tau_0 of a robot over that of DexTAR; 1 where its file says nothing of its drives' torque.

    Where only their limit is known tau_0 is half of that, and as much at least as the robot's inertia takes for the
    acceleration of DexTAR's nominal crossing: with drives too weak for that, motions are slower and errors of the
    acceleration count more.
    """
    drives = file.drives
    if drives.crossing_torque is not None:
        return drives.crossing_torque / DEXTAR_CROSSING
    if drives.torque_limit is None:
        return 1.0
    return max(CROSSING_SHARE * drives.torque_limit / DEXTAR_CROSSING, inertia_of(file.five_bar()) / DEXTAR_INERTIA)


def bandwidth_of(frequency: float, share: float = MOTOR_SIDE) -> float:
    """Return the bandwidth (rad/s) of the unified law that transmissions of a frequency (Hz) allow."""
    return share * 2.0 * math.pi * frequency


LARGEST_BANDWIDTH = 70.0
"""Bandwidth of the unified law (rad/s) with a velocity that comes from encoders and a torque that is a sample late."""

LARGEST_BLENDED = 40.0
"""The same of the blended controllers."""

ROBUST_WEIGHT = 0.3
"""Torque weight of the unified law on a robot that is known within tolerances, for DexTAR's torques ((m/s^2 / Nm)^2): a
tenth of the usual one. The drives' limit bounds the torque, and a larger weight delays corrections near the locus, for
which quick crossings with model errors fail."""


def bandwidth_for(file: RobotFile) -> float | None:
    """Return the bandwidth of the unified law (rad/s): of the file's tuning, else what its transmissions allow.

    None for the law's own, where the file declares nothing that a law has to allow for.
    """
    if file.tuning.bandwidth is not None or not file.declares_errors:
        return file.tuning.bandwidth
    frequency = file.transmission.frequency
    return round(min(LARGEST_BANDWIDTH, bandwidth_of(frequency)), 1) if frequency > 0.0 else LARGEST_BANDWIDTH


def blended_gains(file: RobotFile) -> Gains | None:
    """Return the gains of the blended controllers; None for the usual ones, as for `bandwidth_for`."""
    bandwidth = bandwidth_for(file)
    if bandwidth is None or not file.declares_errors:
        return None
    lower = min(LARGEST_BLENDED, bandwidth)
    return Gains(lower**2, 2.0 * lower, lower**2, 2.0 * lower)


def tuning_for(file: RobotFile, frequency: float) -> Tuning:
    """Return the tuning of a robot whose transmissions have a frequency (Hz): lower than its present one, or equal."""
    usual = math.sqrt(UnifiedSettings().kp)
    allowed = bandwidth_of(frequency)
    if allowed >= (file.tuning.bandwidth or usual):
        return file.tuning
    rate = min(ELASTIC_DISTURBANCE_RATE * torque_ratio(file), file.tuning.disturbance_rate or math.inf)
    return file.tuning._replace(bandwidth=round(allowed, 1), disturbance_rate=rate)


def sizes_of_law(name: str, file: RobotFile | None) -> dict[str, Any]:
    """Return the settings of a law that a robot determines, by key; none for a foreign law, or without a robot."""
    return {} if file is None else {**law_sizes(file).get(name, {})}


def law_sizes(file: RobotFile) -> dict[str, dict[str, float]]:
    """Return the settings that a robot determines, by law and key; what it leaves open has the law's default."""
    usual, unified = UnifiedSettings(), dict[str, float]()
    mpc, lqr = dict[str, float](), dict[str, float]()
    ratio = torque_ratio(file)
    if ratio != 1.0:
        unified |= {"weight": usual.weight / ratio**2, "disturbance_limit": usual.disturbance_limit * ratio}
        mpc = {name: weight / ratio**2 for name, weight in DEXTAR_WEIGHTS["mpc"].items()}
        mpc |= {"disturbance_limit": unified["disturbance_limit"]}
        lqr = {name: weight / ratio**2 for name, weight in DEXTAR_WEIGHTS["lqr"].items()}
    bandwidth = bandwidth_for(file)
    if bandwidth is not None:
        quicker = bandwidth**2 / usual.kp
        unified |= {
            "kp": bandwidth**2,
            "kd": 2.0 * bandwidth,
            "observer_rate": usual.observer_rate * (min(1.0, quicker) if file.declares_errors else quicker),
        }
    if file.declares_errors:
        unified["weight"] = ROBUST_WEIGHT / ratio**2
    fallback = {f"fallback_{name}": unified[name] for name in ("kp", "kd", "weight") if name in unified}
    sizes = {"unified": unified, "path": unified, "mpc": {**fallback, **mpc}, "lqr": {**fallback, **lqr}}
    gains = blended_gains(file)
    if gains is not None:
        sizes["ctc"] = {"kp": gains.kp, "kd": gains.kd}
        at_locus = {"kp": gains.kp_vhc, "kd": gains.kd_vhc}
        sizes |= dict.fromkeys(("reduced_ctc", "vhc_cartesian", "vhc_joint"), at_locus)
    return sizes
