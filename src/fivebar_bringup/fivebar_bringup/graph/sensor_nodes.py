# SPDX-License-Identifier: Apache-2.0
"""The nodes that measure and estimate: state estimator and IMU listener."""

from __future__ import annotations

from fivebar_bringup.graph.node_spec import PLANT, Mode, NodeSpec
from fivebar_bringup.scenario import Scenario, scalar_topics
from fivebar_control.ros.node_settings import ChainSettings, ImuListenerSettings
from fivebar_description.interface import (
    ESTIMATE_COVARIANCE,
    ESTIMATE_DISTURBANCE,
    ESTIMATE_STATE,
    FAULTS,
    IMU_DATA,
    IMU_ERROR,
    JOINT_STATES,
    MOTOR_STATES,
    PAYLOAD,
    READINGS_RELEASED,
    REFERENCE,
    RUN_EPOCH,
    RUN_PLAN,
    RUN_READY,
    TORQUE_COMMAND,
    VISION_ERROR,
    VISION_PLATFORM,
    VISION_TOPICS,
    Topic,
)
from fivebar_description.settings import to_parameters


def estimator(scenario: Scenario, mode: Mode) -> NodeSpec:
    """Return the state estimator."""
    return NodeSpec(
        "fivebar_control",
        "state_estimator",
        to_parameters(ChainSettings(mode.value)),
        (
            MOTOR_STATES,
            # commands in transit to the drives matter only if the drives have a delay
            *((TORQUE_COMMAND,) if scenario.plant.delay_samples else ()),
            *((IMU_DATA,) if scenario.gyro else ()),
            *scalar_topics(scenario),
            *((VISION_PLATFORM,) if scenario.sees else ()),
            *((READINGS_RELEASED,) if announced(scenario, mode) else ()),
            PAYLOAD,
            FAULTS,
            RUN_PLAN,
            RUN_EPOCH,
        ),
        (JOINT_STATES, ESTIMATE_COVARIANCE, ESTIMATE_DISTURBANCE, FAULTS, *estimate_state(scenario)),
        in_chain=True,
    )


def estimate_state(scenario: Scenario) -> tuple[Topic, ...]:
    """Return the topic of the estimator's state, where a camera lets it begin again."""
    return (ESTIMATE_STATE,) if scenario.sees else ()


def announced(scenario: Scenario, mode: Mode) -> bool:
    """Return whether each sample announces which late readings come with it."""
    return scenario.reads_late and mode is Mode.LOCKSTEP


def imu_listener(scenario: Scenario) -> NodeSpec:
    """Return the node that compares the IMU's acceleration with the reference."""
    return NodeSpec(
        "fivebar_control",
        "imu_listener",
        to_parameters(ImuListenerSettings((PLANT, "trajectory_generator"))),
        (IMU_DATA, REFERENCE, RUN_READY, RUN_PLAN, RUN_EPOCH),
        (IMU_ERROR,),
    )


def awaited_sights(scenario: Scenario, mode: Mode) -> tuple[Topic, ...]:
    """Return the topic for which the plant waits where pictures come with a sample."""
    return (VISION_PLATFORM,) if scenario.camera.on and mode is Mode.LOCKSTEP else ()


def absent_of_vision(scenario: Scenario) -> tuple[Topic, ...]:
    """Return the topics of vision that nobody publishes."""
    if not scenario.camera.on:
        return VISION_TOPICS
    return () if scenario.camera.pictures else (VISION_ERROR,)
