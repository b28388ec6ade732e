# SPDX-License-Identifier: Apache-2.0
"""Errors of the robots of a rig, from their file and from each other, and the robot that random numbers make.

Every error is uniform between minus and plus its bound, or between 0 and its bound, and independent of the others. What
is known of masses, lengths, zeros, torque constants and gyroscope may be distributed normally instead.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from statistics import NormalDist
from typing import Annotated, Any, NamedTuple, TypeVar

import numpy as np

from fivebar_bringup.scenario import Scenario
from fivebar_description.imu import ImuSettings
from fivebar_description.loads import Loads
from fivebar_description.settings import Setting, sections
from fivebar_description.tolerances import Tolerances
from fivebar_description.transmission import RIGID, Transmission
from fivebar_sim.effects.links import with_modelled_geometry
from fivebar_sim.effects.loads import LOCUS, Push, Tilt
from fivebar_sim.effects.settings import PINOCCHIO, PlantSettings
from fivebar_sim.effects.timing import BusEffects

PUSH_LENGTH = 0.05
"""s. A push begins in its length before the first crossing, so that the robot meets it on the locus."""

_SCALES, _EFFECTS, _GYROSCOPE = 1, 2, 3
"""Random streams of a robot, beside its number and a seed."""

UNIFORM, NORMAL = "uniform", "normal"

NORMAL_DEVIATION = 0.5
"""Standard deviation of a normally distributed error as a share of its bound, which 95 % of them keep."""

NORMAL_REACH = 2.0
"""Largest normally distributed error as a share of its bound."""

LEAST_RELATIVE = -0.9
"""Least relative error, of normally distributed ones: masses and torque constants are positive."""

LOSSES = 0.2
"""s, around the first crossing, in which commands are lost."""

SECTIONS = sections(PlantSettings)
"""Sections of the settings of a simulated robot."""

S = TypeVar("S", bound=Scenario)


def _ascending(shares: tuple[float, float]) -> str | None:
    least, most = shares
    return None if 0.0 < least <= most < 1.0 else "expected two numbers between 0 and 1, the smaller one first"


class RobotErrors(NamedTuple):
    """Bounds of the errors that are drawn for each robot of a rig; 0 draws none."""

    mass_and_inertia: Annotated[
        float,
        Setting("Bound of mass and inertias, relative to the model, plus or minus.", at_least=0.0, at_most=0.9),
    ] = 0.0
    coulomb_friction: Annotated[
        float, Setting("Bound of Coulomb friction, relative to the model, plus or minus.", at_least=0.0, at_most=1.0)
    ] = 0.0
    length: Annotated[
        float, Setting("Bound of each link's and each base's error, plus or minus.", "m", at_least=0.0, at_most=0.1)
    ] = 0.0
    base: Annotated[
        float | None,
        Setting("Bound of each base's error, where it is not that of the links.", "m", at_least=0.0, at_most=0.1),
    ] = None
    zero: Annotated[
        float, Setting("Bound of each motor encoder's zero, plus or minus.", "rad", at_least=0.0, at_most=1.0)
    ] = 0.0
    torque_constant: Annotated[
        float, Setting("Bound of each torque constant, relative, plus or minus.", at_least=0.0, at_most=0.9)
    ] = 0.0
    rotor_share: Annotated[
        tuple[float, float] | None,
        Setting(
            "Least and largest share of the rotors in the inertia at the motors, for elastic transmissions.",
            check=_ascending,
        ),
    ] = None
    tilt: Annotated[
        float, Setting("Largest tilt of the base, in any direction.", "rad", at_least=0.0, at_most=math.pi / 2.0)
    ] = 0.0
    push: Annotated[
        float,
        Setting(
            "Largest push on the platform, in any direction, that meets it on the first locus.",
            "N",
            at_least=0.0,
            at_most=1e3,
        ),
    ] = 0.0
    push_length: Annotated[float, Setting("How long the push lasts.", "s", at_least=0.0, at_most=10.0)] = PUSH_LENGTH
    lost_commands: Annotated[
        int,
        Setting(f"Commands that are lost in {LOSSES:g} s around the first crossing.", at_least=0, at_most=1000),
    ] = 0
    gyro_bias: Annotated[
        float,
        Setting("Bound of a gyroscope's bias, plus or minus.", "rad/s", at_least=0.0, at_most=10.0),
    ] = 0.0
    distribution: Annotated[
        str,
        Setting(
            "How errors of masses, friction, lengths, zeros, torque constants and bias are distributed: evenly within"
            " their bounds, or normally, with standard deviations of half the bounds.",
            choices=(UNIFORM, NORMAL),
        ),
    ] = UNIFORM

    def spread(self, even: Sequence[float]) -> list[float]:
        """Return errors relative to their bounds, of numbers that are drawn evenly between -1 and 1."""
        if self.distribution == UNIFORM:
            return [*even]
        quantile = NormalDist(0.0, NORMAL_DEVIATION).inv_cdf
        # a number at the very end would be infinite
        shares = (min(max(0.5 * (1.0 + number), 1e-12), 1.0 - 1e-12) for number in even)
        return [min(max(quantile(share), -NORMAL_REACH), NORMAL_REACH) for share in shares]


NO_ERRORS = RobotErrors()


class Scales(NamedTuple):
    """Mass, inertia and friction of a robot, actual over modelled, by their keys in the section `plant`."""

    mass_scale: float
    inertia_scale: float
    friction_scale: float


def drawn_scales(errors: RobotErrors, seed: int, number: int) -> Scales:
    """Return the scales of the robot of a number."""
    random = np.random.default_rng((seed, number, _SCALES))
    mass, inertia, friction = errors.spread(random.uniform(-1.0, 1.0, 3).tolist())
    return Scales(
        1.0 + _relative(errors, errors.mass_and_inertia * mass),
        1.0 + _relative(errors, errors.mass_and_inertia * inertia),
        1.0 + _relative(errors, errors.coulomb_friction * friction),
    )


def _relative(errors: RobotErrors, error: float) -> float:
    return error if errors.distribution == UNIFORM else max(error, LEAST_RELATIVE)


def drawn_gyro_bias(errors: RobotErrors, seed: int, number: int) -> float:
    """Return the bias (rad/s) of the gyroscope of the robot of a number."""
    bound = errors.gyro_bias
    even = np.random.default_rng((seed, number, _GYROSCOPE)).uniform(-bound, bound)
    return float(even) if errors.distribution == UNIFORM or bound == 0.0 else bound * errors.spread([even / bound])[0]


def drawn_effects(errors: RobotErrors, seed: int, number: int, crossing: float) -> dict[str, Any]:
    """Return the sections of effects in `plant` of the robot of a number, and its seed, for a crossing at a time (s).

    Equal seeds and numbers make the same robot of any rig, with errors in proportion to the rig's bounds.
    """
    random = np.random.default_rng((seed, number, _EFFECTS))
    lengths, zeros, constants = (errors.spread(random.uniform(-1.0, 1.0, count).tolist()) for count in (6, 2, 2))
    tilt, force, share, before = random.uniform(0.0, 1.0, 4).tolist()
    tilted, pushed = random.uniform(-math.pi, math.pi, 2).tolist()
    effects: dict[str, Any] = {"seed": int(random.integers(2**31))}
    base = errors.length if errors.base is None else errors.base
    if max(errors.length, base) > 0.0:
        bounds = {"l_11": errors.length, "l_12": errors.length, "l_21": errors.length, "l_22": errors.length}
        bounds |= {"base_1": base, "base_2": base}
        effects["links"] = {name: bound * share for (name, bound), share in zip(bounds.items(), lengths, strict=True)}
    if errors.zero > 0.0:
        effects["encoders"] = dict(zip(("zero_1", "zero_2"), (errors.zero * share for share in zeros), strict=True))
    if errors.torque_constant > 0.0:
        drawn = [_relative(errors, errors.torque_constant * constant) for constant in constants]
        effects["motors"] = dict(zip(("constant_1", "constant_2"), drawn, strict=True))
    if errors.tilt > 0.0:
        effects["tilt"] = {"angle": errors.tilt * tilt, "heading": tilted}
    if errors.push > 0.0:
        effects["push"] = {
            "force": errors.push * force,
            "heading": pushed,
            "along": LOCUS,
            "start": max(0.0, crossing - errors.push_length * before),
            "length": errors.push_length,
        }
    if errors.lost_commands > 0:
        begin = max(0.0, crossing - 0.5 * LOSSES)
        effects["bus"] = {"lost_commands": errors.lost_commands, "lost_from": begin, "lost_within": LOSSES}
    if errors.rotor_share is not None:
        least, most = errors.rotor_share
        effects["transmission"] = {"rotor_share": least + (most - least) * share}
    return effects


ASSUMED = RobotErrors(mass_and_inertia=0.05, coulomb_friction=0.15, torque_constant=0.05, lost_commands=3)
"""Bounds of what no robot file declares a tolerance of."""


def assumed_words() -> str:
    """Return `ASSUMED` in words."""
    masses, friction, constants = ASSUMED.mass_and_inertia, ASSUMED.coulomb_friction, ASSUMED.torque_constant
    return (
        f"masses and inertias ±{100 * masses:g} %, friction ±{100 * friction:g} %, torque constants"
        f" ±{100 * constants:g} %, {ASSUMED.lost_commands} lost commands"
    )


ASSUMED_GYRO_BIAS = 0.02
"""Bound of a gyroscope's bias (rad/s) where its section `imu` has none."""

