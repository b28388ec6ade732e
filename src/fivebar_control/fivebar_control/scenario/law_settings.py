# SPDX-License-Identifier: Apache-2.0
"""The settings of a scenario's laws: by which of its keys and sections each is set, and what they say."""

from __future__ import annotations

from typing import Any, Protocol

from fivebar_control.estimation.settings import Drives
from fivebar_control.laws.adaptive_gain import AdaptiveGain
from fivebar_control.laws.gains import Gains, UnifiedSettings
from fivebar_control.laws.law import Law, TunedLaw
from fivebar_control.laws.registry import Controller, TunedController
from fivebar_control.laws.robot_sizes import sizes_of_law
from fivebar_control.safety.settings import SafetySettings
from fivebar_description.errors import InputError
from fivebar_description.robot_file import read_robot
from fivebar_description.settings import read_settings

SECTIONS = {
    "ctc": ("gains.kp", "gains.kd"),
    "reduced_ctc": ("gains.kp_vhc", "gains.kd_vhc"),
    "vhc_cartesian": ("gains.kp_vhc", "gains.kd_vhc", "vhc_resolution"),
    "vhc_joint": ("gains.kp_vhc", "gains.kd_vhc", "vhc_resolution", "adaptive_gain"),
    "unified": ("unified",),
}
"""Laws whose settings come from keys and sections of their own; the others take the section `law`."""


class LawSections(Protocol):
    """The sections of a scenario that set its laws."""

    robot: str
    controller: str
    vhc_resolution: str
    gains: Gains
    unified: UnifiedSettings
    adaptive_gain: AdaptiveGain
    law: dict[str, Any]
    safety: SafetySettings

    @property
    def law_unopened(self) -> bool:
        """Whether the module of the law was not imported."""

    def scheme(self) -> Controller:
        """Return how the controller is put together."""

    def drives(self) -> Drives:
        """Return what is known of the drives."""


def keys_of_laws(controller: Controller) -> list[str]:
    """Return the keys and sections of a scenario by which the laws of a controller are set."""
    keys = [key for law in controller.laws for key in SECTIONS.get(law.name, ("law",))]
    keys += ["unified" for law in controller.laws if law.like_unified]
    return list(dict.fromkeys(keys))


def keys_as_written(controller: Controller) -> str:
    """Return those keys as a message names them; a colon follows a section."""
    return ", ".join(f"`{key}`" if "." in key else f"`{key}:`" for key in keys_of_laws(controller))


def check_law_section(scenario: LawSections) -> None:
    """Check the section `law` of a scenario.

    Raises:
        ValueError: no law takes the section, or it does not fit the law.
    """
    scheme = scenario.scheme()
    if scenario.law and all(law.name in SECTIONS for law in scheme.laws):
        raise ValueError(f"`law:` does not apply to `{scenario.controller}`; use {keys_as_written(scheme)}")
    tuned_controller(scenario)


def tuned_controller(scenario: LawSections) -> TunedController:
    """Return a scenario's controller with the settings of its laws.

    What limits of the torque and its rate these leave open is by default that of the drives and of the last node.

    Raises:
        InputError: the section `law` does not fit the law, or the law's module was not imported.
    """
    scheme = scenario.scheme()
    if scenario.law_unopened:
        raise InputError(
            f"controller: {scenario.controller!r}: where a scenario or a run is only read, the module of a law is not"
            " imported, so its settings, its topics and its torque are not known here: expected a scenario that"
            " was loaded to be run"
        )
    return TunedController(scheme, *(_tuned(scenario, law) for law in scheme.laws))


def _tuned(scenario: LawSections, law: Law) -> TunedLaw:
    settings: Any
    kind: Any = law.settings
    gains = scenario.gains
    at_locus = gains.kp_vhc, gains.kd_vhc
    if law.name == "ctc":
        settings = kind(gains.kp, gains.kd)
    elif law.name == "reduced_ctc":
        settings = kind(*at_locus)
    elif law.name == "vhc_cartesian":
        settings = kind(*at_locus, scenario.vhc_resolution)
    elif law.name == "vhc_joint":
        settings = kind(*at_locus, scenario.vhc_resolution, *scenario.adaptive_gain)
    elif law.name == "unified":
        settings = scenario.unified
    else:
        sized = sizes_of_law(law.name, read_robot(scenario.robot))
        if law.like_unified:
            unified = scenario.unified._asdict()
            sized |= {name: unified[name] for name in law.settings._fields if name in unified}  # type: ignore[attr-defined]
        settings = read_settings({**sized, **scenario.law}, law.settings, "law")
    return TunedLaw(law, settings).within(scenario.drives().torque_limit, scenario.safety.torque_rate_limit)


def section_law(scenario: LawSections) -> dict[str, tuple[Any, ...]]:
    """Return the settings of the law that takes the section `law`, under that name; none where no law does.

    Raises:
        InputError: as `tuned_controller`.
    """
    settings = [tuned.settings for tuned in tuned_controller(scenario).laws if tuned.law.name not in SECTIONS]
    return {"law": settings[0]} if settings else {}
