# SPDX-License-Identifier: Apache-2.0
"""Robots of every size pass; a value in another unit is refused by its own key, with a hint at the unit."""

from __future__ import annotations

import copy
import math
from typing import Any

import pytest

from fivebar_description.robot_file import RobotFile, robot_path
from fivebar_description.strict_yaml import InputError, load_yaml, validate

LARGE: dict[str, Any] = {
    "name": "large",
    "lengths_m": {"a": 0.5, "l_11": 1.0, "l_12": 1.2, "l_21": 1.0, "l_22": 1.2},
    "inertias_kg_m2": {"zz_11R": 5.0, "zz_21R": 5.0},
    "mass_kg": {"m": 20.0},
    "friction": {"f_s11": 6.0, "f_s21": 6.0, "f_off11": 0.0, "f_off21": 0.0, "width_rad_s": 0.02},
    "home_m": [0.0, 1.5],
    "drives": {"torque_limit": 80.0, "joint_speed_limit": 5.0},
    "tolerances": {"length": 0.001, "base": 0.001, "zero": 0.005},
}
"""An arm of a metre."""

PRINTED: dict[str, Any] = {
    "name": "printed",
    "lengths_m": {"a": 0.05, "l_11": 0.05, "l_12": 0.06, "l_21": 0.05, "l_22": 0.06},
    "inertias_kg_m2": {"zz_11R": 2e-5, "zz_21R": 2e-5},
    "mass_kg": {"m": 0.01},
    "friction": {"f_s11": 0.02, "f_s21": 0.02, "f_off11": 0.0, "f_off21": 0.0, "width_rad_s": 0.02},
    "home_m": [0.0, 0.08],
    "drives": {"torque_limit": 0.3, "joint_speed_limit": 30.0},
    "tolerances": {"length": 0.001, "base": 0.001, "zero": 0.02},
    "loads": {"tilt": 0.035, "push": 0.1, "passive": 0.003},
}
"""A bench that fits on a hand."""

GEARED = {
    "name": "geared",
    "lengths_m": {"a": 0.24, "l_11": 0.17, "l_12": 0.21, "l_21": 0.17, "l_22": 0.205},
    "inertias_kg_m2": {"zz_11R": 0.00863, "zz_21R": 0.00863},
    "mass_kg": {"m": 0.55},
    "friction": {"f_s11": 0.27, "f_s21": 0.27, "f_off11": 0.0, "f_off21": 0.0, "width_rad_s": 0.021},
    "home_m": [0.007, 0.305],
    "drives": {"torque_limit": 9, "joint_speed_limit": 20},
    "tolerances": {"length": 0.0003, "base": 0.0003, "zero": 0.005236},
    "loads": {"tilt": 0.035, "push": 1.1, "passive": 0.003},
    "transmission": {"frequency": 80, "backlash": 0.002, "rotor_share": 0.47},
}

SHIPPED = {name: load_yaml(robot_path(name)) for name in ("dextar", "motkin", "motkin_vertical", "unequal")}

ROBOTS: dict[str, Any] = {"large": LARGE, "printed": PRINTED, "geared": GEARED, **SHIPPED}

DEGREES = 180.0 / math.pi

OTHER_UNITS = (
    # factor of the other unit, keys, and how the hint names it
    (1e3, ("lengths_m.a", "lengths_m.l_11", "lengths_m.l_22", "home_m", "tolerances.length", "tolerances.base"), "mm"),
    (1e2, ("lengths_m.l_11", "lengths_m.l_12", "home_m"), "cm"),
    (1e3, ("mass_kg.m", "proximal_links.leg_1.mass_kg", "distal_links.leg_2.mass_kg"), "g"),
    (1e3, ("friction.f_s11", "friction.f_s21", "drives.torque_limit", "loads.passive"), "mNm"),
    (1e3, ("loads.push",), "mN"),
    (1e4, ("inertias_kg_m2.zz_11R", "inertias_kg_m2.zz_21R"), "kg cm^2"),
    (1e9, ("inertias_kg_m2.zz_11R", "distal_links.leg_1.inertia_kg_m2"), "g mm^2"),
    (DEGREES, ("tolerances.zero", "loads.tilt", "transmission.backlash"), "degrees"),
)


def in_other_unit(content: Any, key: str, factor: float) -> Any:
    """The content with a value times a factor, None where it does not have that key."""
    changed = copy.deepcopy(content)
    *way, last = key.split(".")
    section = changed
    for name in way:
        section = section.get(name, {})
    if last not in section:
        return None
    value = section[last]
    section[last] = [factor * one for one in value] if isinstance(value, list) else factor * value
    return changed


@pytest.mark.parametrize("name", ROBOTS)
def test_robots_of_every_size_pass(name: str) -> None:
    assert validate(ROBOTS[name], RobotFile, name).name == name


def test_a_value_in_another_unit_is_refused_by_its_key_with_the_unit() -> None:
    unseen, checked = [], 0
    for factor, keys, unit in OTHER_UNITS:
        for key in keys:
            for name, content in ROBOTS.items():
                changed = in_other_unit(content, key, factor)
                if changed is None:
                    continue
                checked += 1
                try:
                    validate(changed, RobotFile, name)
                    unseen.append((name, key, unit, "passes"))
                except InputError as error:
                    text = str(error)
                    if not text.startswith(f"{name}: {key}") or unit not in text.partition("is it in ")[2]:
                        unseen.append((name, key, unit, text))
    assert checked > 60
    assert unseen == []


@pytest.mark.parametrize("factor", [1e3, 1e2, 1.0 / 0.0254])
@pytest.mark.parametrize("name", ROBOTS)
def test_a_file_whose_lengths_are_in_another_unit_is_refused(name: str, factor: float) -> None:
    content = copy.deepcopy(ROBOTS[name])
    content["lengths_m"] = {key: factor * length for key, length in content["lengths_m"].items()}
    with pytest.raises(InputError, match=r"lengths_m.*\b(mm|cm)\b"):
        validate(content, RobotFile, name)


@pytest.mark.parametrize("mass", [100.0, 250.0, 490.0, 537.0])
def test_a_small_robot_has_no_mass_of_a_hundred_kilograms(mass: float) -> None:
    with pytest.raises(InputError, match=rf"mass_kg\.m: {mass:g}: expected at most 36\.[45] kg .*: is it in g\?$"):
        validate({**SHIPPED["dextar"], "mass_kg": {"m": mass}}, RobotFile, "dextar")
