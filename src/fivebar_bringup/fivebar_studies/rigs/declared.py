# SPDX-License-Identifier: Apache-2.0
"""The rig of a robot's file: robots as the file declares them, with what it leaves open assumed, and variants of it.

A variant has one error less, another sensor, or another bandwidth; the robots drawn from it are otherwise the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from fivebar_bringup.odds.relief import MEMS, calibrated
from fivebar_bringup.odds.robot_errors import RobotErrors, assumed_words, errors_within
from fivebar_bringup.robots.check import by_keys_of_file
from fivebar_control.laws.robot_sizes import torque_ratio
from fivebar_control.scenario.robot_defaults import derived_tuning, robot_defaults, robot_tolerances
from fivebar_description.camera import CameraSettings
from fivebar_description.errors import InputError
from fivebar_description.files import is_yaml_path
from fivebar_description.imu import ImuSettings
from fivebar_description.known_drives import USUAL_TORQUE_LIMIT
from fivebar_description.loads import Loads
from fivebar_description.robot_file import RobotFile, read_robot
from fivebar_description.scenario_file import USUAL_COUNTS, parts_of_robot
from fivebar_description.sensors import PassiveEncoder
from fivebar_description.settings import plain_keys
from fivebar_description.strict_yaml import validate
from fivebar_description.suggestion import expected_one_of
from fivebar_description.tolerances import Tolerances
from fivebar_description.transmission import RIGID
from fivebar_sim.effects.assumed import LATE, assumed_effects
from fivebar_studies.rigs.rig import OF_ROBOT, Rig, check_rig, merged

VARIANT = "#"
"""Between the robot of a rig and the variant of it."""

DECLARED = ""
"""The variant that is as declared."""

WITHOUT = 1e-9
"""In place of a declared bound of 0, which would stand for that of the robot's file."""

EXACT_GEOMETRY = {"length": 0.0, "base": 0.0, "zero": 0.0}
"""Errors of a robot whose lengths, bases and zeros are exact."""

UNMEASURED = Tolerances(length=3e-4, base=3e-4, zero=5e-3)
"""Tolerances of a robot that is assembled from parts and was not calibrated."""

TILT = math.radians(2.0)
PUSH = 2.0
"""Assumed push per mass of the platform (N/kg): a fifth of its weight, as by a cable."""

PASSIVE = 3e-3
"""Assumed friction (Nm) in each passive joint of DexTAR, in proportion to the torque of other robots."""

MAGNETIC = PassiveEncoder(leg=2, counts=4096)
"""An encoder on a passive joint that a robot without one could have."""

OVERHEAD = CameraSettings(on=True, pictures=False)
"""A camera that a robot without one could have."""


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
    # a file that declares nothing but its transmission still declares something
    known = file.tolerances if file.tolerances.declared else file.tolerances._replace(length=WITHOUT)
    return file.model_copy(update={"transmission": RIGID, "tolerances": known})


def _without_backlash(file: RobotFile) -> RobotFile:
    return file.model_copy(update={"transmission": file.transmission._replace(backlash=0.0)})


def _calibrated(file: RobotFile, *names: str) -> RobotFile:
    """Return a robot's file with some tolerances as of a calibrated robot."""
    return file.model_copy(update={"tolerances": calibrated(file.tolerances, names)})


