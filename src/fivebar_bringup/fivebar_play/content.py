# SPDX-License-Identifier: Apache-2.0
"""Constants of the page: robot, controllers, loci and the recorded runs."""

from __future__ import annotations

from typing import Any

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import Case, case_of
from fivebar_control.compiling import bound
from fivebar_control.laws.registry import CONTROLLERS
from fivebar_control.loop.closed_loop import first_memory, law_functions, run_loop
from fivebar_control.model.dynamics import inverse_dynamics_of_platform
from fivebar_control.model.geometry import direct_geometry, elbow_position
from fivebar_control.model.kinematics import det_a, platform_acceleration, state_from_platform
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.trajectory.path import Segment
from fivebar_play.javascript import Translation
from fivebar_play.run import (
    IDEAL,
    RUN,
    WITH_EFFECTS,
    PlayRun,
    least_reach,
    play,
    play_motion,
    pushed,
)
from fivebar_sim.effects.timing import drawn

TRANSLATED = ("ctc", "multi_joint", "multi_cartesian", "unified")
"""The controllers that the page runs; `mpc` needs a solver, and is recorded."""

RECORDED = "mpc"

RATE_HZ, TORQUE_LIMIT = 500, 10.0
"""The middle crossing of the thesis: samples per second, and torque of the drives (Nm)."""

START, GOAL = (0.0, 0.15), (0.0, 0.02)
DURATION = 1.0
"""The middle crossing of the thesis (m, s)."""

PUSH_TIME = 0.05
"""How long the page's push lasts (s), half of it before the crossing."""

LENGTH_STEP, LENGTH_STEPS = 1e-4, 10
"""The wrong length of the page: distal link 1 is longer or shorter than the controllers know by so many steps (m)."""


def scenario_of(
    controller: str,
    start: tuple[float, float] = START,
    goal: tuple[float, float] = GOAL,
    duration: float = DURATION,
    push: float = 0.0,
    push_start: float = 0.0,
    longer: float = 0.0,
) -> Scenario:
    """Return the scenario of a run of the page: a motion (m, s), a push (N, from s on), and a wrong length (m)."""
    plant: dict[str, Any] = {"torque_limit": TORQUE_LIMIT}
    if push > 0.0:
        plant["push"] = {"force": push, "along": "locus", "start": push_start, "length": PUSH_TIME}
    if longer != 0.0:
        plant["links"] = {"l_12": longer}
    return Scenario.model_validate(
        {
            "name": "play",
            "controller": controller,
            "waypoints": [start, goal],
            "segment_duration": duration,
            "rate_hz": RATE_HZ,
            "plant": plant,
        }
    )


def case_with(controller: str, push: float = 0.0, longer: float = 0.0) -> Case:
    """Return the case of a run of the page."""
    return case_of(scenario_of(controller, push=push, longer=longer))


def exported() -> dict[str, Any]:
    """Return the functions and constants of the page, by their names in JavaScript."""
    cases = {name: case_with(name) for name in TRANSLATED}
    ideal = next(iter(cases.values())).numbers
    # a push that the page replaces, so that there is a robot with effects without a wrong length too
    wrong = [case_with("ctc", 1.0, step * LENGTH_STEP).numbers for step in range(-LENGTH_STEPS, LENGTH_STEPS + 1)]
    scenario = scenario_of("ctc")
    loops = {name: law_functions(case.controller) for name, case in cases.items()}
    return {
        "state_from_platform": state_from_platform,
        "parallel_svd": parallel_svd,
        "det_a": det_a,
        "platform_acceleration": platform_acceleration,
        "inverse_dynamics_of_platform": inverse_dynamics_of_platform,
        "direct_geometry": direct_geometry,
        "elbow_position": elbow_position,
        "play_motion": play_motion,
        "least_reach": least_reach,
        "pushed": pushed,
        "play": play,
        "PlayRun": PlayRun,
        "Segment": Segment,
        "ideal": {name: bound(run_loop, **laws, **RUN, **IDEAL) for name, laws in loops.items()},
        "with_effects": {name: bound(run_loop, **laws, **RUN, **WITH_EFFECTS) for name, laws in loops.items()},
        "control": {name: case.numbers.control for name, case in cases.items()},
        "memory": {name: first_memory(case.controller, case.numbers.control, list) for name, case in cases.items()},
        "robot": ideal.control.robot,
        "mode": [ideal.control.mode],
        "rate_hz": ideal.rate_hz,
        "steps": ideal.steps,
        "step": ideal.step,
        "torque_limit": TORQUE_LIMIT,
        "zone_time": scenario.zone.as_rule().duration,
        "min_authority": {name: CONTROLLERS[name].min_authority for name in TRANSLATED},
        "tolerance": scenario.error_tolerance,
        "actual": [case.actual for case in wrong],
        "mechanism": [case.mechanism for case in wrong],
    }


def model() -> str:
    """Return the page's functions and constants as a JavaScript expression."""
    # the jitter of a robot without jitter is not drawn, and needs numbers with more digits than JavaScript's
    return Translation(without=[drawn]).text(exported())
