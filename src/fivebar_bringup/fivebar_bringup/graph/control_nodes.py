# SPDX-License-Identifier: Apache-2.0
"""The control chain after the state estimator: motion, supervisor, laws and blender."""

from __future__ import annotations

from typing import Any

from fivebar_bringup.graph.node_spec import Mode, NodeSpec
from fivebar_bringup.graph.sensor_nodes import estimate_state
from fivebar_bringup.scenario import Scenario
from fivebar_control.laws.law import TunedLaw
from fivebar_control.ros.node_settings import CONTINUE, HOLD, BlenderSettings, ChainSettings, TrajectorySettings
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_control.scenario.stopping import stop_cycles
from fivebar_description.interface import (
    DRIVES_STATE,
    ESTIMATE_DISTURBANCE,
    FAULTS,
    GOAL,
    GOAL_PATH,
    GOAL_POSE,
    GOAL_STATUS,
    GOAL_TARGET,
    GOAL_TRAJECTORY,
    JOINT_STATES,
    PAYLOAD,
    REFERENCE,
    REFERENCE_AHEAD,
    REFERENCE_MOTION,
    RUN_EPOCH,
    RUN_PATH,
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


def trajectory_generator(scenario: Scenario, mode: Mode) -> NodeSpec:
    """Return the node that publishes the reference and takes requests."""
    after_fault = CONTINUE if mode is Mode.LOCKSTEP else HOLD
    return NodeSpec(
        "fivebar_control",
        "trajectory_generator",
        {**to_parameters(TrajectorySettings(mode.value, after_fault)), **held_for(scenario, mode)},
        (
            JOINT_STATES,
            *(() if mode is Mode.LOCKSTEP else (SAFETY_STATE,)),
            GOAL,
            GOAL_POSE,
            GOAL_TRAJECTORY,
            PAYLOAD,
            FAULTS,
            RUN_PLAN,
            RUN_EPOCH,
        ),
        (REFERENCE, *_reference_ahead(scenario), GOAL_STATUS, GOAL_PATH, GOAL_TARGET, RUN_PLAN, RUN_PATH, FAULTS),
        in_chain=True,
    )


def supervisor(scenario: Scenario, mode: Mode) -> NodeSpec:
    """Return the node that weighs the laws against each other."""
    return NodeSpec(
        "fivebar_control",
        "supervisor",
        to_parameters(ChainSettings(mode.value)),
        (JOINT_STATES, FAULTS, RUN_PLAN, RUN_EPOCH),
        (SUPERVISOR_STATE, SUPERVISOR_SIGMA, FAULTS),
        in_chain=True,
    )


def controller(scenario: Scenario, tuned: TunedLaw, mode: Mode) -> NodeSpec:
    """Return the node of a law, which publishes its candidate torque."""
    law, parameters = tuned.law, to_parameters(ChainSettings(mode.value))
    topics = _law_inputs(scenario), (law.topic, FAULTS)
    return NodeSpec("fivebar_control", law.executable, parameters, *topics, in_chain=True)


def _law_inputs(scenario: Scenario) -> tuple[Topic, ...]:
    disturbance = (ESTIMATE_DISTURBANCE,) if scenario.compensates_disturbance else ()
    return (JOINT_STATES, REFERENCE, *_reference_ahead(scenario), *disturbance, PAYLOAD, FAULTS, RUN_PLAN, RUN_EPOCH)


def _reference_ahead(scenario: Scenario) -> tuple[Topic, ...]:
    """Return the topics of the references that follow, where a law of the scenario looks ahead or needs all of them."""
    ahead = (REFERENCE_AHEAD,) if tuned_controller(scenario).samples_ahead else ()
    return (*ahead, REFERENCE_MOTION) if scenario.scheme().follows_motions else ahead


def blender(scenario: Scenario, mode: Mode, endless: bool) -> NodeSpec:
    """Return the last node before plant or drives; `endless` where these do not end with the motion."""
    scheme = scenario.scheme()
    nominal = scheme.nominal.topic
    candidates = (nominal, VHC_TORQUE, SUPERVISOR_STATE) if scheme.blended else (nominal,)
    return NodeSpec(
        "fivebar_control",
        "blender",
        {**to_parameters(BlenderSettings(mode.value, endless)), **held_for(scenario, mode)},
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


def held_for(scenario: Scenario, mode: Mode) -> dict[str, Any]:
    """Return for how many cycles a torque is held in real time, which no node then has to find out from the motion."""
    return {"safety.stop_cycles": stop_cycles(scenario)} if mode is Mode.REALTIME else {}
