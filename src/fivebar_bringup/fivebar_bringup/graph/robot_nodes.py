# SPDX-License-Identifier: Apache-2.0
"""The nodes that the commanded torque reaches: the simulated plant, emulated drives, or the bridge to real ones."""

from __future__ import annotations

from collections.abc import Sequence

from fivebar_bringup.drives.choice import kind_of
from fivebar_bringup.drives.run_files import Rehearsal
from fivebar_bringup.graph.control_nodes import held_for
from fivebar_bringup.graph.node_spec import EMULATED_ROBOT, PLANT, Mode, NodeSpec
from fivebar_bringup.graph.sensor_nodes import announced, awaited_sights
from fivebar_bringup.scenario import Scenario, scalar_topics
from fivebar_control.hardware.drive_connection import DriveConnection
from fivebar_control.ros.node_settings import BridgeSettings
from fivebar_control.scenario.stopping import brake_limit, stop_cycles
from fivebar_description.interface import (
    CLOCK,
    DRIVES_STATE,
    FAULTS,
    GROUND_TRUTH,
    IMU_DATA,
    JOINT_STATES,
    MOTOR_STATES,
    PAYLOAD,
    READINGS_RELEASED,
    REFERENCE,
    RELEASE_STATUS,
    RUN_EPOCH,
    RUN_PLAN,
    RUN_READY,
    RUN_STATUS,
    SAFETY_STATE,
    TORQUE_COMMAND,
)
from fivebar_description.modules import load_part
from fivebar_description.settings import to_parameters
from fivebar_sim.ros.node_settings import EmulatedRobotSettings, PlantNodeSettings


def plant(scenario: Scenario, mode: Mode, awaited: list[str]) -> NodeSpec:
    """Return the simulated robot; it starts once the awaited nodes are ready."""
    settings = PlantNodeSettings(mode.value, wait_for_nodes=tuple(awaited), brake_limit_s=brake_limit(scenario))
    if mode is Mode.REALTIME:
        settings = settings._replace(freshness_samples=stop_cycles(scenario) - 1)
    return NodeSpec(
        "fivebar_sim",
        PLANT,
        to_parameters(settings),
        (
            TORQUE_COMMAND,
            *awaited_sights(scenario, mode),
            SAFETY_STATE,
            RELEASE_STATUS,
            PAYLOAD,
            FAULTS,
            RUN_READY,
            RUN_PLAN,
        ),
        (
            MOTOR_STATES if scenario.estimated else JOINT_STATES,
            *((GROUND_TRUTH,) if scenario.has_ground_truth else ()),
            IMU_DATA,
            *scalar_topics(scenario),
            *((READINGS_RELEASED,) if announced(scenario, mode) else ()),
            FAULTS,
            DRIVES_STATE,
            RUN_STATUS,
            RUN_EPOCH,
            *((CLOCK,) if mode is Mode.LOCKSTEP else ()),
        ),
    )


def bridge(
    scenario: Scenario, drives: str, awaited: Sequence[str], autostart: bool = True, last_sample: bool = False
) -> NodeSpec:
    """Return the bridge to drives, with a configuration by name or path.

    Once the awaited nodes are ready it enables the drives, or without `autostart` may be asked to. With `last_sample`
    it publishes the progress of the run, and when it has ended.
    """
    kind = kind_of(scenario, drives)
    connection: DriveConnection = load_part(kind.connection)(drives)
    followed = () if connection.inner_loop is None else (REFERENCE, JOINT_STATES)
    settings = BridgeSettings(
        drives=drives,
        autostart=autostart,
        wait_for_nodes=tuple(awaited),
        samples=scenario.plan().path.samples(scenario.rate_hz) if last_sample else 0,
    )
    return NodeSpec(
        "fivebar_control",
        kind.bridge,
        {**to_parameters(settings), **held_for(scenario, Mode.REALTIME)},
        (TORQUE_COMMAND, *followed, FAULTS, RUN_READY, RUN_PLAN),
        (MOTOR_STATES, FAULTS, DRIVES_STATE, RUN_EPOCH, *((RUN_STATUS,) if last_sample else ())),
    )


def beside_bridge(scenario: Scenario, drives: str) -> tuple[NodeSpec, ...]:
    """Return the node that runs beside the bridge to drives of a configuration, where their interface has one."""
    kind = kind_of(scenario, drives)
    if not kind.beside:
        return ()
    return (NodeSpec("fivebar_control", kind.beside, {"drives": drives}, (DRIVES_STATE,), (FAULTS,)),)


def emulated_hardware(scenario: Scenario, rehearsal: Rehearsal, awaited: list[str]) -> tuple[NodeSpec, NodeSpec]:
    """Return the bridge to emulated drives, and the robot on these drives."""
    robot = NodeSpec(
        "fivebar_sim",
        EMULATED_ROBOT,
        to_parameters(
            EmulatedRobotSettings(
                emulation=str(rehearsal.files.emulation.absolute()),
                samples=scenario.plan().path.samples(scenario.rate_hz),
                inject=rehearsal.inject,
                wait_for_nodes=tuple(awaited),
            )
        ),
        (MOTOR_STATES, TORQUE_COMMAND, FAULTS, PAYLOAD, RUN_READY, RUN_PLAN, RUN_EPOCH),
        (GROUND_TRUTH, IMU_DATA, *scalar_topics(scenario), FAULTS, RUN_STATUS),
    )
    return bridge(scenario, str(rehearsal.files.drives.absolute()), [*awaited, EMULATED_ROBOT]), robot
