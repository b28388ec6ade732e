# SPDX-License-Identifier: Apache-2.0
"""Rig files: read, and checked as a whole before anything is drawn from them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, PrivateAttr

from fivebar_bringup.odds.robot_errors import NO_ERRORS, NORMAL, SECTIONS, RobotErrors, drawn_effects
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.changes import changes_for, with_changes
from fivebar_control.laws.registry import CONTROLLERS, find_controller
from fivebar_control.scenario.sensors import check_sensors
from fivebar_control.trajectory.path_distance import PATH
from fivebar_description.errors import InputError
from fivebar_description.files import placed_beside, read_text
from fivebar_description.scenario_file import FILES_NAMED
from fivebar_description.settings import Section, Setting
from fivebar_description.shared_settings import Robot
from fivebar_description.strict_yaml import NEWEST, Format, StrictModel, parse_versioned, validate
from fivebar_description.suggestion import expected_one_of
from fivebar_sim.effects.mechanism import mechanism_of

OF_A_RIG = (
    "estimator",
    "ekf",
    "imu",
    "sensors",
    "camera",
    "extra_sensor",
    "gains",
    "unified",
    "adaptive_gain",
    "vhc_resolution",
    "zone",
    "plant",
    "tolerances",
    "loads",
    "risk",
    "safety",
    "tracking_error_limit",
    "error_tolerance",
    "judge",
)
"""Keys and sections of a scenario that belong to a rig; the others are those of the motion."""

OF_THE_SCENARIO = ("engine", "torque_limit")
"""Keys of the section `plant` that no rig has: what simulates a robot, and its drives, which its own file has."""

BLENDED = "multi_cartesian"
"""A blended controller, to check what a rig has for these."""

OF_ROBOT = "robot:"
"""How the name of a rig begins that a robot's file declares; the name or the path of that file follows."""

CHANGES: dict[str, dict[str, dict[str, Any]]] = {
    "normal": {"errors": {"distribution": NORMAL}},
    "by_path": {"scenario": {"judge": PATH}},
}
"""Changes of any rig: by these names after a colon, as in `middling:normal`."""

REQUIRED = 0.999
"""Share of the feasible crossings that a sweep's counted controller has to complete, unless a rig says otherwise."""

SET = " --set "
"""Between the name of a rig and a changed key of its scenarios, `middling --set unified.kp=900`, again and again."""

Keys = Mapping[str, Any]


class Rig(StrictModel):
    """A distribution of robots, with sensors, estimator and settings of the controllers."""

    format: Format = NEWEST
    words: Annotated[str, Setting("What its robots have, in words.")]
    leaves_out: Annotated[str, Setting("What its robots do not have, though real ones do.")] = "nothing"
    robot: Robot = "dextar"
    required: Annotated[
        float,
        Setting(
            "Share of the feasible crossings that the counted controller of a sweep has to complete.",
            at_least=0.0,
            at_most=1.0,
        ),
    ] = REQUIRED
    errors: Section[RobotErrors] = NO_ERRORS
    scenario: Annotated[
        dict[str, Any], Setting("Keys and sections of a scenario, in place of its own, key by key.")
    ] = Field(default_factory=dict)
    blended: Annotated[dict[str, Any], Setting("The same besides, for the blended controllers.")] = Field(
        default_factory=dict
    )
    laws: Annotated[dict[str, dict[str, Any]], Setting("Section `law`, by controller.")] = Field(default_factory=dict)
    laws_without_errors: Annotated[
        dict[str, dict[str, Any]], Setting("The same besides, where no errors are drawn.")
    ] = Field(default_factory=dict)
    _changes: tuple[str, ...] = PrivateAttr(default=())

    @property
    def plant(self) -> Keys:
        """Keys of the section `plant` that all of its robots have, in place of drawn ones."""
        keys: Keys = self.scenario.get("plant", {})
        return keys

    @property
    def estimated(self) -> bool:
        """Whether the controllers have only the motors' encoders, with an estimator; else all joints exactly."""
        return bool(self.scenario.get("estimator", "none") != "none")

    @property
    def described(self) -> str:
        """A description for a person: what the rig contains and what it leaves out."""
        parts = [self.words]
        errors = {name: bound for name, bound in self.errors._asdict().items() if bound != getattr(NO_ERRORS, name)}
        if errors:
            parts.append(f"drawn: {', '.join(_shown(errors))}")
        if self.plant:
            parts.append(f"all robots: {', '.join(_shown(self.plant))}")
        return f"{'; '.join(parts)}. Left out: {self.leaves_out}."

    def settings_for(self, controller: str) -> dict[str, Any]:
        """Return the keys and sections for a controller, without the plant."""
        settings = merged(self.scenario, self.blended if find_controller(controller).blended else {})
        return {name: keys for name, keys in settings.items() if name != "plant"}

    def content(self, scenario: Scenario, controller: str, drawn: Keys | None = None) -> dict[str, Any]:
        """Return the content of a scenario with its robot put on the rig, and a controller.

        Args:
            scenario: engine, torque limit and seed of its plant stay.
            controller: by name.
            drawn: keys of the section `plant` that were drawn for its robot; None for the robot without such errors.
        """
        content = scenario.model_dump() | {"controller": controller, "estimator": "none"}
        kept = {key: content["plant"][key] for key in (*OF_THE_SCENARIO, "seed")}
        # effects and drives are those of the rig, not those that follow from the robot's file
        content["plant"] = {**kept, "torque_quantum": 0.0, **{name: {} for name in SECTIONS}, **(drawn or {})}
        if controller != scenario.controller:
            # settings of one law are none of another
            content["law"] = {}
        law = self.laws.get(controller, {})
        if drawn is None:
            law = {**law, **self.laws_without_errors.get(controller, {})}
        content = merged(content, {"plant": self.plant, **self.settings_for(controller), "law": law})
        return with_changes(content, changes_for(self._changes, controller)) if self._changes else content

    def with_changes(self, changes: tuple[str, ...]) -> Rig:
        """Return the same with KEY=VALUE of further keys of a scenario, in place of its own."""
        copy = self.model_copy()
        copy._changes = changes
        return copy


