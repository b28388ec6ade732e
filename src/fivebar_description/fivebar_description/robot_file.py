# SPDX-License-Identifier: Apache-2.0
"""Robot files: sections, and what they say of a robot as the numbers that equations, planner and estimator take."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from fivebar_description import physical_bounds
from fivebar_description.camera import CameraSettings
from fivebar_description.errors import InputError
from fivebar_description.extra_sensor import ExtraSection
from fivebar_description.files import is_yaml_path, read_text, share_file, yaml_path
from fivebar_description.forbidden import MOST, ForbiddenPosture
from fivebar_description.imu import ImuSettings
from fivebar_description.known_drives import NO_DRIVES, KnownDrives
from fivebar_description.loads import NO_FORCES, NO_LOADS, Forces, Loads
from fivebar_description.parameters import FiveBar, LegParameters, laden, tip_masses
from fivebar_description.physical_bounds import (
    Coordinate,
    CoulombFriction,
    FrictionWidth,
    Inertia,
    InertiaOrZero,
    Length,
    MassOrZero,
    ResidualInertia,
    Torque,
)
from fivebar_description.plausibility import implausible
from fivebar_description.sensors import NOTHING_KNOWN, KnownSensors, PassiveEncoder
from fivebar_description.settings import Section
from fivebar_description.strict_yaml import NEWEST, Format, StrictModel, parse_versioned, validate
from fivebar_description.tolerances import EXACT, Tolerances
from fivebar_description.transmission import RIGID, Transmission
from fivebar_description.tuning import NO_TUNING, Tuning

Place = Annotated[tuple[Coordinate, Coordinate], Field(strict=False)]

UNKNOWN: Literal["unknown"] = "unknown"


def _true_false_or_unknown(value: object) -> object:
    # not by equality: 1 is True
    if isinstance(value, bool) or value == UNKNOWN:
        return value
    raise ValueError("expected true, false or unknown")


ElbowsPass = Annotated[Literal[True, False, "unknown"], BeforeValidator(_true_false_or_unknown)]
"""Whether the elbows may pass each other, as they do where the distal links are folded onto each other."""

HOME = (0.0, 0.15)
"""Where a robot rests by default (m)."""

HOME_MODE = (1, -1)
"""Default working mode of a robot that rests where its file says: elbows outwards."""


class Grouped(NamedTuple):
    """zz_11R, zz_21R, zz_12R, zz_22R (kg m^2) and m (kg)."""

    inertia1: float
    inertia2: float
    residual1: float
    residual2: float
    mass: float


class Lengths(StrictModel):
    """Section `lengths_m`."""

    a: Length
    l_11: Length
    l_12: Length
    l_21: Length
    l_22: Length


class Inertias(StrictModel):
    """Section `inertias_kg_m2`: grouped inertias about the motor axes, residual inertias of the distal links."""

    zz_11R: Inertia
    zz_21R: Inertia
    zz_12R: ResidualInertia = 0.0
    zz_22R: ResidualInertia = 0.0


class Mass(StrictModel):
    """Section `mass_kg`: the platform mass."""

    m: physical_bounds.Mass


class Friction(StrictModel):
    """Section `friction`: 1.32 per motor, and the width of its smoothing."""

    f_s11: CoulombFriction
    f_s21: CoulombFriction
    f_off11: Torque
    f_off21: Torque
    width_rad_s: FrictionWidth


class CoggingHarmonic(StrictModel):
    """A harmonic of a motor's cogging, as `identify --cogging` finds it: the torque (Nm) that compensates it."""

    periods: Annotated[int, Field(ge=1, le=1000)]
    cosine: Torque
    sine: Torque


Harmonics = Annotated[tuple[CoggingHarmonic, ...], Field(strict=False, max_length=2)]


class MotorCogging(StrictModel):
    """Section `cogging`: what the laws compensate of each motor's cogging, by its angle; nothing by default."""

    q11: Harmonics = ()
    q21: Harmonics = ()


NO_COGGING = MotorCogging()


