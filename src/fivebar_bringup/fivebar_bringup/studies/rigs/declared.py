"""The rig of a robot's file: robots as the file declares them, with what it leaves open assumed, and variants of it.

A variant has one error less, another sensor, or another bandwidth; the robots drawn from it are otherwise the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from fivebar_bringup.odds.odds import PEAK_LIMIT
from fivebar_bringup.odds.robot_errors import ASSUMED, RobotErrors, errors_within
from fivebar_bringup.studies.rigs.rig import OF_ROBOT, Rig, check_rig, merged
from fivebar_control.estimation.ekf import EkfSettings
from fivebar_control.laws.robot_sizes import ELASTIC_DISTURBANCE_RATE, bandwidth_of, size_ratio, torque_ratio
from fivebar_control.laws.unified import UnifiedSettings
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.scenario.robot_defaults import expected_force
from fivebar_description.camera import CameraSettings
from fivebar_description.errors import InputError
from fivebar_description.files import is_yaml_path
from fivebar_description.imu import ImuSettings
from fivebar_description.loads import Loads
from fivebar_description.robot_file import RobotFile, read_robot
from fivebar_description.sensors import PassiveEncoder
from fivebar_description.settings import plain_keys
from fivebar_description.strict_yaml import validate
from fivebar_description.suggestion import expected_one_of
from fivebar_description.tolerances import Tolerances
from fivebar_description.transmission import RIGID

VARIANT = "#"
"""Between the robot of a rig and the variant of it."""

DECLARED = ""
"""The variant that is as declared."""

WITHOUT = 1e-9
"""In place of a declared bound of 0, which would stand for that of the robot's file."""

UNMEASURED = Tolerances(length=3e-4, base=3e-4, zero=5e-3)
"""Tolerances of a robot that is assembled from parts and was not calibrated."""

TILT = math.radians(2.0)
PUSH = 2.0
"""Assumed push per mass of the platform (N/kg): a fifth of its weight, as by a cable."""

PASSIVE = 3e-3
"""Assumed friction (Nm) in each passive joint of DexTAR, in proportion to the torque of other robots."""

MEMS = ImuSettings(gyro_noise=0.01, rate_hz=250, latency=0.004)
"""A gyroscope that a robot without one could have."""

MAGNETIC = PassiveEncoder(leg=2, counts=4096)
"""An encoder on a passive joint that a robot without one could have."""

OVERHEAD = CameraSettings(on=True, pictures=False)
"""A camera that a robot without one could have."""

USUAL_COUNTS = 20_000
"""Counts of motor encoders of which nothing is declared."""

LARGEST_BANDWIDTH = 70.0
"""Bandwidth of the unified law (rad/s) with a velocity that comes from encoders and a torque that is a sample late."""

ELASTIC_PLAY, PER_BACKLASH = 2.5e-3, 2.5
"""Difference that the estimator expects between motor and link of elastic transmissions: rad, and rad per rad of
backlash."""

ELASTIC_NOISE = 0.1
"""The same of noises (m/s^2 per root Hz, and rad/s of a gyroscope)."""

RIGID_DISTURBANCE_RATE = 0.3
"""Rate of the estimator's disturbance noise with rigid transmissions, for DexTAR's torques (Nm per root s)."""

UNIFIED_WEIGHT = 0.3
"""Torque weight of the law, for DexTAR's torques."""


class Assumption(NamedTuple):
    """Something that a robot's file does not declare, and what is assumed in place of it."""

    key: str
    words: str


class Variant(NamedTuple):
    """A change of a robot.

    Attributes:
        words: for a person.
        remedy: what makes the change, for a person; "" where that is plain.
        file: returns the changed robot.
        errors: bounds of what is drawn, in place of others.
        scenario: keys of a scenario, in place of others.
    """

    words: str
    remedy: str = ""
    file: Callable[[RobotFile], RobotFile] = lambda file: file
    errors: Mapping[str, Any] = {}
    scenario: Mapping[str, Any] = {}


def _rigid(file: RobotFile) -> RobotFile:
    return file.model_copy(update={"transmission": RIGID})


def _without_backlash(file: RobotFile) -> RobotFile:
    return file.model_copy(update={"transmission": file.transmission._replace(backlash=0.0)})


def _known(file: RobotFile, **exact: float) -> RobotFile:
    return file.model_copy(update={"tolerances": tolerances_or_assumed(file)._replace(**exact)})


