# SPDX-License-Identifier: Apache-2.0
"""The five-bar robot in Python: load a robot, plan a motion, simulate it, look at it.

    >>> import fivebar
    >>> robot = fivebar.load_robot("dextar")
    >>> motion = fivebar.plan(robot, goal=(0.0, 0.02), assembly_mode="-")
    >>> run = fivebar.simulate(motion)
    >>> run.outcome.value, run.summary.assembly_mode_changes
    ('succeeded', 1)

`run.plot().show()` then draws the run. No ROS is loaded. What `__all__` names is the public interface; the packages
below it, `fivebar_description`, `fivebar_control`, `fivebar_sim` and `fivebar_bringup`, change more freely.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fivebar.loop import Controller, Plant
    from fivebar.motion import Motion, controllers, load_scenario, plan, scenarios
    from fivebar.picture import Drawing
    from fivebar.robot import Posture, Robot, load_robot
    from fivebar.run import Run, load_run, simulate
    from fivebar_bringup.errors import BagError
    from fivebar_bringup.recorded.outcome import RunOutcome
    from fivebar_bringup.recorded.series import RunSeries
    from fivebar_bringup.recorded.summary import Summary
    from fivebar_bringup.scenario import Scenario
    from fivebar_control.controller.motion_controller import ControlOutput, StateEstimate, StillFaulty
    from fivebar_control.trajectory.planner import PlanRefused
    from fivebar_description.errors import InputError
    from fivebar_description.readings import SensorReadings, TimedAngle, TimedPosition, TimedTurn
    from fivebar_sim.plant import PlantDiverged
    from fivebar_studies.python import sweep

__all__ = [
    "BagError",
    "ControlOutput",
    "Controller",
    "Drawing",
    "InputError",
    "Motion",
    "PlanRefused",
    "Plant",
    "PlantDiverged",
    "Posture",
    "Robot",
    "Run",
    "RunOutcome",
    "RunSeries",
    "Scenario",
    "SensorReadings",
    "StateEstimate",
    "StillFaulty",
    "Summary",
    "TimedAngle",
    "TimedPosition",
    "TimedTurn",
    "controllers",
    "load_robot",
    "load_run",
    "load_scenario",
    "plan",
    "scenarios",
    "simulate",
    "sweep",
]

_PLACES = {
    "fivebar.loop": ("Controller", "Plant"),
    "fivebar.motion": ("Motion", "controllers", "load_scenario", "plan", "scenarios"),
    "fivebar.picture": ("Drawing",),
    "fivebar.robot": ("Posture", "Robot", "load_robot"),
    "fivebar.run": ("Run", "load_run", "simulate"),
    "fivebar_bringup.errors": ("BagError",),
    "fivebar_bringup.recorded.series": ("RunSeries",),
    "fivebar_bringup.recorded.summary": ("Summary",),
    "fivebar_bringup.recorded.outcome": ("RunOutcome",),
    "fivebar_bringup.scenario": ("Scenario",),
    "fivebar_control.controller.motion_controller": ("ControlOutput", "StateEstimate", "StillFaulty"),
    "fivebar_control.trajectory.planner": ("PlanRefused",),
    "fivebar_description.errors": ("InputError",),
    "fivebar_description.readings": ("SensorReadings", "TimedAngle", "TimedPosition", "TimedTurn"),
    "fivebar_sim.plant": ("PlantDiverged",),
}
"""The modules of the public names, which are loaded when a name is first asked for."""

_OPTIONAL = {"sweep": "fivebar_studies"}
"""Public names of optional packages, which register them."""


def __getattr__(name: str) -> Any:
    """Return a public name, and load its module."""
    for module, names in _PLACES.items():
        if name in names:
            globals()[name] = value = getattr(import_module(module), name)
            return value
    if name in _OPTIONAL:
        from fivebar_description.optional import PYTHON, OptionalPart, optional_part

        globals()[name] = value = optional_part(OptionalPart(PYTHON, name, _OPTIONAL[name]), f"fivebar.{name}")
        return value
    from fivebar_description.suggestion import did_you_mean

    raise AttributeError(f"module {__name__!r} has no attribute {name!r}{did_you_mean(name, __all__)}")


def __dir__() -> list[str]:
    """Return all names, also those that are not loaded yet."""
    return sorted({*globals(), *__all__})
