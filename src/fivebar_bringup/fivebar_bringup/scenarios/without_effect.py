# SPDX-License-Identifier: Apache-2.0
"""Refuses keys of a scenario that have no effect in it, and names those that do what they seem to ask for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from operator import attrgetter
from typing import Any

from fivebar_bringup.scenario import Scenario
from fivebar_control.laws.registry import Controller
from fivebar_control.scenario.law_settings import SECTIONS, keys_as_written, keys_of_laws
from fivebar_control.trajectory.zones import BALLISTIC, FIXED
from fivebar_description.errors import InputError

SWITCHED: dict[str, tuple[str, ...] | dict[str, tuple[str, ...]]] = {
    "camera": ("on",),
    "ekf": {"force_time": ("force_deviation",), "gyro_": ("gyro",), "camera_": ("camera", "seen_start")},
    "plant.links": {"distal_centre": ("distal_mass",)},
    "plant.friction": {"stribeck_speed": ("stribeck",), "presliding_damping": ("presliding",)},
    "plant.heating": ("change",),
    "plant.motors": {"ripple_periods": ("ripple",), "cogging_periods": ("cogging",)},
    "plant.supply": ("half_power",),
    "plant.transmission": {"damping": ("frequency",), "rotor_share": ("frequency",)},
    "plant.platform_joint": {"damping": ("stiffness",)},
    "plant.encoders": {
        "lines": ("interpolation",),
        "slip_time": ("slip_1", "slip_2"),
        "frozen_": ("frozen_motor",),
    },
    "plant.gyroscope": {
        "bias_time": ("bias_jump",),
        "frozen_from": ("frozen_length",),
        "missing_from": ("missing_length",),
    },
    "plant.tilt": ("angle",),
    "plant.vibration": ("amplitude",),
    "plant.push": ("force",),
    "plant.cable": {"heading": ("force",), "length": ("stiffness",), "anchor_": ("stiffness",)},
    "plant.bus": {"lost_from": ("lost_commands",), "lost_within": ("lost_commands",)},
    "safety": {"brake_": ("brake",), "request_samples": ("request_ratio",)},
    "sensors.passive_encoder": ("leg",),
}
"""Keys of each section that switch its other keys on, or those that begin with a word: where none of these is on, they
have no effect."""


def refuse_without_effect(content: Mapping[str, Any], scenario: Scenario, any_law: bool = False) -> None:
    """Refuse what a scenario's file says without any effect.

    Args:
        content: what the file says.
        scenario: what it is read as.
        any_law: whether other laws than that of its controller are to be run as well.

    Raises:
        InputError: one of the keys has no effect.
    """
    for key, _ in dotted(content):
        problem = _problem(key, scenario, any_law)
        if problem is not None:
            raise InputError(f"{key}: {problem}")


def is_written_out(content: Mapping[str, Any]) -> bool:
    """Return whether a file has all keys, as that of a run, which writes every default out."""
    return content.keys() >= Scenario.model_fields.keys() - {"format"}


def dotted(content: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield keys and values of a file's content, keys by their names with dots; an empty section says nothing."""
    for name, value in content.items():
        if isinstance(value, Mapping):
            yield from dotted(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def _problem(key: str, scenario: Scenario, any_law: bool) -> str | None:
    return (
        (None if any_law else _of_another_law(key, scenario))
        or _of_another_choice(key, scenario)
        or _off(key, scenario)
    )


def is_of_another_law(key: str, controller: Controller) -> bool:
    """Return whether a key of a scenario sets a law, but none of a controller's."""
    of_laws = ("law", *(of_law for keys in SECTIONS.values() for of_law in keys))
    return any(_belongs(key, law) for law in of_laws) and not any(
        _belongs(key, of_law) for of_law in keys_of_laws(controller)
    )


def _of_another_law(key: str, scenario: Scenario) -> str | None:
    if scenario.law_unopened:
        return None
    controller = scenario.scheme()
    if not is_of_another_law(key, controller):
        return None
    return f"does not apply to `{controller.name}`; use {keys_as_written(controller)}"


def _belongs(key: str, section: str) -> bool:
    return key == section or key.startswith(f"{section}.")


def _of_another_choice(key: str, scenario: Scenario) -> str | None:
    """Return what is wrong with a key that a choice elsewhere in the file leaves without effect."""
    if _belongs(key, "ekf") and not scenario.estimated:
        return "has no effect without an estimator; use it with `estimator: ekf`"
    if key == "zone.supervision" and not scenario.scheme().blended:
        return (
            f"does not apply to `{scenario.controller}`, which has one law everywhere and blends nothing; leave it out"
        )
    if key == "zone.epsilon" and scenario.zone.rule != FIXED:
        return f"has no effect with `zone.rule: {scenario.zone.rule}`; use it with `zone.rule: {FIXED}`"
    if key == "zone.duration_ms" and scenario.zone.rule != BALLISTIC:
        return f"has no effect with `zone.rule: {scenario.zone.rule}`; use `zone.epsilon`"
    if key == "safety.stop_time_ms" and scenario.safety.stop_cycles is not None:
        return "has no effect beside `safety.stop_cycles`; use one of them"
    if key == "blend_radius" and scenario.rounded and len(scenario.waypoints) < 3:
        return "has no effect without a waypoint between the first and the last; add one to `waypoints`"
    return None


def _off(key: str, scenario: Scenario) -> str | None:
    """Return what is wrong with a key of an effect or a sensor that is off."""
    section, _, name = key.rpartition(".")
    switched = SWITCHED.get(section)
    if switched is None:
        return None
    if isinstance(switched, tuple):
        switches = switched
    else:
        switches = next((by for start, by in switched.items() if name.startswith(start)), ())
    settings = attrgetter(section)(scenario)
    neutral = type(settings)()
    if (
        not switches
        or name in switches
        or any(_is_on(getattr(settings, switch), section, switch) for switch in switches)
    ):
        return None
    value = getattr(settings, name)
    if value == getattr(neutral, name):
        return None
    also = " or ".join(f"`{section}.{switch}`" for switch in switches)
    return f"has no effect while {also} is off; set that too"


def _is_on(value: Any, section: str, name: str) -> bool:
    # the break-away friction is a factor
    return value not in (None, 1.0 if (section, name) == ("plant.friction", "stribeck") else 0, False)
