# SPDX-License-Identifier: Apache-2.0
"""Whether the numbers of a robot file can be those of one robot: relations between its keys.

Robots differ in size: a mass, a torque or an inertia is judged by the lengths and by the others, so that a printed
bench and an arm of a metre both pass. The limits are far from any robot; what exceeds them is in another unit, mostly
a thousand times too large. Bounds that hold for all sizes are those of the keys themselves (`physical_bounds`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from fivebar_description.other_units import in_other_unit

if TYPE_CHECKING:
    from fivebar_description.robot_file import RobotFile

LONGEST_LINK = 3.0
"""Length (m) of a link, or between the bases."""

LONGEST_OVER_SHORTEST = 30.0
"""Ratio of two links."""

DENSITY = 5e4
"""Mass of a moving body (kg) per cube of the mean link (m^3): a block of steel with edges of nearly two links."""

GYRATION = 0.03, 20.0
"""Root of a leg's inertia over the platform mass, in links: of arms without mass, and of rotors behind large gears."""

LEAST_ACCELERATION = 0.5
"""Acceleration (m/s^2) that the largest torque gives the platform mass at the end of a link."""

MOST_ACCELERATION = 2e4
"""Angular acceleration (rad/s^2) that the largest torque gives the leg with the platform mass at its end."""

MOST_DECELERATION = 2e3
"""Angular deceleration (rad/s^2) of the same by friction."""

PASSIVE_FRICTION = 10.0
"""Friction of a passive joint, as a multiple of that of a motor."""

FARTHEST_CENTRE = 3.0
"""Centre of mass of a proximal link, in lengths of the link."""

LARGEST_TOLERANCE = 0.1
"""Tolerance of a length, as a part of the shortest link."""

FARTHEST_HOME = 10.0
"""Distance of the home position, in lengths of the longer leg with half of the base."""


def implausible(file: RobotFile) -> str | None:
    """Return what is wrong with a robot file as a whole, by key, value and expectation; None if nothing."""
    return next(_problems(file), None)


def too_strong(file: RobotFile, torque: float) -> str | None:
    """Return what is wrong with a torque limit (Nm) for a robot, without its key; None if nothing."""
    most = MOST_ACCELERATION * _swung(file)
    if torque <= most:
        return None
    return f"{torque:g}: {_at_most(most, torque, 'Nm')}"


def _problems(file: RobotFile) -> Iterator[str]:
    yield from _of_lengths(file)
    yield from _of_masses(file)
    yield from _of_inertias(file)
    yield from _of_torques(file)
    yield from _of_push(file)


def _at_most(most: float, value: float, unit: str, robot: str = "a robot of this size") -> str:
    hint = in_other_unit(unit, lambda size: value * size <= most)
    return f"expected at most {most:.3g} {unit} for {robot}{hint}"


def _links(file: RobotFile) -> dict[str, float]:
    lengths = file.lengths_m
    return {"l_11": lengths.l_11, "l_12": lengths.l_12, "l_21": lengths.l_21, "l_22": lengths.l_22}


def _mean_link(file: RobotFile) -> float:
    links = _links(file).values()
    return sum(links) / len(links)


def _swung(file: RobotFile) -> float:
    """Return the larger inertia (kg m^2) about a motor, with the platform mass at the end of a mean link."""
    grouped = file.grouped()
    return max(grouped.inertia1, grouped.inertia2) + grouped.mass * _mean_link(file) ** 2


def _of_lengths(file: RobotFile) -> Iterator[str]:
    links = _links(file)
    for name, length in {"a": file.lengths_m.a, **links}.items():
        if length > LONGEST_LINK:
            yield f"lengths_m.{name}: {length:g}: {_at_most(LONGEST_LINK, length, 'm', 'such a robot')}"
    shortest, longest = min(links.values()), max(links, key=lambda name: links[name])
    most = LONGEST_OVER_SHORTEST * shortest
    if links[longest] > most:
        yield f"lengths_m.{longest}: {links[longest]:g}: {_at_most(most, links[longest], 'm')}"
    for key in ("length", "base"):
        value, most = getattr(file.tolerances, key), LARGEST_TOLERANCE * shortest
        if value > most:
            yield f"tolerances.{key}: {value:g}: {_at_most(most, value, 'm')}"
    x, y = file.home_m
    reach = max(links["l_11"] + links["l_12"], links["l_21"] + links["l_22"]) + 0.5 * file.lengths_m.a
    if math.hypot(x, y) > FARTHEST_HOME * reach:
        hint = in_other_unit("m", lambda size: size * math.hypot(x, y) <= reach)
        yield f"home_m: [{x:g}, {y:g}]: expected a place within the reach of {reach:.3g} m{hint}"