ROTOR_SHARE = 0.15
"""Bound of the rotor's share in the inertia at the motors, plus or minus."""


def not_drawn(scenario: Scenario) -> str:
    """Return why robots cannot be drawn for a scenario, in words; "" where they can."""
    if scenario.plant.engine != PINOCCHIO:
        return f"plant.engine: {scenario.plant.engine}: drawn robots are simulated by the engine {PINOCCHIO} alone"
    if scenario.stands is not None:
        return "stands: drawn robots start where the motion begins: expected none"
    if scenario.working_modes:
        return "working_modes: drawn robots keep one working mode: expected none"
    return ""


def has_odds(scenario: Scenario) -> bool:
    """Return whether a scenario's robot declares anything to draw from, and its run can be simulated by the engine."""
    return scenario.declares_errors and not not_drawn(scenario)


def declared_errors(scenario: Scenario) -> RobotErrors:
    """Return the bounds within which the robot of a scenario is drawn."""
    imu = scenario.imu if scenario.gyro else None
    return errors_within(scenario.known_within(), scenario.to_bear(), imu, scenario.plant.transmission)


def errors_within(
    known: Tolerances, loads: Loads, imu: ImuSettings | None = None, transmission: Transmission = RIGID
) -> RobotErrors:
    """Return the bounds of robots that are known within tolerances and have loads to bear; the rest is assumed.

    Args:
        known: how exactly lengths, bases and zeros are known.
        loads: that the robots have to bear.
        imu: whose gyroscope the estimator uses, None for none.
        transmission: of their motors.
    """
    share = transmission.rotor_share
    return ASSUMED._replace(
        length=known.length,
        base=known.base,
        zero=known.zero,
        tilt=loads.tilt,
        push=loads.push,
        push_length=loads.push_length,
        gyro_bias=0.0 if imu is None else abs(imu.gyro_bias) or ASSUMED_GYRO_BIAS,
        rotor_share=None if transmission == RIGID else (max(0.02, share - ROTOR_SHARE), min(0.98, share + ROTOR_SHARE)),
    )


