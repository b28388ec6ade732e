# SPDX-License-Identifier: Apache-2.0
"""Random scenarios for a robot as modelled, drawn each from its number, and how a run of one falls short."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import FloatArray, case_of
from fivebar_bringup.simulation.engine import crossing
from fivebar_bringup.simulation.run_metrics import RunMetrics
from fivebar_control.laws.registry import CONTROLLERS
from fivebar_control.loop.closed_loop import FAULT_NAMES
from fivebar_control.loop.sampled_plan import sampled
from fivebar_control.model.geometry import workspace_bounds, workspace_margin
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.model.state import WorkingMode
from fivebar_control.planning.postures import WORKING_MODES
from fivebar_control.safety.stages import NO_FAULT
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import load_robot

Point = tuple[float, float]

NAMES = tuple(name for name, controller in CONTROLLERS.items() if controller.compiles)

TORQUE_LIMIT = 2.0
"""Nm, of the drives."""

SHORTEST, LONGEST = 0.4, 4.0
"""Durations (s) of a segment, uniform on a logarithmic scale."""

NEAR = 3e-3
"""Largest distance (m) from the locus at which a motion of `near_the_locus` ends, turns or passes."""

LARGEST_ERROR = 2e-3
"""A success stays within this distance (m) of its reference throughout."""

_STEPS = 60


def anywhere(seed: int, number: int) -> Scenario:
    """Return a scenario with two or three waypoints, uniform over where both legs reach."""
    robot, random = load_robot("dextar"), np.random.default_rng((seed, number))
    mode = WORKING_MODES[random.integers(len(WORKING_MODES))]
    points = [_reachable(robot, random) for _ in range(random.integers(2, 4))]
    return _scenario(number, mode, points, random)


def near_the_locus(seed: int, number: int) -> Scenario:
    """Return a scenario that ends, turns or passes within 3 mm of the Type 2 locus."""
    robot, random = load_robot("dextar"), np.random.default_rng((seed, number))
    mode = WORKING_MODES[random.integers(len(WORKING_MODES))]
    near = _near(robot, mode, random)
    start, end = _reachable(robot, random), _reachable(robot, random)
    direction, length = random.uniform(0.0, math.pi), random.uniform(0.01, 0.06)
    along = length * math.cos(direction), length * math.sin(direction)
    points = (
        [start, near],
        [start, near, end],
        [(near[0] - along[0], near[1] - along[1]), (near[0] + along[0], near[1] + along[1])],
    )[random.integers(3)]
    return _scenario(number, mode, points, random)


def run_of(scenario: Scenario, plan: Plan) -> tuple[RunMetrics, list[str]]:
    """Return the outcome of a scenario on the engine's plant, and how it fails: nothing where it does not."""
    outcome = crossing(case_of(scenario), sampled(scenario.five_bar(), plan, scenario.rate_hz))
    failures = []
    if outcome.fault != NO_FAULT:
        failures.append(FAULT_NAMES[outcome.fault])
    if outcome.mode_changes != len(plan.crossings):
        failures.append("assembly mode")
    if not outcome.error_peak < LARGEST_ERROR:
        failures.append("error")
    if outcome.saturated:
        failures.append("saturated")
    return outcome, failures


def _scenario(number: int, mode: Point, points: list[Point], random: np.random.Generator) -> Scenario:
    durations = np.exp(random.uniform(math.log(SHORTEST), math.log(LONGEST), len(points) - 1))
    content = {
        "name": f"random-{number}",
        "controller": NAMES[number % len(NAMES)],
        "working_mode": mode,
        "waypoints": points,
        "segment_duration": durations.tolist(),
        "plant": {"torque_limit": TORQUE_LIMIT},
    }
    return Scenario.model_validate(content)


def _reachable(robot: FiveBar, random: np.random.Generator) -> Point:
    left, right, bottom, top = workspace_bounds(robot)
    while True:
        x, y = random.uniform((left, bottom), (right, top)).tolist()
        if workspace_margin(robot, x, y) > 1e-3:
            return x, y


def _near(robot: FiveBar, mode: WorkingMode, random: np.random.Generator) -> Point:
    """Return a place near a point of the locus that lies between two random places."""
    while True:
        start, end = np.array(_reachable(robot, random)), np.array(_reachable(robot, random))

        def assembly(share: float, start: FloatArray = start, end: FloatArray = end) -> float:
            x, y = (start + share * (end - start)).tolist()
            return det_a(state_from_platform(robot, mode, x, y, 0.0, 0.0))

        shares = np.linspace(0.0, 1.0, _STEPS).tolist()
        values = [assembly(share) for share in shares]
        found = [step for step in range(_STEPS - 1) if values[step] * values[step + 1] < 0.0]
        if not found or any(math.isnan(value) for value in values):
            continue
        met = start + brentq(assembly, shares[found[0]], shares[found[0] + 1]) * (end - start)
        distance, angle = random.uniform(0.0, NEAR), random.uniform(0.0, math.tau)
        x, y = met[0] + distance * math.cos(angle), met[1] + distance * math.sin(angle)
        if workspace_margin(robot, x, y) > 2e-3:
            return float(x), float(y)