REMOVED: dict[str, Variant] = {
    "lengths": Variant(
        "exact lengths and bases",
        "fivebar calibrate",
        lambda file: _known(file, length=WITHOUT, base=WITHOUT),
        {"length": 0.0, "base": 0.0},
    ),
    "zeros": Variant(
        "exact encoder zeros", "fivebar calibrate", lambda file: _known(file, zero=WITHOUT), {"zero": 0.0}
    ),
    "geometry": Variant(
        "exact lengths, bases and zeros",
        "fivebar calibrate",
        lambda file: _known(file, length=WITHOUT, base=WITHOUT, zero=WITHOUT),
        {"length": 0.0, "base": 0.0, "zero": 0.0},
    ),
    "masses": Variant("exact masses and inertias", "fivebar identify", errors={"mass_and_inertia": 0.0}),
    "friction": Variant("exact motor friction", "fivebar identify", errors={"coulomb_friction": 0.0}),
    "torque_constants": Variant("exact torque constants", "fivebar identify", errors={"torque_constant": 0.0}),
    "tilt": Variant("a level base", "a spirit level", errors={"tilt": 0.0}),
    "push": Variant("no push", "cables led off the platform", errors={"push": 0.0}),
    "passive_friction": Variant(
        "no friction in the passive joints",
        "bearings without preload",
        scenario={"plant": {"friction": {"passive": 0.0}}, "loads": {"passive": 0.0}},
    ),
    "lost_commands": Variant("no lost commands", "a faster computer or bus", errors={"lost_commands": 0}),
    "gyro_bias": Variant("no gyroscope bias", "a calibration at rest", errors={"gyro_bias": 0.0}),
    "backlash": Variant("no backlash", "preloaded transmissions", _without_backlash),
    "elasticity": Variant("rigid transmissions", "stiffer belts or gears", _rigid),
}
"""The robot with one error less each."""

SENSORS: dict[str, Variant] = {
    "encoders_alone": Variant(
        "motor encoders alone",
        file=lambda file: file.model_copy(update={"imu": None, "passive_encoder": None, "camera": None}),
    ),
    "gyroscope": Variant(
        "with a gyroscope",
        file=lambda file: file.model_copy(
            update={"imu": file.imu or MEMS, "passive_encoder": None, "camera": None},
        ),
    ),
    "passive_encoder": Variant(
        "with an encoder on a passive joint",
        file=lambda file: file.model_copy(
            update={"imu": None, "passive_encoder": file.passive_encoder or MAGNETIC, "camera": None}
        ),
    ),
    "camera": Variant(
        "with a camera",
        file=lambda file: file.model_copy(
            update={"imu": None, "passive_encoder": None, "camera": file.camera or OVERHEAD}
        ),
    ),
    "gyroscope_and_passive_encoder": Variant(
        "with a gyroscope and an encoder on a passive joint",
        file=lambda file: file.model_copy(
            update={"imu": file.imu or MEMS, "passive_encoder": file.passive_encoder or MAGNETIC, "camera": None}
        ),
    ),
}
"""The robot with each set of sensors beside the motors' encoders."""

FACTORS = {"bandwidth_0.6": 0.6, "bandwidth_1.5": 1.5, "bandwidth_2.2": 2.2}
"""Other bandwidths of the law, relative to the one that is derived or declared."""


def _bandwidth(factor: float) -> Variant:
    def changed(file: RobotFile) -> RobotFile:
        tuning = derived_tuning(file)
        bandwidth = round(factor * float(tuning["bandwidth"]), 1)
        return file.model_copy(update={"tuning": file.tuning._replace(bandwidth=bandwidth)})

    return Variant(f"{factor:g} times the bandwidth", file=changed)


TUNINGS = {name: _bandwidth(factor) for name, factor in FACTORS.items()}

REACHABLE = "reachable"
"""The robot exactly known, with a gyroscope: what its drives and its geometry let it do."""

VARIANTS = {
    DECLARED: Variant("as declared"),
    **REMOVED,
    **SENSORS,
    **TUNINGS,
    REACHABLE: Variant(
        "exactly known, with a gyroscope",
        file=lambda file: _known(file, length=WITHOUT, base=WITHOUT, zero=WITHOUT).model_copy(
            update={"imu": file.imu or MEMS}
        ),
    ),
}
"""All variants by name."""


def declares_robots(file: RobotFile) -> bool:
    """Return whether a robot's file says of its robots how they differ from it, or what they have to bear."""
    return file.tolerances.declared or file.loads.declared or file.transmission != RIGID


def robot_name(robot: str) -> str:
    """Return the name of a robot whose file can be read, a file's by its whole path.

    Raises:
        InputError: there is no such robot, or its file does not describe one.
    """
    read_robot(robot)
    return str(Path(robot).resolve()) if is_yaml_path(robot) else robot


