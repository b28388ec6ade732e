"""The five-bar robot in Python: load a robot, plan a motion, simulate it, look at it.

    >>> import fivebar
    >>> robot = fivebar.load_robot("dextar")
    >>> motion = fivebar.plan(robot, goal=(0.0, 0.02), assembly_mode="-")
    >>> run = fivebar.simulate(motion)
    >>> run.summary.completed, run.summary.assembly_mode_changes
    (True, 1)

`run.plot()` then draws the run. No ROS is loaded. What `__all__` names is the public interface; the packages below it,
`fivebar_description`, `fivebar_control`, `fivebar_sim` and `fivebar_bringup`, change more freely.
"""

from fivebar.motion import Motion, controllers, load_scenario, plan, scenarios
from fivebar.picture import Drawing
from fivebar.robot import Posture, Robot, load_robot
from fivebar.run import Run, load_run, simulate
from fivebar_bringup.report.series import RunSeries
from fivebar_bringup.report.summary import Summary
from fivebar_bringup.runs.bag.recording import BagError
from fivebar_bringup.scenario import Scenario
from fivebar_control.trajectory.planner import PlanRefused
from fivebar_description.strict_yaml import InputError

__all__ = [
    "BagError",
    "Drawing",
    "InputError",
    "Motion",
    "PlanRefused",
    "Posture",
    "Robot",
    "Run",
    "RunSeries",
    "Scenario",
    "Summary",
    "controllers",
    "load_robot",
    "load_run",
    "load_scenario",
    "plan",
    "scenarios",
    "simulate",
]
