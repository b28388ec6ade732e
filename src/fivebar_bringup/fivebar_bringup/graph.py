"""The node graph of a run: which nodes, with which parameters, joined by which topics.

The `fivebar` command, the launch file and the page of nodes all start from this one description.
"""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from fivebar_bringup.offline import initial_joints
from fivebar_bringup.scenario import Scenario
from fivebar_description.interface import (
    AWAY_TORQUE,
    CANDIDATES,
    CTC_TORQUE,
    ESTIMATE_COVARIANCE,
    ESTIMATION_TOPICS,
    FAULTS,
    GROUND_TRUTH,
    IMU_DATA,
    IMU_ERROR,
    JOINT_STATES,
    MOTOR_STATES,
    REFERENCE,
    RUN_READY,
    RUN_STATUS,
    SUPERVISOR_SIGMA,
    SUPERVISOR_STATE,
    TOPICS,
    TORQUE_COMMAND,
    UNIFIED_TORQUE,
    VHC_TORQUE,
    Topic,
)


class Mode(StrEnum):
    """How time passes: with the commands, or with the clock."""

    LOCKSTEP = "lockstep"
    REALTIME = "realtime"


class NodeSpec(NamedTuple):
    """One node of the graph; its name is that of its executable."""

    package: str
    executable: str
    parameters: dict[str, Any]
    subscribes: tuple[Topic, ...]
    publishes: tuple[Topic, ...]

    @property
    def module(self) -> str:
        """The Python module that runs the node."""
        return f"{self.package}.nodes.{self.executable}"

    def parameter_file(self) -> str:
        """Return the node's parameters in the format of `--params-file`, for any namespace."""
        return yaml.safe_dump({"/**": {"ros__parameters": self.parameters}}, sort_keys=False)


PLANT = "plant"
RECORDER = "bag_recorder"

REALTIME_DEADLINE_CYCLES = 10
"""Cycles after which the blender misses a candidate in real time."""

LOCKSTEP_DEADLINE_MS = 2000.0


def crossing_graph(scenario: Scenario, mode: Mode, bag: Path) -> tuple[NodeSpec, ...]:
    """Return the nodes that run a scenario and record it into the directory `bag`, in the order of the data's flow.

    Raises:
        InputError: the scenario's motion is refused.
    """
    scheme = scenario.scheme()
    blended = scheme.on_locus is not None
    motion = _motion_parameters(scenario)
    nodes = [
        *([_estimator(scenario)] if scenario.estimated else []),
        NodeSpec("fivebar_control", "trajectory_generator", motion, (JOINT_STATES,), (REFERENCE,)),
        NodeSpec(
            "fivebar_control",
            "supervisor",
            {**motion, "weighting": scheme.weighting},
            (JOINT_STATES,),
            (SUPERVISOR_STATE, SUPERVISOR_SIGMA),
        ),
        _away_controller(scenario, motion),
    ]
    if blended:
        nodes.append(
            NodeSpec(
                "fivebar_control",
                "vhc_controller",
                {
                    **motion,
                    "kp": scenario.gains.kp_vhc,
                    "kd": scenario.gains.kd_vhc,
                    "law": scheme.on_locus,
                    "resolution": scenario.vhc_resolution,
                    "adaptive_gain": scenario.adaptive_gain.enabled,
                    "alpha": scenario.adaptive_gain.alpha,
                    "error_limit": scenario.adaptive_gain.error_limit,
                    "keep_damping": scenario.adaptive_gain.keep_damping,
                },
                (JOINT_STATES, REFERENCE),
                (VHC_TORQUE,),
            )
        )
    nodes += [
        _blender(scenario, mode),
        NodeSpec(
            "fivebar_control",
            "imu_listener",
            {
                "robot": scenario.robot,
                "rate_hz": scenario.rate_hz,
                "working_mode": list(scenario.working_mode),
                "lead_samples": scenario.lead_samples,
                **_imu_parameters(scenario),
            },
            (IMU_DATA, REFERENCE),
            (IMU_ERROR,),
        ),
    ]
    candidates = {topic for node in nodes for topic in node.publishes} & set(CANDIDATES)
    absent = (*(set(CANDIDATES) - candidates), *(() if scenario.estimated else ESTIMATION_TOPICS))
    recorded = [topic for topic in TOPICS if topic not in absent]
    recorder = NodeSpec(
        "fivebar_bringup",
        RECORDER,
        {"directory": str(bag.absolute()), "topics": [topic.name for topic in recorded]},
        tuple(recorded),
        (FAULTS,),
    )
    awaited = [node.executable for node in (*nodes, recorder)]
    return (*nodes, _plant(scenario, mode, awaited), recorder)