def _masses(file: RobotFile) -> Iterator[tuple[str, float]]:
    if file.mass_kg is not None:
        yield "mass_kg.m", file.mass_kg.m
    for section in ("proximal_links", "distal_links"):
        links = getattr(file, section)
        if links is not None:
            yield from ((f"{section}.{leg}.mass_kg", getattr(links, leg).mass_kg) for leg in ("leg_1", "leg_2"))
    if file.end_effector is not None:
        yield "end_effector.mass_kg", file.end_effector.mass_kg
    yield "forces.payload", file.forces.payload


def _of_masses(file: RobotFile) -> Iterator[str]:
    mean, torque = _mean_link(file), file.drives.torque_limit
    for key, mass in _masses(file):
        most = DENSITY * mean**3
        if mass > most:
            yield f"{key}: {mass:g}: {_at_most(most, mass, 'kg', f'links of {mean:.3g} m')}"
        # a proximal link turns about its own middle, behind a gear
        elif torque is not None and not key.startswith("proximal_links"):
            most = torque / (LEAST_ACCELERATION * mean)
            if mass > most:
                words = _at_most(most, mass, "kg", f"links of {mean:.3g} m and a drives.torque_limit of {torque:g} Nm")
                yield f"{key}: {mass:g}: {words}"


def _of_inertias(file: RobotFile) -> Iterator[str]:
    mean, grouped = _mean_link(file), file.grouped()
    if file.inertias_kg_m2 is not None:
        least, most = (grouped.mass * (bound * mean) ** 2 for bound in GYRATION)
        for key in ("zz_11R", "zz_21R"):
            inertia = getattr(file.inertias_kg_m2, key)
            if inertia > most:
                words = f"links of {mean:.3g} m and a mass_kg.m of {grouped.mass:g} kg"
                yield f"inertias_kg_m2.{key}: {inertia:g}: {_at_most(most, inertia, 'kg m^2', words)}"
            elif inertia < least:
                yield (
                    f"inertias_kg_m2.{key}: {inertia:g}: expected at least {least:.3g} kg m^2 for links of {mean:.3g} m"
                    f" and a mass_kg.m of {grouped.mass:g} kg: is lengths_m in cm, or mass_kg in g?"
                )
    for section in ("proximal_links", "distal_links"):
        links = getattr(file, section)
        for leg in ("leg_1", "leg_2") if links is not None else ():
            link = getattr(links, leg)
            most = FARTHEST_CENTRE * mean
            if abs(link.centre_m) > most:
                yield f"{section}.{leg}.centre_m: {link.centre_m:g}: {_at_most(most, abs(link.centre_m), 'm')}"
            most = link.mass_kg * (GYRATION[1] * mean) ** 2
            if link.inertia_kg_m2 > most:
                words = _at_most(most, link.inertia_kg_m2, "kg m^2")
                yield f"{section}.{leg}.inertia_kg_m2: {link.inertia_kg_m2:g}: {words}"


def _of_torques(file: RobotFile) -> Iterator[str]:
    swung, drives, limit = _swung(file), file.drives, file.drives.torque_limit
    torques = {
        **{f"friction.{key}": getattr(file.friction, key) for key in ("f_s11", "f_s21", "f_off11", "f_off21")},
        "loads.passive": file.loads.passive,
    }
    coulomb = max(file.friction.f_s11, file.friction.f_s21)
    most = PASSIVE_FRICTION * coulomb
    if coulomb > 0.0 and file.loads.passive > most:
        words = _at_most(most, file.loads.passive, "Nm", f"motors with a friction of {coulomb:g} Nm")
        yield f"loads.passive: {file.loads.passive:g}: {words}"
    for key, torque in torques.items():
        most = MOST_DECELERATION * swung
        if abs(torque) > most:
            yield f"{key}: {torque:g}: {_at_most(most, abs(torque), 'Nm')}"
        elif limit is not None and abs(torque) > limit:
            hint = in_other_unit("Nm", lambda size, torque=torque: abs(torque) * size < limit)  # type: ignore[misc]
            yield f"{key}: {torque:g}: expected less than the {limit:g} Nm of drives.torque_limit{hint}"
    for key, value in (("torque_limit", limit), ("crossing_torque", drives.crossing_torque)):
        beyond = None if value is None else too_strong(file, value)
        if beyond is not None:
            yield f"drives.{key}: {beyond}"


def _of_push(file: RobotFile) -> Iterator[str]:
    """Refuse a force that would move the free platform further than a link while it lasts: no law bears that."""
    push, lasts, mass, mean = file.loads.push, file.loads.push_length, file.grouped().mass, _mean_link(file)
    if 0.5 * push * lasts**2 > mass * mean:
        words = f"{mass:.3g} kg and links of {mean:.3g} m during {1e3 * lasts:g} ms"
        yield f"loads.push: {push:g}: {_at_most(2.0 * mass * mean / lasts**2, push, 'N', words)}"