class ProximalLink(StrictModel):
    """A proximal link with all that turns with its motor: mass, centre of mass from the axis, inertia about that."""

    mass_kg: physical_bounds.Mass
    centre_m: Coordinate
    inertia_kg_m2: InertiaOrZero


class DistalLink(StrictModel):
    """A distal link as it was weighed: its mass, its centre of mass from the elbow, its inertia about that centre."""

    mass_kg: physical_bounds.Mass
    centre_m: Annotated[Coordinate, Field(ge=0.0)]
    inertia_kg_m2: Inertia


class ProximalLinks(StrictModel):
    """Section `proximal_links`: with `distal_links`, in place of the grouped parameters."""

    leg_1: ProximalLink
    leg_2: ProximalLink


class DistalLinks(StrictModel):
    """Section `distal_links`: beside grouped parameters, which contain what the links add to them, for the URDF."""

    leg_1: DistalLink
    leg_2: DistalLink


class EndEffector(StrictModel):
    """Section `end_effector` beside the links: mass at the platform point, inertia of what turns with leg 2 there."""

    mass_kg: MassOrZero
    inertia_kg_m2: InertiaOrZero = 0.0


class Links(NamedTuple):
    """All moving bodies, in place of grouped parameters."""

    proximal: ProximalLinks
    distal: DistalLinks
    effector: EndEffector


NO_EFFECTOR = EndEffector(mass_kg=0.0)
"""The end effector of a robot whose distal links end in a pin that belongs to one of them."""


def _on_where_given(section: Any) -> Any:
    return {"on": True, **section} if isinstance(section, dict) else section


def _where_on(camera: CameraSettings | None) -> CameraSettings | None:
    return camera if camera is not None and camera.on else None


OwnCamera = Annotated[Section[CameraSettings] | None, BeforeValidator(_on_where_given), AfterValidator(_where_on)]
"""The camera of a robot: a section means that there is one, where it does not say otherwise."""


