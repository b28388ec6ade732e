# SPDX-License-Identifier: Apache-2.0
"""The equipment that is compared: a controller with sensors and settings, on an exact robot that makes one motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

from fivebar_bringup.report.thesis import MIDDLE
from fivebar_bringup.scenario import Scenario
from fivebar_control.laws.robot_sizes import ROBUST_WEIGHT, size_ratio, torque_ratio
from fivebar_control.loop.sampled_plan import Sampled, sampled
from fivebar_description.robot_file import load_robot, read_robot
from fivebar_description.strict_yaml import validate
from fivebar_studies.rigs.named import find_rig
from fivebar_studies.rigs.rig import merged
from fivebar_studies.sweep.drawing import RATE_HZ, ROBOT, torque_limit_of, with_own_law

ENCODERS = "encoders"
"""Rig of the equipment that has no gyroscope."""


class Equipment(NamedTuple):
    """A controller with sensors and settings.

    Attributes:
        name: as in the results.
        controller: its name.
        words: sensors and settings.
        rig: whose sensors, estimator and gains it has, without its robot and its tracking limit.
    """

    name: str
    controller: str
    words: str
    rig: str = ENCODERS

    @property
    def gyro(self) -> bool:
        """Whether it has a gyroscope and declared tolerances."""
        return self.rig != ENCODERS

    @property
    def sections(self) -> dict[str, Any]:
        """Sections of the scenario, that replace others key by key."""
        settings = find_rig(self.rig).settings_for(self.controller)
        return {name: keys for name, keys in settings.items() if isinstance(keys, Mapping)}


ENCODERS_ALONE = "motor encoders alone, no declared tolerances"
WITH_GYRO = "with gyroscope and declared tolerances, settings of the rig good"
FOR_ELASTIC = "with gyroscope and declared tolerances, gains and estimator as on the rig middling"

ELASTIC = "unified, gyro, elastic"


def equipment_named(name: str) -> Equipment:
    """Return an equipment by its name, `CONTROLLER, encoders` or `CONTROLLER, gyro` of any controller, or `ELASTIC`.

    `good` stands for its settings of estimator and gains; the robots are those of this study.
    """
    controller, _, sensors = name.partition(", ")
    if name == ELASTIC:
        return Equipment(name, controller, FOR_ELASTIC, "middling")
    if sensors == "gyro":
        return Equipment(name, controller, WITH_GYRO, "good")
    return Equipment(name, controller, ENCODERS_ALONE)


def equipment_of(controllers: Sequence[str]) -> list[Equipment]:
    """Return the equipment of controllers."""
    names = []
    for controller in controllers:
        names += [f"{controller}, encoders", f"{controller}, gyro"]
        names += [ELASTIC] if controller == "unified" else []
    return [equipment_named(name) for name in names]


def scaled_sections(sections: Mapping[str, Any], robot: str) -> dict[str, Any]:
    """Return sections of a rig of DexTAR's, with torques and forces in proportion to those of another robot."""
    torque = torque_ratio(read_robot(robot))
    force = torque / size_ratio(load_robot(robot))
    scales = {
        "ekf": {"disturbance_rate": torque, "disturbance_initial": torque, "force_deviation": force},
        "loads": {"push": force, "passive": torque},
    }
    return merged(
        sections,
        {
            name: {key: sections[name][key] * scale for key, scale in keys.items() if key in sections[name]}
            for name, keys in scales.items()
            if name in sections
        },
    )


@cache
def prepared(name: str, duration: float, robot: str = ROBOT) -> tuple[Scenario, Sampled]:
    """Return the scenario of an equipment on an exact robot, and its sampled plan.

    The motion of another robot than DexTAR is that of DexTAR in proportion to its size.

    Raises:
        InputError: the planner refuses it.
    """
    equipment, size = equipment_named(name), size_ratio(load_robot(robot))
    waypoints = [(size * x, size * y) for x, y in MIDDLE[:2]]
    common = {
        "name": "robustness",
        "robot": robot,
        "rate_hz": RATE_HZ,
        "waypoints": waypoints,
        "segment_duration": duration,
        "plant": {"torque_limit": torque_limit_of(robot)},
        "unified": {"weight": ROBUST_WEIGHT},
    }
    content = find_rig(ENCODERS).content(validate(common, Scenario, "robustness"), equipment.controller)
    if robot == ROBOT:
        content = merged(content, equipment.sections)
    else:
        content = with_own_law(merged(content, scaled_sections(equipment.sections, robot)), robot)
    scenario = validate(content, Scenario, "robustness")
    return scenario, sampled(scenario.five_bar(), scenario.plan(), RATE_HZ, scenario.lead_samples)