def _shown(keys: Keys, within: str = "") -> Iterator[str]:
    for name, value in keys.items():
        if isinstance(value, Mapping):
            yield from _shown(value, f"{within}{name}.")
        else:
            yield f"{within}{name} {_value_text(value)}"


def _value_text(value: Any) -> str:
    if isinstance(value, tuple | list):
        return " to ".join(_value_text(bound) for bound in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def merged(content: Keys, keys: Keys) -> dict[str, Any]:
    """Return content in which keys replace those of the same name, sections key by key."""
    result = dict(content)
    for name, value in keys.items():
        both = isinstance(value, Mapping) and isinstance(result.get(name), Mapping)
        result[name] = merged(result[name], value) if both else value
    return result


def changed(rig: Rig, change: str, name: str) -> Rig:
    """Return a rig with one of `CHANGES`, by its name."""
    content = rig.model_dump() | {"errors": rig.errors._asdict()}
    return validate(merged(content, CHANGES[change]), Rig, name)


def read_rig(path: Path) -> Rig:
    """Read a rig file, and check that a scenario can be put on it.

    Raises:
        InputError: the file is missing, not YAML, or does not describe a rig.
    """
    content: Any = placed_beside(path.parent, parse_versioned(read_text(path), str(path)), ("robot",))
    if isinstance(content, Mapping) and content.get("scenario") is not None:
        content = {**content, "scenario": placed_beside(path.parent, content["scenario"], *FILES_NAMED)}
    rig = validate(content, Rig, str(path))
    for name in ("scenario", "blended"):
        _check_keys(getattr(rig, name), OF_A_RIG, f"{path}: {name}")
    for name in ("laws", "laws_without_errors"):
        _check_keys(getattr(rig, name), tuple(CONTROLLERS), f"{path}: {name}")
    for key in OF_THE_SCENARIO:
        if isinstance(rig.plant, Mapping) and key in rig.plant:
            raise InputError(
                f"{path}: scenario: plant.{key}: {rig.plant[key]!r}: expected none in a rig: it is that of the"
                " scenario, and by default of the robot's file"
            )
    check_rig(rig, str(path))
    return rig


def check_rig(rig: Rig, path: str) -> None:
    """Check that a scenario can be put on a rig.

    Raises:
        InputError: a section does not fit; begins with `path`.
    """
    nothing: Keys = {}
    _check(rig, "unified", None, f"{path}: scenario")
    _check(rig, BLENDED, None, f"{path}: blended")
    for name in rig.laws:
        _check(rig, name, nothing, f"{path}: laws.{name}")
    for name in rig.laws_without_errors:
        _check(rig, name, None, f"{path}: laws_without_errors.{name}")
    _check(rig, "unified", drawn_effects(rig.errors, 0, 0, 1.0), f"{path}: errors")


def _check_keys(content: Keys, known: Collection[str], source: str) -> None:
    for name in content:
        if name not in known:
            raise InputError(f"{source}: {name}: unknown key: {expected_one_of(name, known)}")


def _check(rig: Rig, controller: str, drawn: Keys | None, source: str) -> None:
    """Check a rig by a scenario that is put on it.

    Raises:
        InputError: it does not fit.
    """
    common = {"name": "rig", "robot": rig.robot, "waypoints": ((0.0, 0.15), (0.0, 0.05))}
    scenario = validate(rig.content(validate(common, Scenario, source), controller, drawn), Scenario, source)
    try:
        check_sensors(scenario)
        mechanism_of(scenario.five_bar(), scenario.plant, scenario.rate_hz)
    except InputError as error:
        raise InputError(f"{source}: {error}") from error