class RobotFile(StrictModel):
    """One robot file, with the grouped parameters or with the links that they are made of."""

    format: Format = NEWEST
    name: Annotated[str, Field(min_length=1)]
    lengths_m: Lengths
    inertias_kg_m2: Inertias | None = None
    mass_kg: Mass | None = None
    proximal_links: ProximalLinks | None = None
    friction: Friction
    cogging: MotorCogging = NO_COGGING
    tolerances: Section[Tolerances] = EXACT
    loads: Section[Loads] = NO_LOADS
    forces: Section[Forces] = NO_FORCES
    distal_links: DistalLinks | None = None
    end_effector: EndEffector | None = None
    sensors: Section[KnownSensors] = NOTHING_KNOWN
    imu: Section[ImuSettings] | None = None
    passive_encoder: Section[PassiveEncoder] | None = None
    camera: OwnCamera = None
    extra_sensor: ExtraSection = Field(default_factory=dict)
    transmission: Section[Transmission] = RIGID
    drives: Section[KnownDrives] = NO_DRIVES
    tuning: Section[Tuning] = NO_TUNING
    home_m: Place = HOME
    forbidden: Annotated[tuple[ForbiddenPosture, ...], Field(strict=False, max_length=MOST)] = ()
    elbows_pass: ElbowsPass = UNKNOWN

    @model_validator(mode="after")
    def _moves_like_a_robot(self) -> RobotFile:
        if self.proximal_links is None:
            for key in ("inertias_kg_m2", "mass_kg"):
                if getattr(self, key) is None:
                    raise ValueError(f"{key}: is missing; or give proximal_links and distal_links in place of it")
            if self.end_effector is not None:
                raise ValueError("end_effector: expected only beside proximal_links and distal_links")
        else:
            if self.distal_links is None:
                raise ValueError("distal_links: is missing beside proximal_links")
            for key in ("inertias_kg_m2", "mass_kg"):
                if getattr(self, key) is not None:
                    raise ValueError(f"{key}: expected either grouped parameters or proximal_links, not both")
            for name, link, length in self._distals(self.distal_links):
                if link.centre_m > length:
                    raise ValueError(
                        f"distal_links.{name}.centre_m: {link.centre_m}: expected at most the length of the link,"
                        f" {length} m"
                    )
        self._check_forces()
        if self.transmission.backlash > 0.0 and self.transmission.frequency == 0.0:
            raise ValueError(
                f"transmission.backlash: {1e3 * self.transmission.backlash:g} mrad: backlash needs a transmission"
                " frequency: expected transmission.frequency above 0, say 300 (Hz)"
            )
        if self.passive_encoder is not None and self.passive_encoder.leg == 0:
            raise ValueError("passive_encoder.leg: is missing: expected 1 or 2, the leg whose passive joint has it")
        problem = implausible(self)
        if problem is not None:
            raise ValueError(problem)
        tip_masses(self.five_bar())
        return self

    def _check_forces(self) -> None:
        moments = {"moment_1": self.forces.moment_1, "moment_2": self.forces.moment_2}
        for key, moment in moments.items():
            if self.proximal_links is not None and moment is not None:
                raise ValueError(f"forces.{key}: {moment:g}: expected none beside proximal_links, which say it")
            if self.proximal_links is None and moment is None and self.forces.tilt > 0.0:
                raise ValueError(
                    f"forces.{key}: is missing: expected the leg's first mass moment (kg m), since the robot is tilted"
                )

    @property
    def declares_errors(self) -> bool:
        """Whether it says how far its robots differ from it, or what they have to bear."""
        return self.tolerances.declared or self.loads.declared or self.transmission != RIGID

    def five_bar(self) -> FiveBar:
        """Return the parameters as the plain numbers that the equations take."""
        lengths, friction, forces = self.lengths_m, self.friction, self.forces
        grouped = self.grouped()
        moment1, moment2 = self._moments()
        gravity_x, gravity_y = forces.gravity()
        leg1 = LegParameters(
            base_x=-lengths.a / 2.0,
            proximal=lengths.l_11,
            distal=lengths.l_12,
            inertia=grouped.inertia1,
            coulomb=friction.f_s11,
            offset=friction.f_off11,
            width=friction.width_rad_s,
            residual=grouped.residual1,
            moment=moment1,
            **_harmonics(self.cogging.q11),
        )
        leg2 = LegParameters(
            base_x=lengths.a / 2.0,
            proximal=lengths.l_21,
            distal=lengths.l_22,
            inertia=grouped.inertia2,
            coulomb=friction.f_s21,
            offset=friction.f_off21,
            width=friction.width_rad_s,
            residual=grouped.residual2,
            moment=moment2,
            **_harmonics(self.cogging.q21),
        )
        robot = FiveBar(leg1, leg2, grouped.mass, gravity_x, gravity_y, forces.force_x, forces.force_y)
        return laden(robot, forces.payload) if forces.payload > 0.0 else robot

    def _moments(self) -> tuple[float, float]:
        """Return the first mass moments of the legs (kg m); 0 on a level robot, on which they do not count."""
        if self.forces.tilt == 0.0:
            return 0.0, 0.0
        if self.proximal_links is None or self.distal_links is None:
            return self.forces.moment_1 or 0.0, self.forces.moment_2 or 0.0
        near, far, lengths = self.proximal_links, self.distal_links, self.lengths_m
        return (
            _moment_of_links(near.leg_1, far.leg_1, lengths.l_11, lengths.l_12),
            _moment_of_links(near.leg_2, far.leg_2, lengths.l_21, lengths.l_22),
        )

    def grouped(self) -> Grouped:
        """Return the grouped parameters, as they stand in the file or as the links add up to them."""
        if self.inertias_kg_m2 is not None and self.mass_kg is not None:
            zz = self.inertias_kg_m2
            return Grouped(zz.zz_11R, zz.zz_21R, zz.zz_12R, zz.zz_22R, self.mass_kg.m)
        links = self.weighed()
        if not isinstance(links, Links):
            raise AssertionError("a file without grouped parameters has all links")
        near, far, lengths = links.proximal, links.distal, self.lengths_m
        inertia1, residual1, tip1 = _of_links(near.leg_1, far.leg_1, lengths.l_11, lengths.l_12)
        inertia2, residual2, tip2 = _of_links(near.leg_2, far.leg_2, lengths.l_21, lengths.l_22)
        return Grouped(
            inertia1,
            inertia2,
            residual1,
            residual2 + links.effector.inertia_kg_m2,
            tip1 + tip2 + links.effector.mass_kg,
        )

    def weighed(self) -> Links | DistalLinks | None:
        """Return what the file knows of single bodies: all links, the distal ones only, or nothing."""
        if self.proximal_links is None or self.distal_links is None:
            return self.distal_links
        return Links(self.proximal_links, self.distal_links, self.end_effector or NO_EFFECTOR)

    def _distals(self, links: DistalLinks) -> tuple[tuple[str, DistalLink, float], ...]:
        return ("leg_1", links.leg_1, self.lengths_m.l_12), ("leg_2", links.leg_2, self.lengths_m.l_22)


