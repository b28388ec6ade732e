"""Parameters of a five-bar robot: lengths, identified inertias, mass and friction, read from a file."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Annotated, NamedTuple

from pydantic import Field

from fivebar_description.known_sensors import NOTHING_KNOWN, KnownSensors
from fivebar_description.loads import NO_LOADS, Loads
from fivebar_description.settings import Section
from fivebar_description.share import share_file
from fivebar_description.strict_yaml import InputError, StrictModel, read_yaml
from fivebar_description.tolerances import EXACT, Tolerances

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]


class LegParameters(NamedTuple):
    """Leg i of the robot: base O_i = (base_x, 0), proximal link l_i1, distal link l_i2.

    Units: m, kg m^2, Nm. `inertia` is zz_i1R about the motor axis; friction is 1.32 with sign smoothed to
    tanh(qdot / width), width in rad/s.
    """

    base_x: float
    proximal: float
    distal: float
    inertia: float
    coulomb: float
    offset: float
    width: float


class FiveBar(NamedTuple):
    """The reduced model of the thesis: two legs and the platform mass m (kg)."""

    leg1: LegParameters
    leg2: LegParameters
    mass: float


class Lengths(StrictModel):
    """Section `lengths_m`."""

    a: Positive
    l_11: Positive
    l_12: Positive
    l_21: Positive
    l_22: Positive


class Inertias(StrictModel):
    """Section `inertias_kg_m2`: the grouped inertias about the motor axes."""

    zz_11R: Positive
    zz_21R: Positive


class Mass(StrictModel):
    """Section `mass_kg`: the platform mass."""

    m: Positive


class Friction(StrictModel):
    """Section `friction`: 1.32 per motor, and the width of its smoothing."""

    f_s11: NotNegative
    f_s21: NotNegative
    f_off11: float
    f_off21: float
    width_rad_s: Positive


class DistalLink(StrictModel):
    """A distal link as it was weighed: its mass, its centre of mass from the elbow, its inertia about that centre."""

    mass_kg: Positive
    centre_m: NotNegative
    inertia_kg_m2: Positive


class DistalLinks(StrictModel):
    """Section `distal_links`: for the URDF. The model has what the links add to the grouped parameters in those."""

    leg_1: DistalLink
    leg_2: DistalLink


class RobotFile(StrictModel):
    """One parameter file."""

    name: Annotated[str, Field(min_length=1)]
    lengths_m: Lengths
    inertias_kg_m2: Inertias
    mass_kg: Mass
    friction: Friction
    tolerances: Section[Tolerances] = EXACT
    loads: Section[Loads] = NO_LOADS
    distal_links: DistalLinks | None = None
    sensors: Section[KnownSensors] = NOTHING_KNOWN

    def five_bar(self) -> FiveBar:
        """Return the parameters as the plain numbers that the equations take."""
        lengths, friction = self.lengths_m, self.friction
        leg1 = LegParameters(
            base_x=-lengths.a / 2.0,
            proximal=lengths.l_11,
            distal=lengths.l_12,
            inertia=self.inertias_kg_m2.zz_11R,
            coulomb=friction.f_s11,
            offset=friction.f_off11,
            width=friction.width_rad_s,
        )
        leg2 = LegParameters(
            base_x=lengths.a / 2.0,
            proximal=lengths.l_21,
            distal=lengths.l_22,
            inertia=self.inertias_kg_m2.zz_21R,
            coulomb=friction.f_s21,
            offset=friction.f_off21,
            width=friction.width_rad_s,
        )
        return FiveBar(leg1, leg2, self.mass_kg.m)


def robot_path(robot: str) -> Path:
    """Return the parameter file for a robot's name ("dextar") or for a path to a YAML file."""
    if robot.endswith((".yaml", ".yml")):
        return Path(robot)
    path = share_file("fivebar_description", "config", f"{robot}.yaml")
    if not path.is_file():
        known = ", ".join(sorted(file.stem for file in path.parent.glob("*.yaml")))
        raise InputError(f"robot {robot!r}: expected one of {known}, or a path to a .yaml file")
    return path


def load_robot(robot: str = "dextar") -> FiveBar:
    """Read a robot by name or by path.

    Raises:
        InputError: the file is missing or does not describe a five-bar.
    """
    return read_robot(robot).five_bar()


def read_robot(robot: str = "dextar") -> RobotFile:
    """Read a robot's whole parameter file by name or by path.

    Raises:
        InputError: the file is missing or does not describe a five-bar.
    """
    path = robot_path(robot)
    return read_yaml(path, RobotFile) if path == Path(robot) else _read_shipped(path)


@functools.cache
def _read_shipped(path: Path) -> RobotFile:
    """Read a file of this package, which does not change: once, since a run asks for its robot again and again."""
    return read_yaml(path, RobotFile)


def tolerances_of(robot: str, given: Tolerances = EXACT) -> Tolerances:
    """Return how exactly a robot (name or path) is known: as given, or by default as its file says.

    Raises:
        InputError: the file is missing or does not describe a five-bar.
    """
    return given if given != EXACT else read_robot(robot).tolerances


def known_sensors_of(robot: str) -> KnownSensors:
    """Return what is known of the sensors of a robot (name or path).

    Raises:
        InputError: the file is missing or does not describe a five-bar.
    """
    return read_robot(robot).sensors


def loads_of(robot: str, given: Loads = NO_LOADS) -> Loads:
    """Return what a robot (name or path) has to bear: as given, or by default as its file says.

    Raises:
        InputError: the file is missing or does not describe a five-bar.
    """
    return given if given != NO_LOADS else read_robot(robot).loads


def scaled(robot: FiveBar, mass: float = 1.0, inertia: float = 1.0, friction: float = 1.0) -> FiveBar:
    """Return the robot with its mass, inertias and friction multiplied: a plant with parameter errors."""

    def leg(one: LegParameters) -> LegParameters:
        return one._replace(inertia=one.inertia * inertia, coulomb=one.coulomb * friction, offset=one.offset * friction)

    return FiveBar(leg(robot.leg1), leg(robot.leg2), robot.mass * mass)
