"""The keys of a scenario that a node of the control chain uses, and a scenario as the parameters that hold it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from operator import attrgetter
from typing import Any

from fivebar_control.laws.registry import find_controller
from fivebar_control.scenario.scenario import SECTIONS, ControlScenario
from fivebar_description.settings import Declared, keys_of, section_keys, with_keys
from fivebar_description.strict_yaml import validate

ROBOT = ("robot", "rate_hz", "working_mode")
"""Keys of the robot, which every node has."""

LEAD = ("estimator", "plant.delay_samples")
"""Keys that decide by how much answers are ahead of their samples."""

MOTION = (
    *ROBOT,
    *LEAD,
    "controller",
    "working_modes",
    "waypoints",
    "segment_duration",
    "time_law",
    "blend_radius",
    "zone",
)
"""Keys that decide the plan."""

LAWS = (
    "gains",
    "vhc_resolution",
    "adaptive_gain",
    "unified",
    "plant.torque_limit",
    "safety.torque_limit",
    "safety.torque_rate_limit",
    "ekf.feed_forward",
)
"""Keys that decide the laws, besides the section `law`."""

SENSORS = ("plant", "ekf", "imu", "sensors", "camera", "tolerances")
"""Keys of an estimator."""

STOPPING = (*MOTION, *LAWS, "safety", "tracking_error_limit")
"""Keys that decide what stops the robot, and for how long a torque is held before that."""

GOALS = (*STOPPING, *SENSORS, "loads", "risk", "error_tolerance", "judge")
"""Keys by which requests for motions are judged."""


def parameters_of(scenario: ControlScenario, names: Sequence[str]) -> dict[str, Any]:
    """Return the parameters that hold keys of a scenario, by their names or those of sections."""
    return {key.name: key.to_parameter(attrgetter(key.name)(scenario)) for key in keys_of(ControlScenario, names)}


def parameters_in(scenario: ControlScenario, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a scenario's keys that parameters hold, as its file has them; other parameters are left out.

    Raises:
        InputError: a parameter does not fit its key.
    """
    model = type(scenario)
    keys = {
        key.name: key for key in keys_of(model, [name for name in model.model_fields if name not in ("law", "format")])
    }
    for section, settings in scenario.section_law().items():
        keys |= {key.name: key for key in section_keys(type(settings), f"{section}.")}
    return {name: keys[name].to_file(value) for name, value in values.items() if name in keys}


def scenario_of(values: Mapping[str, Any]) -> ControlScenario:
    """Return the scenario of a node's parameters, which may be among others: those of the trajectory generator hold it.

    Raises:
        InputError: they are not such parameters.
    """
    keys: dict[str, Declared] = {key.name: key for key in keys_of(ControlScenario, GOALS)}
    law = find_controller(str(values.get("controller"))).nominal
    if law.name not in SECTIONS:
        keys |= {key.name: key for key in section_keys(law.settings, "law.")}
    given = {name: keys[name].to_file(value) for name, value in values.items() if name in keys}
    return validate(with_keys({"name": "parameters"}, given), ControlScenario, "parameters")