def robots_drawn(robot: str) -> dict[str, str]:
    """Return the settings `rig` and `robot` of a sweep of a robot: as its file declares, if that says of robots at all.

    Raises:
        InputError: there is no such robot, or its file does not describe one.
    """
    name = robot_name(robot)
    return {"rig": f"{OF_ROBOT}{name}"} if declares_robots(read_robot(name)) else {"robot": name}


def declared_rig(name: str) -> Rig:
    """Return the rig of a robot, `ROBOT` or `ROBOT#VARIANT`.

    Raises:
        InputError: there is no such robot or variant, or the robot's file does not fit.
    """
    robot, variant = _parted(name)
    if variant not in VARIANTS:
        raise InputError(f"{name}: {variant!r}: {expected_one_of(variant, tuple(VARIANTS))}")
    changed = VARIANTS[variant]
    file = changed.file(read_robot(robot))
    content = {**_content(file, robot), "words": f"robots as {file.name} is declared, {changed.words}"}
    content["errors"] = {**content["errors"], **changed.errors}
    content["scenario"] = merged(content["scenario"], changed.scenario)
    rig = validate(content, Rig, robot)
    check_rig(rig, robot)
    return rig


def _parted(name: str) -> tuple[str, str]:
    """Return robot and variant of a rig; the path of a robot's file may have the sign between them, too."""
    if is_yaml_path(name) or VARIANT not in name:
        return name, DECLARED
    robot, _, variant = name.rpartition(VARIANT)
    return robot, variant


def tolerances_or_assumed(file: RobotFile) -> Tolerances:
    """Return how exactly a robot is known: as declared, else as one that was not calibrated."""
    return file.tolerances if file.tolerances.declared else UNMEASURED


def loads_or_assumed(file: RobotFile) -> Loads:
    """Return what a robot has to bear: as declared, else what most robots have to."""
    if file.loads.declared:
        return file.loads
    push, passive = PUSH * file.five_bar().mass, PASSIVE * min(1.0, torque_ratio(file))
    return Loads(tilt=TILT, push=_rounded(push), passive=_rounded(passive))


def _rounded(value: float) -> float:
    return float(f"{value:.2g}")


def torque_limit_or_usual(file: RobotFile) -> float:
    """Return the largest torque (Nm) of a robot's motors: as declared, else the planner's usual one."""
    return file.drives.torque_limit or MotionLimits().torque


def sees_platform(file: RobotFile) -> bool:
    """Return whether a robot has a sensor beside its motors' encoders."""
    return file.imu is not None or file.passive_encoder is not None or file.camera is not None


def derived_tuning(file: RobotFile) -> dict[str, float]:
    """Return the section `tuning` of a robot: what its file says, and what follows from its transmission and loads."""
    elastic, ratio = file.transmission != RIGID, torque_ratio(file)
    bandwidth = LARGEST_BANDWIDTH
    if elastic and file.transmission.frequency > 0.0:
        bandwidth = min(bandwidth, bandwidth_of(file.transmission.frequency))
    found = {
        "bandwidth": round(bandwidth, 1),
        "acceleration_noise": ELASTIC_NOISE if elastic else EkfSettings().acceleration_noise,
        "disturbance_rate": _rounded((ELASTIC_DISTURBANCE_RATE if elastic else RIGID_DISTURBANCE_RATE) * ratio),
        "force_deviation": _rounded(expected_force(file.five_bar(), loads_or_assumed(file))),
    }
    if elastic:
        found["play"] = _rounded(ELASTIC_PLAY + PER_BACKLASH * file.transmission.backlash)
        if file.imu is not None:
            found["gyro_noise"] = max(ELASTIC_NOISE, file.imu.gyro_noise)
    return {**found, **{name: value for name, value in file.tuning._asdict().items() if value is not None}}


def assumptions(file: RobotFile) -> list[Assumption]:
    """Return what a robot's file does not declare, and what is assumed in place of it."""
    drives, found = file.drives, []
    known, loads = tolerances_or_assumed(file), loads_or_assumed(file)
    if not file.tolerances.declared:
        words = f"links and bases ±{1e3 * known.length:g} mm, zeros ±{1e3 * known.zero:g} mrad: not calibrated"
        found.append(Assumption("tolerances", words))
    if not file.loads.declared:
        words = f"tilt {math.degrees(loads.tilt):.2g} degrees, push {loads.push:g} N, {loads.passive:g} Nm a joint"
        found.append(Assumption("loads", words))
    if drives.torque_limit is None:
        found.append(Assumption("drives.torque_limit", f"{torque_limit_or_usual(file):g} Nm"))
    if drives.encoder_counts is None:
        found.append(Assumption("drives.encoder_counts", f"{USUAL_COUNTS}"))
    if file.transmission == RIGID:
        found.append(Assumption("transmission", "rigid, without backlash"))
    else:
        found.append(Assumption("transmission.rotor_share", "as in the file or as usual, ±0.15"))
    if not sees_platform(file):
        found.append(Assumption("imu, passive_encoder, camera", "none"))
    found.append(
        Assumption(
            "errors of masses, friction, torque constants and timing",
            f"masses ±{100 * ASSUMED.mass_and_inertia:g} %, friction ±{100 * ASSUMED.coulomb_friction:g} %, torque"
            f" constants ±{100 * ASSUMED.torque_constant:g} %, 3 lost commands, commands and readings late by up to"
            " 0.5 ms",
        )
    )
    return found


