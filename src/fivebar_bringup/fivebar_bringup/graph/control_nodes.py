"""The control chain after the state estimator: motion, supervisor, laws and blender."""

from __future__ import annotations

from typing import Any

from fivebar_bringup.graph.node_spec import Mode, NodeSpec
from fivebar_bringup.graph.sensor_nodes import estimate_state
from fivebar_bringup.scenario import Scenario
from fivebar_control.laws.law import TunedLaw
from fivebar_control.laws.registry import LAWS
from fivebar_control.ros import goal_conditions
from fivebar_control.ros.node_settings import (
    BLENDED,
    CONTINUE,
    HOLD,
    NOT_OF_THE_GUARD,
    SHORTEST_DEADLINE_MS,
    ZONE_PREFIX,
    BlenderSettings,
    GoalSettings,
    MotionSettings,
    SupervisorSettings,
    TrajectorySettings,
)
from fivebar_description.interface import (
    DRIVES_STATE,
    ESTIMATE_DISTURBANCE,
    FAULTS,
    GOAL,
    GOAL_STATUS,
    JOINT_STATES,
    PAYLOAD,
    REFERENCE,
    REFERENCE_AHEAD,
    RUN_EPOCH,
    RUN_PLAN,
    SAFETY_STATE,
    SUPERVISOR_SIGMA,
    SUPERVISOR_STATE,
    TORQUE_COMMAND,
    TORQUE_REQUESTED,
    VHC_TORQUE,
    Topic,
)
from fivebar_description.settings import to_parameters

LOCKSTEP_DEADLINE_MS = 2000.0
"""Timeout for a candidate torque in lockstep (ms)."""

EARLY = 0.25
"""Of a period, by which the candidates' deadline comes before a whole number of periods: the blender looks at it when
samples arrive, and whether the one in question comes a little early must not decide about a whole cycle."""

LOCKSTEP_WAIT_MS = 100.0
"""Time (ms) for which each sample waits for a plan in lockstep, so that few of them pass while the robot rests: less
than the 500 ms after which the plant publishes a sample again."""


def motion_parameters(scenario: Scenario) -> dict[str, Any]:
    """Return the parameters of the nodes that know the plan."""
    motion = MotionSettings(
        robot=scenario.robot,
        rate_hz=scenario.rate_hz,
        working_mode=scenario.signs(),
        waypoints=tuple(coordinate for waypoint in scenario.waypoints for coordinate in waypoint),
        segment_durations=scenario.durations(),
        time_law=scenario.time_law,
        min_authority=scenario.min_authority,
        lead_samples=scenario.lead_samples,
        blend_radius=scenario.blend_radii(),
    )
    return {**to_parameters(motion), **to_parameters(scenario.zone, ZONE_PREFIX)}


def goal_parameters(scenario: Scenario, mode: Mode) -> dict[str, Any]:
    """Return by what requests are judged in a run, as parameters of the node that takes them."""
    limit, tuned = scenario.torque_limit, scenario.tuned()
    follows = tuned.controller.takes_goals
    goals = GoalSettings(
        takes_goals=follows,
        goal_controller=scenario.controller if follows else GoalSettings().goal_controller,
        goal_speed_limit=scenario.safety.joint_speed_limit,
        goal_error_tolerance=scenario.error_tolerance,
        goal_estimated=scenario.estimated,
        goal_gyro_every=scenario.imu.schedule(scenario.rate_hz).every,
        goal_camera_every=scenario.camera.every(scenario.rate_hz),
        goal_held_ms=scenario.stop_cycles() * 1e3 / scenario.rate_hz if mode is Mode.REALTIME else 0.0,
        goal_wait_ms=0.0 if mode is Mode.REALTIME else LOCKSTEP_WAIT_MS,
    )
    return {
        **goal_conditions.GOALS.parameters(goals if limit is None else goals._replace(goal_torque_limit=limit)),
        **goal_conditions.DRIVES.parameters(scenario.drives()),
        **goal_conditions.EKF.parameters(scenario.ekf),
        **goal_conditions.TOLERANCES.parameters(scenario.known_within()),
        **goal_conditions.PASSIVE.parameters(scenario.passive),
        **goal_conditions.RISK.parameters(scenario.risk),
        **goal_conditions.LOADS.parameters(scenario.to_bear()),
        **goal_conditions.SAFETY.parameters(
            scenario.safety._replace(tracking_error_limit=scenario.tracking_error_limit)
        ),
        **(_goal_law(scenario, tuned.nominal) if follows else {}),
    }


def _goal_law(scenario: Scenario, tuned: TunedLaw) -> dict[str, Any]:
    """Return the settings of the law that follows requests, which are planned and screened with it."""
    return goal_conditions.law_group(scenario.controller, scenario.robot).parameters(tuned.settings)