def _harmonics(harmonics: tuple[CoggingHarmonic, ...]) -> dict[str, float]:
    """Return harmonics as fields of `LegParameters`."""
    return {
        f"{name}_{number}": float(getattr(harmonic, name))
        for number, harmonic in enumerate(harmonics, start=1)
        for name in ("periods", "cosine", "sine")
    }


def _of_links(near: ProximalLink, far: DistalLink, proximal: float, distal: float) -> tuple[float, float, float]:
    """Return zz_i1R, zz_i2R (kg m^2) and the mass at the platform (kg) of a leg's links, of these lengths (m).

    A rigid link moves like a mass at each of its ends, which have its mass and its centre of mass, and a massless
    inertia that compensates the difference.
    """
    tip = far.mass_kg * far.centre_m / distal
    elbow = far.mass_kg - tip
    return (
        near.inertia_kg_m2 + near.mass_kg * near.centre_m**2 + elbow * proximal**2,
        far.inertia_kg_m2 - far.mass_kg * far.centre_m * (distal - far.centre_m),
        tip,
    )


def _moment_of_links(near: ProximalLink, far: DistalLink, proximal: float, distal: float) -> float:
    """Return the first mass moment (kg m) of a leg's links about its motor, of these lengths (m)."""
    return near.mass_kg * near.centre_m + far.mass_kg * (1.0 - far.centre_m / distal) * proximal


def robot_path(robot: str) -> Path:
    """Return the robot file for a robot's name ("dextar") or for a path to a YAML file.

    Raises:
        InputError: no such name.
    """
    return yaml_path("robot", robot, share_file("fivebar_description", "config"))


def load_robot(robot: str = "dextar") -> FiveBar:
    """Read a robot by name or by path.

    Raises:
        InputError: the file is missing or does not describe a five-bar.
    """
    return read_robot(robot).five_bar()


def read_robot(robot: str = "dextar") -> RobotFile:
    """Read a robot's whole file by name or by path.

    Raises:
        InputError: the file is missing or does not describe a five-bar.
    """
    return _read_text(read_text(Path(robot)), robot) if is_yaml_path(robot) else _read_shipped(robot)


@functools.cache
def _read_shipped(robot: str) -> RobotFile:
    """Read a file of this package, which does not change: once, since a run asks for its robot again and again."""
    path = robot_path(robot)
    return validate(parse_versioned(read_text(path), str(path)), RobotFile, str(path))


@functools.lru_cache(maxsize=16)
def _read_text(text: str, source: str) -> RobotFile:
    """Read the text of a file of a user, which may change: each text once."""
    content = parse_versioned(text, source)
    if isinstance(content, dict) and "waypoints" in content and "lengths_m" not in content:
        raise InputError(
            f"{source}: is a scenario: expected a robot file; {content.get('robot', 'dextar')} is the scenario's robot"
        )
    return validate(content, RobotFile, source)