def _errors(file: RobotFile) -> dict[str, Any]:
    within = errors_within(tolerances_or_assumed(file), loads_or_assumed(file))
    errors: dict[str, Any] = within._replace(
        lost_commands=3,
        gyro_bias=0.0 if file.imu is None else abs(file.imu.gyro_bias) or ASSUMED.gyro_bias,
    )._asdict()
    if file.transmission != RIGID:
        share = file.transmission.rotor_share
        errors["rotor_share"] = (max(0.02, share - 0.15), min(0.98, share + 0.15))
    usual = RobotErrors()._asdict()
    return {name: bound for name, bound in errors.items() if bound != usual[name]}


def _content(file: RobotFile, robot: str) -> dict[str, Any]:
    limit, size = torque_limit_or_usual(file), size_ratio(file.five_bar())
    return {
        "words": "",
        "leaves_out": "eccentric encoders, the distal links' own inertia, presliding, heat and wear",
        "robot": robot,
        "required": 0.9,
        "errors": _errors(file),
        "scenario": {
            "estimator": "ekf",
            "tracking_error_limit": 2.0 * size * PEAK_LIMIT,
            "error_tolerance": size * PEAK_LIMIT,
            "plant": _plant(file, limit),
            **_sensors(file),
            **_settings(file),
            "tolerances": plain_keys(tolerances_or_assumed(file)),
            "loads": plain_keys(loads_or_assumed(file)),
        },
    }


def _plant(file: RobotFile, limit: float) -> dict[str, Any]:
    friction = file.friction
    plant: dict[str, Any] = {
        "encoder_counts": file.drives.encoder_counts or USUAL_COUNTS,
        "torque_quantum": 1e-3 * limit,
        "delay_samples": max(1, file.drives.delay_samples),
        "friction": {
            "stribeck": 1.3,
            "viscous": 0.0125 * (friction.f_s11 + friction.f_s21),
            "passive": loads_or_assumed(file).passive,
        },
        "motors": {"ripple": 0.03, "cogging": 0.02 * limit, "current_loop_hz": 1000.0},
        "timing": dict.fromkeys(("command_delay", "command_jitter", "reading_age", "reading_jitter"), 2.5e-4),
    }
    if file.transmission != RIGID:
        plant["transmission"] = plain_keys(file.transmission)
        # drawn
        del plant["transmission"]["rotor_share"]
        plant["platform_joint"] = {"stiffness": 3e5, "clearance": 2e-5}
    return plant


def _sensors(file: RobotFile) -> dict[str, Any]:
    imu = file.imu or ImuSettings()
    return {
        "imu": plain_keys(imu._replace(gyro_bias=0.0)),
        "sensors": {"passive_encoder": plain_keys(file.passive_encoder or PassiveEncoder())},
        # the engine renders no pictures
        "camera": {**plain_keys(file.camera or CameraSettings()), "on": file.camera is not None, "pictures": False},
    }


def _settings(file: RobotFile) -> dict[str, Any]:
    tuning, ratio = derived_tuning(file), torque_ratio(file)
    bandwidth = tuning["bandwidth"]
    unified = {
        "kp": bandwidth**2,
        "kd": 2.0 * bandwidth,
        "weight": UNIFIED_WEIGHT / ratio**2,
        "observer_rate": UnifiedSettings().observer_rate * min(1.0, bandwidth**2 / UnifiedSettings().kp),
    }
    lower = min(40.0, bandwidth)
    gains = {"kp": lower**2, "kd": 2.0 * lower, "kp_vhc": lower**2, "kd_vhc": 2.0 * lower}
    ekf: dict[str, Any] = {name: value for name, value in tuning.items() if name in EkfSettings._fields}
    ekf |= {"gyro": file.imu is not None, "camera": file.camera is not None, "force_time": 0.4}
    ekf["play_frequency"] = file.transmission.frequency
    if file.imu is not None and "gyro_noise" not in ekf and file.imu.gyro_noise > 0.0:
        ekf["gyro_noise"] = file.imu.gyro_noise
    return {"gains": gains, "unified": unified, "ekf": ekf}