REMOVED: dict[str, Variant] = {
    "lengths": Variant(
        "exact lengths and bases",
        "fivebar calibrate",
        lambda file: _calibrated(file, "length", "base"),
        {"length": 0.0, "base": 0.0},
    ),
    "zeros": Variant("exact encoder zeros", "fivebar calibrate", lambda file: _calibrated(file, "zero"), {"zero": 0.0}),
    "geometry": Variant(
        "exact lengths, bases and zeros",
        "fivebar calibrate",
        lambda file: _calibrated(file, "length", "base", "zero"),
        EXACT_GEOMETRY,
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

USUAL_SENSORS = {"imu": MEMS, "passive_encoder": MAGNETIC, "camera": OVERHEAD}
"""Sensors that a robot without them could have, by their section of its file."""


def _seen_by(words: str, *sensors: str) -> Variant:
    """Return a robot with sensors beside the motors' encoders, its own where it has them, and without others."""

    def changed(file: RobotFile) -> RobotFile:
        of_file = {name: getattr(file, name) or usual for name, usual in USUAL_SENSORS.items()}
        return file.model_copy(update={name: of_file[name] if name in sensors else None for name in of_file})

    return Variant(words, file=changed)


SENSORS: dict[str, Variant] = {
    "encoders_alone": _seen_by("motor encoders alone"),
    "gyroscope": _seen_by("with a gyroscope", "imu"),
    "passive_encoder": _seen_by("with an encoder on a passive joint", "passive_encoder"),
    "camera": _seen_by("with a camera", "camera"),
    "gyroscope_and_passive_encoder": _seen_by(
        "with a gyroscope and an encoder on a passive joint", "imu", "passive_encoder"
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

UPGRADES = ("gyroscope", "geometry")
"""Changes that most often make the difference between a motion that is refused and one that is likely."""

VARIANTS = {
    DECLARED: Variant("as declared"),
    **REMOVED,
    **SENSORS,
    **TUNINGS,
    REACHABLE: Variant(
        "calibrated exactly, with a gyroscope",
        file=lambda file: _calibrated(file, "length", "base", "zero").model_copy(update={"imu": file.imu or MEMS}),
        errors=EXACT_GEOMETRY,
    ),
}
"""All variants by name."""


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
    return {"rig": f"{OF_ROBOT}{name}"} if read_robot(name).declares_errors else {"robot": name}


def rig_of(robot: str, variant: str = DECLARED) -> str:
    """Return the name of the rig of a robot, by name or path, or of a variant of it."""
    return f"{OF_ROBOT}{robot}{VARIANT if variant else ''}{variant}"


def declared_rig(name: str) -> Rig:
    """Return the rig of a robot, `ROBOT` or `ROBOT#VARIANT`.

    Raises:
        InputError: there is no such robot or variant, or the robot's file does not fit.
    """
    robot, variant = _parted(name)
    if variant not in VARIANTS:
        raise InputError(f"{name}: {variant!r}: {expected_one_of(variant, tuple(VARIANTS))}")
    changed = VARIANTS[variant]
    file = changed.file(with_assumptions(read_robot(robot)))
    content = {**_content(file, robot), "words": f"robots as {file.name} is declared, {changed.words}"}
    content["errors"] = {**content["errors"], **changed.errors}
    content["scenario"] = merged(content["scenario"], changed.scenario)
    try:
        rig = validate(content, Rig, robot)
        check_rig(rig, robot)
    except InputError as error:
        raise InputError(f"{robot}: {by_keys_of_file(str(error).removeprefix(f'{robot}: '))}") from error
    return rig


def _parted(name: str) -> tuple[str, str]:
    """Return robot and variant of a rig; the path of a robot's file may have the sign between them, too."""
    if is_yaml_path(name) or VARIANT not in name:
        return name, DECLARED
    robot, _, variant = name.rpartition(VARIANT)
    return robot, variant


def with_assumptions(file: RobotFile) -> RobotFile:
    """Return a robot's file, and one that declares no errors as of a robot that was assembled from parts.

    What is left out by a file that declares any errors is none, here as everywhere.
    """
    if file.declares_errors:
        return file
    push, passive = PUSH * file.five_bar().mass, PASSIVE * min(1.0, torque_ratio(file))
    loads = Loads(tilt=TILT, push=_rounded(push), passive=_rounded(passive))
    return file.model_copy(update={"tolerances": UNMEASURED, "loads": loads})


def _rounded(value: float) -> float:
    return float(f"{value:.2g}")


def sees_platform(file: RobotFile) -> bool:
    """Return whether a robot has a sensor beside its motors' encoders."""
    return any((file.imu, file.passive_encoder, file.camera, file.extra_sensor))


def assumptions(file: RobotFile) -> list[Assumption]:
    """Return what a robot's file does not declare, and what is assumed in place of it."""
    drives, assumptions, whole = file.drives, list[Assumption](), with_assumptions(file)
    known, loads = whole.tolerances, whole.loads
    if not file.tolerances.declared:
        words = f"links and bases ±{1e3 * known.length:g} mm, zeros ±{1e3 * known.zero:g} mrad: not calibrated"
        assumptions.append(Assumption("tolerances", words if known.declared else "exact lengths and zeros"))
    if not file.loads.declared:
        words = f"tilt {math.degrees(loads.tilt):.2g} degrees, push {loads.push:g} N, {loads.passive:g} Nm a joint"
        assumptions.append(
            Assumption("loads", words if loads.declared else "a level base, no push, frictionless joints")
        )
    if drives.torque_limit is None:
        assumptions.append(Assumption("drives.torque_limit", f"{USUAL_TORQUE_LIMIT:g} Nm"))
    if drives.encoder_counts is None:
        assumptions.append(Assumption("drives.encoder_counts", f"{USUAL_COUNTS}"))
    if file.transmission == RIGID:
        assumptions.append(Assumption("transmission", "rigid, without backlash"))
    else:
        assumptions.append(Assumption("transmission.rotor_share", "as in the file or as usual, ±0.15"))
    if not sees_platform(file):
        assumptions.append(Assumption("imu, passive_encoder, camera", "none"))
    assumptions.append(
        Assumption(
            "errors of masses, friction, torque constants and timing",
            f"{assumed_words()}, commands and readings late by up to {2e3 * LATE:g} ms",
        )
    )
    return assumptions


def _content(file: RobotFile, robot: str) -> dict[str, Any]:
    usual = RobotErrors()._asdict()
    errors = errors_within(file.tolerances, file.loads, file.imu, file.transmission)._asdict()
    parts, settings = parts_of_robot(file, estimated=True), robot_defaults(file, estimated=True)
    imu, camera = file.imu or ImuSettings(), file.camera or CameraSettings()
    plant = {**parts["plant"], **assumed_effects(file)}
    # that of the scenario, and drawn
    plant.pop("torque_limit", None)
    plant.get("transmission", {}).pop("rotor_share", None)
    return {
        "words": "",
        "leaves_out": "eccentric encoders, the distal links' own inertia, presliding, heat and wear",
        "robot": robot,
        "required": 0.9,
        "errors": {name: bound for name, bound in errors.items() if bound != usual[name]},
        "scenario": {
            "estimator": "ekf",
            **robot_tolerances(file),
            "plant": plant,
            "imu": plain_keys(imu._replace(gyro_bias=0.0)),
            "sensors": {"passive_encoder": plain_keys(file.passive_encoder or PassiveEncoder())},
            # the engine renders no pictures
            "camera": {
                **plain_keys(camera),
                "on": file.camera is not None,
                "pictures": False,
            },
            "extra_sensor": file.extra_sensor,
            **{name: keys for name, keys in settings.items() if name != "safety"},
            "tolerances": plain_keys(file.tolerances),
            "loads": plain_keys(file.loads),
        },
    }