def trajectory_generator(scenario: Scenario, mode: Mode) -> NodeSpec:
    """Return the node that publishes the reference and takes requests."""
    return NodeSpec(
        "fivebar_control",
        "trajectory_generator",
        {
            **motion_parameters(scenario),
            **to_parameters(
                TrajectorySettings(CONTINUE if mode is Mode.LOCKSTEP else HOLD, scenario.tuned().samples_ahead)
            ),
            **goal_parameters(scenario, mode),
        },
        (JOINT_STATES, *(() if mode is Mode.LOCKSTEP else (SAFETY_STATE,)), GOAL, PAYLOAD, RUN_PLAN, RUN_EPOCH),
        (REFERENCE, *_reference_ahead(scenario), GOAL_STATUS, RUN_PLAN, FAULTS),
        in_chain=True,
    )


def supervisor(scenario: Scenario) -> NodeSpec:
    """Return the node that weighs the laws against each other."""
    return NodeSpec(
        "fivebar_control",
        "supervisor",
        {**motion_parameters(scenario), **to_parameters(SupervisorSettings(scenario.scheme().weighting))},
        (JOINT_STATES, RUN_PLAN, RUN_EPOCH),
        (SUPERVISOR_STATE, SUPERVISOR_SIGMA, FAULTS),
        in_chain=True,
    )


def controller(scenario: Scenario, tuned: TunedLaw) -> NodeSpec:
    """Return the node of a law, which publishes its candidate torque."""
    law = tuned.law
    parameters = {**motion_parameters(scenario), **to_parameters(tuned.settings), "disturbance": _disturbance(scenario)}
    if law.executable == "vhc_controller":
        parameters["law"] = law.name
    elif law.executable == "law_controller":
        parameters["law"] = scenario.controller
    outputs = (law.topic, FAULTS)
    return NodeSpec("fivebar_control", law.executable, parameters, _law_inputs(scenario), outputs, in_chain=True)


def _disturbance(scenario: Scenario) -> str:
    return "estimated" if scenario.compensates_disturbance else "none"


def _law_inputs(scenario: Scenario) -> tuple[Topic, ...]:
    disturbance = (ESTIMATE_DISTURBANCE,) if scenario.compensates_disturbance else ()
    return (JOINT_STATES, REFERENCE, *_reference_ahead(scenario), *disturbance, PAYLOAD, RUN_PLAN, RUN_EPOCH)


def _reference_ahead(scenario: Scenario) -> tuple[Topic, ...]:
    """Return the topic of the references that follow, where a law of the scenario looks ahead."""
    return (REFERENCE_AHEAD,) if scenario.tuned().samples_ahead else ()


def blender(scenario: Scenario, mode: Mode, endless: bool) -> NodeSpec:
    """Return the last node before plant or drives; `endless` where these do not end with the motion."""
    scheme = scenario.scheme()
    nominal = scheme.nominal.topic
    period_ms, cycles = 1e3 / scenario.rate_hz, scenario.stop_cycles() if mode is Mode.REALTIME else 0
    candidates = (nominal, VHC_TORQUE, SUPERVISOR_STATE) if scheme.blended else (nominal,)
    return NodeSpec(
        "fivebar_control",
        "blender",
        {
            **to_parameters(
                BlenderSettings(
                    robot=scenario.robot,
                    rate_hz=scenario.rate_hz,
                    working_mode=scenario.working_mode,
                    candidates=BLENDED if scheme.blended else _law_name(scenario),
                    candidate_deadline_ms=(
                        LOCKSTEP_DEADLINE_MS if mode is Mode.LOCKSTEP else _candidate_deadline_ms(cycles, period_ms)
                    ),
                    state_deadline_ms=0.0 if mode is Mode.LOCKSTEP else cycles * period_ms,
                    # the plant ends with the motion, drives do not
                    last_sample=0 if endless else scenario.plan().path.samples(scenario.rate_hz),
                    estimate_recovers=scenario.sees,
                )
            ),
            **to_parameters(scenario.safety_settings(), without=NOT_OF_THE_GUARD),
        },
        (
            JOINT_STATES,
            REFERENCE,
            *candidates,
            FAULTS,
            DRIVES_STATE,
            *estimate_state(scenario),
            PAYLOAD,
            RUN_PLAN,
            RUN_EPOCH,
        ),
        (TORQUE_REQUESTED, TORQUE_COMMAND, FAULTS, SAFETY_STATE),
        in_chain=True,
    )


def _candidate_deadline_ms(cycles: int, period_ms: float) -> float:
    """Return a cycle less than the drives allow, so that the blender, which knows what is missing, reports it."""
    return max(SHORTEST_DEADLINE_MS, (cycles - 1 - EARLY) * period_ms)


def _law_name(scenario: Scenario) -> str:
    """Return the name of the only law: its registered name, or MODULE:NAME."""
    name = scenario.scheme().nominal.name
    return name if name in LAWS else scenario.controller
