"""The robots that a scenario may turn out to run on: drawn within what is declared of its robot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from fivebar_bringup.odds.robot_errors import RobotErrors, drawn_effects, drawn_gyro_bias, drawn_scales
from fivebar_bringup.scenario import Scenario
from fivebar_description.loads import Loads
from fivebar_description.settings import sections
from fivebar_description.tolerances import Tolerances
from fivebar_sim.effects.bus import BusEffects
from fivebar_sim.effects.links import with_modelled_geometry
from fivebar_sim.effects.loads import Push, Tilt
from fivebar_sim.effects.settings import PINOCCHIO, PlantSettings

SECTIONS = sections(PlantSettings)
"""Sections of the settings of a simulated robot."""

ASSUMED = RobotErrors(mass_and_inertia=0.05, coulomb_friction=0.15, torque_constant=0.05, gyro_bias=0.02)
"""Bounds of what a robot file declares no tolerance of."""

S = TypeVar("S", bound=Scenario)


def has_odds(scenario: Scenario) -> bool:
    """Return whether a scenario's robot declares anything to draw from, and its run can be simulated by the engine."""
    return (
        scenario.declares_errors
        and scenario.plant.engine == PINOCCHIO
        and scenario.stands is None
        and not scenario.working_modes
    )


def declared_errors(scenario: Scenario) -> RobotErrors:
    """Return the bounds within which the robot of a scenario is drawn."""
    return errors_within(scenario.known_within(), scenario.to_bear())


def errors_within(known: Tolerances, loads: Loads) -> RobotErrors:
    """Return the bounds of robots that are known within tolerances and have loads to bear; the rest is `ASSUMED`."""
    return ASSUMED._replace(
        length=known.length,
        base=known.base,
        zero=known.zero,
        tilt=loads.tilt,
        push=loads.push,
        push_length=loads.push_length,
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