def with_drawn_robot(scenario: S, errors: RobotErrors, seed: int, number: int, crossing: float) -> S:
    """Return a scenario with a robot drawn in place of its own.

    Friction, transmission, timing, sensors and drives are those of the section `plant`; what differs from one robot to
    the next is drawn.

    Args:
        scenario: with the motion.
        errors: bounds, each error uniform within its own.
        seed, number: with equal ones the same robot is drawn for any motion.
        crossing: when a push meets the robot (s).
    """
    drawn = drawn_effects(errors, seed, number, crossing)
    common = as_modelled(scenario.plant)
    friction = common.friction
    plant = common._replace(
        **drawn_scales(errors, seed, number)._asdict(),
        friction=friction._replace(passive=max(friction.passive, scenario.to_bear().passive)),
    )
    plant = with_sections(plant, drawn)
    imu = scenario.imu._replace(gyro_bias=drawn_gyro_bias(errors, seed, number))
    return scenario.model_copy(update={"plant": plant, "imu": imu})


def with_sections(plant: PlantSettings, drawn: Mapping[str, Any]) -> PlantSettings:
    """Return the settings of a simulated robot with what `drawn_effects` has drawn."""
    changed = {name: getattr(plant, name)._replace(**drawn[name]) for name in SECTIONS if name in drawn}
    return plant._replace(seed=drawn["seed"], **changed)


def as_modelled(plant: PlantSettings) -> PlantSettings:
    """Return the settings of a simulated robot without what differs from one robot to the next."""
    return plant._replace(
        links=with_modelled_geometry(plant.links),
        encoders=plant.encoders._replace(zero_1=0.0, zero_2=0.0),
        motors=plant.motors._replace(constant_1=0.0, constant_2=0.0),
        tilt=Tilt(),
        push=Push(),
        bus=BusEffects(),
    )