def _away_controller(scenario: Scenario, motion: dict[str, Any]) -> NodeSpec:
    inputs = (JOINT_STATES, REFERENCE)
    if scenario.scheme().away == "unified":
        parameters = {
            **motion,
            **scenario.unified.model_dump(),
            "torque_limit": scenario.plant.torque_limit or 0.0,
        }
        return NodeSpec("fivebar_control", "unified_controller", parameters, inputs, (UNIFIED_TORQUE,))
    parameters = {**motion, "kp": scenario.gains.kp, "kd": scenario.gains.kd}
    return NodeSpec("fivebar_control", "ctc_controller", parameters, inputs, (CTC_TORQUE,))


def _motion_parameters(scenario: Scenario) -> dict[str, Any]:
    return {
        "robot": scenario.robot,
        "rate_hz": scenario.rate_hz,
        "working_mode": list(scenario.working_mode),
        "waypoints": [coordinate for waypoint in scenario.waypoints for coordinate in waypoint],
        "segment_durations": list(scenario.durations()),
        "time_law": scenario.time_law,
        "zone_rule": scenario.zone.rule,
        "zone_duration_ms": scenario.zone.duration_ms,
        "zone_epsilon": scenario.zone.epsilon,
        "lead_samples": scenario.lead_samples,
    }


def _imu_parameters(scenario: Scenario) -> dict[str, Any]:
    description = scenario.imu.model_dump(exclude={"noise"})
    return {f"imu_{name}": list(value) if name == "bias" else value for name, value in description.items()}


def _estimator(scenario: Scenario) -> NodeSpec:
    homing, drives = scenario.homing(), scenario.drives()
    return NodeSpec(
        "fivebar_control",
        "state_estimator",
        {
            "robot": scenario.robot,
            "rate_hz": scenario.rate_hz,
            "working_mode": list(scenario.working_mode),
            "homing": [float(homing.x), float(homing.y)],
            "assembly_mode": homing.assembly,
            "encoder_counts": drives.encoder_counts or 0,
            "delay_samples": drives.delay_samples,
            "torque_limit": drives.torque_limit or 0.0,
            **scenario.ekf.as_settings()._asdict(),
        },
        # what is on its way to the drives matters only where they are late
        (MOTOR_STATES, *((TORQUE_COMMAND,) if drives.delay_samples else ())),
        (JOINT_STATES, ESTIMATE_COVARIANCE, FAULTS),
    )


def _blender(scenario: Scenario, mode: Mode) -> NodeSpec:
    scheme = scenario.scheme()
    away = AWAY_TORQUE[scheme.away]
    deadline_ms = LOCKSTEP_DEADLINE_MS if mode is Mode.LOCKSTEP else REALTIME_DEADLINE_CYCLES * 1e3 / scenario.rate_hz
    candidates = (away,) if scheme.on_locus is None else (away, VHC_TORQUE, SUPERVISOR_STATE)
    return NodeSpec(
        "fivebar_control",
        "blender",
        {
            "robot": scenario.robot,
            "rate_hz": scenario.rate_hz,
            "candidates": scheme.away if scheme.on_locus is None else "blended",
            "candidate_deadline_ms": deadline_ms,
            "tracking_error_limit": scenario.tracking_error_limit,
        },
        (JOINT_STATES, REFERENCE, *candidates, FAULTS),
        (TORQUE_COMMAND, FAULTS),
    )


def _plant(scenario: Scenario, mode: Mode, awaited: list[str]) -> NodeSpec:
    options = scenario.plant
    return NodeSpec(
        "fivebar_sim",
        PLANT,
        {
            "robot": scenario.robot,
            "rate_hz": scenario.rate_hz,
            "samples": scenario.plan().path.samples(scenario.rate_hz),
            "mode": mode.value,
            "publishes": "motor_states" if scenario.estimated else "joint_states",
            "initial_joints": list(initial_joints(scenario)),
            "wait_for_nodes": awaited,
            "mass_scale": options.mass_scale,
            "inertia_scale": options.inertia_scale,
            "friction_scale": options.friction_scale,
            "torque_limit": options.torque_limit or 0.0,
            "torque_quantum": options.torque_quantum,
            "encoder_counts": options.encoder_counts or 0,
            "delay_samples": options.delay_samples,
            "seed": options.seed,
            "imu_noise": scenario.imu.noise,
            **_imu_parameters(scenario),
        },
        (TORQUE_COMMAND, RUN_READY),
        (*((MOTOR_STATES, GROUND_TRUTH) if scenario.estimated else (JOINT_STATES,)), IMU_DATA, FAULTS, RUN_STATUS),
    )
