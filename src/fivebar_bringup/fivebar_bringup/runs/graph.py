"""The node graph of a run: its nodes, their parameters, and the topics that connect them.

The `fivebar` command, the launch files and `fivebar nodes` all use this one description.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from fivebar_bringup.runs.bag.recorder_settings import RecorderSettings
from fivebar_bringup.runs.bridges import bridge_of
from fivebar_bringup.runs.rehearsal import Rehearsal
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scene.settings import SceneSettings
from fivebar_bringup.simulation.offline import initial_joints
from fivebar_control.laws.law import TunedLaw
from fivebar_control.laws.registry import LAWS
from fivebar_control.ros import goal_conditions
from fivebar_control.ros.node_settings import (
    BLENDED,
    CONTINUE,
    HOLD,
    NOT_OF_THE_FILTER,
    NOT_OF_THE_GUARD,
    ZONE_PREFIX,
    BlenderSettings,
    BridgeSettings,
    EstimatorSettings,
    GoalSettings,
    ImuListenerSettings,
    MotionSettings,
    ProgramSettings,
    SupervisorSettings,
    TrajectorySettings,
    VisionListenerSettings,
)
from fivebar_description.camera import CAMERA_PREFIX
from fivebar_description.imu import IMU_OF_SIMULATION, IMU_PREFIX
from fivebar_description.interface import (
    CAMERA_IMAGE,
    CAMERA_INFO,
    CAMERA_TOPICS,
    CANDIDATES,
    CLOCK,
    DRIVES_STATE,
    ESTIMATE_COVARIANCE,
    ESTIMATE_DISTURBANCE,
    ESTIMATE_STATE,
    ESTIMATION_TOPICS,
    FAULTS,
    GOAL,
    GOAL_STATUS,
    GROUND_TRUTH,
    IMU_DATA,
    IMU_ERROR,
    JOINT_STATES,
    MOTOR_STATES,
    PASSIVE_STATES,
    PAYLOAD,
    PICTURES,
    PROGRAM,
    PROGRAM_STATUS,
    READINGS_RELEASED,
    RECORDED_BESIDES,
    REFERENCE,
    REFERENCE_AHEAD,
    RUN_EPOCH,
    RUN_PLAN,
    RUN_READY,
    RUN_STATUS,
    SAFETY_STATE,
    SUPERVISOR_SIGMA,
    SUPERVISOR_STATE,
    TOPICS,
    TORQUE_COMMAND,
    TORQUE_REQUESTED,
    VHC_TORQUE,
    VISION_ERROR,
    VISION_PLATFORM,
    VISION_TOPICS,
    WORK_TOPICS,
    Topic,
    output_topic,
)
from fivebar_description.passive_encoder import PASSIVE_OF_SIMULATION, PASSIVE_PREFIX
from fivebar_description.settings import to_parameters
from fivebar_description.tolerances import TOLERANCE_PREFIX
from fivebar_sim.ros.node_settings import (
    ALL_JOINTS,
    MOTORS,
    CameraNodeSettings,
    EmulatedRobotSettings,
    PlantNodeSettings,
)


class Mode(StrEnum):
    """How time advances: with each torque command (lockstep), or with the clock (real time)."""

    LOCKSTEP = "lockstep"
    REALTIME = "realtime"


class Hardware(StrEnum):
    """What is controlled: the simulated robot, emulated drives, or a real motor board on USB."""

    SIMULATED = "simulated"
    EMULATED = "emulated"
    USB = "usb"


class NodeSpec(NamedTuple):
    """One node of the graph; its name is that of its executable.

    Attributes:
        package, executable: package and executable that run it.
        parameters: values of its parameters.
        subscribes, publishes: its topics.
        in_chain: whether it belongs to the control chain, between a measurement and its torque.
    """

    package: str
    executable: str
    parameters: dict[str, Any]
    subscribes: tuple[Topic, ...]
    publishes: tuple[Topic, ...]
    in_chain: bool = False

    @property
    def module(self) -> str:
        """The Python module that runs the node."""
        return f"{self.package}.nodes.{self.executable}"

    def parameter_file(self) -> str:
        """Return the node's parameters in the format of `--params-file`, for any namespace."""
        return yaml.safe_dump({"/**": {"ros__parameters": self.parameters}}, sort_keys=False)


PLANT = "plant"
EMULATED_ROBOT = "emulated_robot"
RECORDER = "bag_recorder"
SCENE_NODE = "scene"

COMPILED_FROM_HZ = 200
"""In real time from this rate on, the estimator is compiled; below, it takes a small part of a period as it is."""

LOCKSTEP_DEADLINE_MS = 2000.0
"""Timeout for a candidate torque in lockstep (ms)."""


class Work(NamedTuple):
    """What a robot does after its plan: the path of a program, if any, from an instruction on, with its pins."""

    program: str = ""
    begin: int = 0
    pins: tuple[str, ...] = ()


def crossing_graph(
    scenario: Scenario,
    mode: Mode,
    bag: Path,
    rehearsal: Rehearsal | None = None,
    drives: str | None = None,
    scene: bool = False,
    autostart: bool = False,
    work: Work | None = None,
) -> tuple[NodeSpec, ...]:
    """Return the nodes that run a scenario and record it into the directory `bag`, in the order of data flow.

    With a rehearsal, the bridge and emulated drives replace the plant; with `drives`, the bridge to real drives of that
    configuration, which waits to be configured and activated, or with `autostart` begins as soon as all nodes are ready
    and reports when the motion has ended. With `scene`, a node publishes pictures of the run, which
    are recorded too. With `work`, a node carries out programs.

    Raises:
        InputError: the scenario's motion is refused.
    """
    scheme = scenario.scheme()
    motion = _motion_parameters(scenario)
    bridged = rehearsal is not None or drives is not None
    nodes = [
        *([_estimator(scenario, mode)] if scenario.estimated else []),
        NodeSpec(
            "fivebar_control",
            "trajectory_generator",
            {
                **motion,
                **to_parameters(
                    TrajectorySettings(CONTINUE if mode is Mode.LOCKSTEP else HOLD, scenario.tuned().samples_ahead)
                ),
                **goal_parameters(scenario, mode),
            },
            (JOINT_STATES, *(() if mode is Mode.LOCKSTEP else (SAFETY_STATE,)), GOAL, PAYLOAD, RUN_PLAN, RUN_EPOCH),
            (REFERENCE, *_reference_ahead(scenario), GOAL_STATUS, RUN_PLAN),
            in_chain=True,
        ),
        NodeSpec(
            "fivebar_control",
            "supervisor",
            {**motion, **to_parameters(SupervisorSettings(scheme.weighting))},
            (JOINT_STATES, RUN_PLAN, RUN_EPOCH),
            (SUPERVISOR_STATE, SUPERVISOR_SIGMA),
            in_chain=True,
        ),
        *(_controller(scenario, law, motion) for law in scenario.tuned().laws),
    ]
    nodes += [
        _blender(scenario, mode, endless=bridged),
        *([] if bridged else [_imu_listener(scenario)]),
    ]
    nodes += [] if work is None else [_program_runner(scenario, work)]
    nodes += _vision(scenario, mode, None if drives is not None else PLANT if rehearsal is None else EMULATED_ROBOT)
    candidates = [law.topic for law in scheme.laws]
    absent = (*(set(CANDIDATES) - set(candidates)), *(() if scenario.estimated else ESTIMATION_TOPICS))
    absent = (*absent, *(() if scenario.has_ground_truth else (GROUND_TRUTH,)))
    absent = (*absent, *(() if scenario.passive.leg else (PASSIVE_STATES,)))
    absent = (*absent, *_absent_of_vision(scenario))
    if bridged:
        # the emulated robot has a gyroscope, but no accelerometer
        absent = (*absent, IMU_ERROR)
    if drives is not None:
        absent = (*absent, GROUND_TRUTH, *(() if autostart else (RUN_STATUS,)), *(() if scenario.gyro else (IMU_DATA,)))
    awaited = [*(node.executable for node in nodes), RECORDER]
    if drives is not None:
        nodes.append(bridge(scenario, drives, awaited if autostart else (), last_sample=autostart))
    elif rehearsal is None:
        nodes.append(_plant(scenario, mode, awaited))
    else:
        nodes += _emulated_hardware(scenario, rehearsal, awaited)
    recorded = tuple(topic for topic in (*TOPICS, *(set(candidates) - set(TOPICS))) if topic not in absent)
    recorded = (*recorded, *RECORDED_BESIDES, *(PICTURES if scene else ()))
    if work is not None:
        recorded = (*recorded, *WORK_TOPICS, *(output_topic(pin) for pin in work.pins))
    if scenario.camera.on and scenario.camera.pictures and scenario.camera.record:
        recorded = (*recorded, *CAMERA_TOPICS)
    recorder = NodeSpec(
        "fivebar_bringup",
        RECORDER,
        to_parameters(
            RecorderSettings(
                str(bag.absolute()),
                tuple(topic.name for topic in recorded),
                tuple(node.executable for node in nodes),
            )
        ),
        recorded,
        (FAULTS,),
    )
    # the recorder does not wait for the pictures, which a late subscriber gets too
    return (*nodes, *([_scene(motion)] if scene else ()), recorder)


def _program_runner(scenario: Scenario, work: Work) -> NodeSpec:
    return NodeSpec(
        "fivebar_control",
        "program_runner",
        to_parameters(
            ProgramSettings(scenario.rate_hz, work.program, work.begin, scenario.plan().path.samples(scenario.rate_hz))
        ),
        (GOAL_STATUS, SAFETY_STATE, PROGRAM, JOINT_STATES, RUN_PLAN, RUN_EPOCH),
        (GOAL, PAYLOAD, PROGRAM_STATUS, *(output_topic(pin) for pin in work.pins)),
    )


def _scene(motion: dict[str, Any]) -> NodeSpec:
    return NodeSpec(
        "fivebar_bringup",
        SCENE_NODE,
        {**motion, **to_parameters(SceneSettings())},
        (JOINT_STATES, REFERENCE, TORQUE_COMMAND, RUN_PLAN, RUN_EPOCH),
        PICTURES,
    )


def _imu_listener(scenario: Scenario) -> NodeSpec:
    return NodeSpec(
        "fivebar_control",
        "imu_listener",
        {
            **to_parameters(
                ImuListenerSettings(
                    robot=scenario.robot,
                    rate_hz=scenario.rate_hz,
                    working_mode=scenario.working_mode,
                    lead_samples=scenario.lead_samples,
                    wait_for_nodes=(PLANT, "trajectory_generator"),
                )
            ),
            **to_parameters(scenario.imu, IMU_PREFIX, without=IMU_OF_SIMULATION),
        },
        (IMU_DATA, REFERENCE, RUN_READY, RUN_PLAN, RUN_EPOCH),
        (IMU_ERROR,),
    )


def _vision(scenario: Scenario, mode: Mode, keeper: str | None) -> list[NodeSpec]:
    """Return the camera, where it is simulated, and who reads its pictures.

    `keeper` is the node that publishes the robot's exact state, None for a real robot.
    """
    camera = scenario.camera
    if not camera.on:
        return []
    parameters = to_parameters(camera, CAMERA_PREFIX)
    waits = () if keeper is None else ("camera", "state_estimator" if scenario.estimated else keeper)
    by_the_clock = mode is Mode.REALTIME
    own = CameraNodeSettings(scenario.robot, scenario.rate_hz, by_the_clock, () if keeper is None else (keeper,))
    simulation = NodeSpec(
        "fivebar_sim",
        "camera",
        {**to_parameters(own), **parameters, **to_parameters(scenario.plant)},
        (GROUND_TRUTH, RUN_READY, RUN_PLAN, RUN_EPOCH),
        CAMERA_TOPICS if camera.pictures else (VISION_PLATFORM,),
    )
    listener = NodeSpec(
        "fivebar_control",
        "vision_listener",
        {
            **to_parameters(
                VisionListenerSettings(scenario.robot, scenario.rate_hz, scenario.lead_samples, by_the_clock, waits),
            ),
            **parameters,
        },
        (CAMERA_IMAGE, CAMERA_INFO, JOINT_STATES, RUN_READY, RUN_PLAN, RUN_EPOCH),
        VISION_TOPICS,
    )
    return [*([] if keeper is None else [simulation]), *([listener] if camera.pictures else [])]


def _awaited_sights(scenario: Scenario, mode: Mode) -> tuple[Topic, ...]:
    """Return the topic for which the plant waits where pictures come with a sample."""
    return (VISION_PLATFORM,) if scenario.camera.on and mode is Mode.LOCKSTEP else ()


def _absent_of_vision(scenario: Scenario) -> tuple[Topic, ...]:
    if not scenario.camera.on:
        return VISION_TOPICS
    return () if scenario.camera.pictures else (VISION_ERROR,)


def bridge(scenario: Scenario, drives: str, awaited: Sequence[str], last_sample: bool = False) -> NodeSpec:
    """Return the bridge to drives, with a configuration by name or path; it starts once the awaited nodes are ready.

    With `last_sample` it publishes the progress of the run, and when the motion has ended.
    """
    safety, cycles = scenario.safety, scenario.stop_cycles()
    return NodeSpec(
        "fivebar_control",
        bridge_of(scenario),
        to_parameters(
            BridgeSettings(
                rate_hz=scenario.rate_hz,
                drives=drives,
                command_timeout_ms=cycles * 1e3 / scenario.rate_hz,
                # the last cycle of the brake, and its answer
                brake_limit_s=safety.brake_duration + cycles / scenario.rate_hz if safety.brake else 0.0,
                autostart=bool(awaited),
                wait_for_nodes=tuple(awaited),
                samples=scenario.plan().path.samples(scenario.rate_hz) if last_sample else 0,
            )
        ),
        (TORQUE_COMMAND, FAULTS, RUN_READY, RUN_PLAN),
        (MOTOR_STATES, FAULTS, DRIVES_STATE, RUN_EPOCH, *((RUN_STATUS,) if last_sample else ())),
    )


def _emulated_hardware(scenario: Scenario, rehearsal: Rehearsal, awaited: list[str]) -> tuple[NodeSpec, NodeSpec]:
    robot = NodeSpec(
        "fivebar_sim",
        EMULATED_ROBOT,
        {
            **to_parameters(
                EmulatedRobotSettings(
                    rate_hz=scenario.rate_hz,
                    emulation=str(rehearsal.files.emulation.absolute()),
                    samples=scenario.plan().path.samples(scenario.rate_hz),
                    inject=rehearsal.inject,
                    seed=scenario.plant.seed,
                    wait_for_nodes=tuple(awaited),
                )
            ),
            **to_parameters(scenario.imu, IMU_PREFIX, without=("noise",)),
            **to_parameters(scenario.passive, PASSIVE_PREFIX),
        },
        (MOTOR_STATES, TORQUE_COMMAND, FAULTS, RUN_READY, RUN_PLAN, RUN_EPOCH),
        (GROUND_TRUTH, IMU_DATA, *_passive_states(scenario), FAULTS, RUN_STATUS),
    )
    return bridge(scenario, str(rehearsal.files.drives.absolute()), [*awaited, EMULATED_ROBOT]), robot


def _controller(scenario: Scenario, tuned: TunedLaw, motion: dict[str, Any]) -> NodeSpec:
    law = tuned.law
    parameters = {**motion, **to_parameters(tuned.settings), "disturbance": _disturbance(scenario)}
    if law.executable == "vhc_controller":
        parameters["law"] = law.name
    elif law.executable == "law_controller":
        parameters["law"] = scenario.controller
    return NodeSpec("fivebar_control", law.executable, parameters, _law_inputs(scenario), (law.topic,), in_chain=True)


def _disturbance(scenario: Scenario) -> str:
    return "estimated" if scenario.compensates_disturbance else "none"


def _law_inputs(scenario: Scenario) -> tuple[Topic, ...]:
    disturbance = (ESTIMATE_DISTURBANCE,) if scenario.compensates_disturbance else ()
    return (JOINT_STATES, REFERENCE, *_reference_ahead(scenario), *disturbance, PAYLOAD, RUN_PLAN, RUN_EPOCH)


def _reference_ahead(scenario: Scenario) -> tuple[Topic, ...]:
    """Return the topic of the references that follow, where a law of the scenario looks ahead."""
    return (REFERENCE_AHEAD,) if scenario.tuned().samples_ahead else ()


def _motion_parameters(scenario: Scenario) -> dict[str, Any]:
    motion = MotionSettings(
        robot=scenario.robot,
        rate_hz=scenario.rate_hz,
        working_mode=scenario.signs(),
        waypoints=tuple(coordinate for waypoint in scenario.waypoints for coordinate in waypoint),
        segment_durations=scenario.durations(),
        time_law=scenario.time_law,
        min_authority=scenario.min_authority,
        lead_samples=scenario.lead_samples,
    )
    return {**to_parameters(motion), **to_parameters(scenario.zone, ZONE_PREFIX)}


def goal_parameters(scenario: Scenario, mode: Mode) -> dict[str, Any]:
    """Return by what requests are judged in a run, as parameters of the node that takes them."""
    limit = scenario.torque_limit
    goals = GoalSettings(
        takes_goals=scenario.scheme().takes_goals,
        goal_speed_limit=scenario.safety.joint_speed_limit,
        goal_error_tolerance=scenario.error_tolerance,
        goal_estimated=scenario.estimated,
        goal_gyro_every=scenario.imu.schedule(scenario.rate_hz).every,
        goal_camera_every=scenario.camera.every(scenario.rate_hz),
        goal_held_ms=scenario.stop_cycles() * 1e3 / scenario.rate_hz if mode is Mode.REALTIME else 0.0,
    )
    return {
        **goal_conditions.GOALS.parameters(goals if limit is None else goals._replace(goal_torque_limit=limit)),
        **goal_conditions.DRIVES.parameters(scenario.drives()),
        **goal_conditions.EKF.parameters(scenario.ekf),
        **goal_conditions.TOLERANCES.parameters(scenario.known_within()),
        **goal_conditions.PASSIVE.parameters(scenario.passive),
        **goal_conditions.RISK.parameters(scenario.risk),
        **goal_conditions.LOADS.parameters(scenario.to_bear()),
    }


def _announced(scenario: Scenario, mode: Mode) -> bool:
    """Return whether each sample announces which late readings come with it."""
    return bool(scenario.gyro or scenario.passive.leg or scenario.sees) and mode is Mode.LOCKSTEP


def _passive_states(scenario: Scenario) -> tuple[Topic, ...]:
    return (PASSIVE_STATES,) if scenario.passive.leg else ()


def _estimate_state(scenario: Scenario) -> tuple[Topic, ...]:
    return (ESTIMATE_STATE,) if scenario.sees else ()


def has_compiled_estimator(scenario: Scenario, mode: Mode) -> bool:
    """Return whether the state estimator of a run is compiled: where time presses."""
    return scenario.estimated and mode is Mode.REALTIME and scenario.rate_hz >= COMPILED_FROM_HZ


def _estimator(scenario: Scenario, mode: Mode) -> NodeSpec:
    awaits_readings = _announced(scenario, mode)
    homing, drives = scenario.homing(), scenario.drives()
    return NodeSpec(
        "fivebar_control",
        "state_estimator",
        {
            **to_parameters(
                EstimatorSettings(
                    robot=scenario.robot,
                    rate_hz=scenario.rate_hz,
                    working_mode=scenario.working_mode,
                    homing=(homing.x, homing.y),
                    assembly_mode=homing.assembly,
                    awaits_readings=awaits_readings,
                    compiled=has_compiled_estimator(scenario, mode),
                )
            ),
            **to_parameters(drives),
            **to_parameters(scenario.ekf, without=NOT_OF_THE_FILTER),
            **to_parameters(scenario.known_within(), TOLERANCE_PREFIX),
            **to_parameters(scenario.imu, IMU_PREFIX, without=IMU_OF_SIMULATION),
            **to_parameters(scenario.passive, PASSIVE_PREFIX, without=PASSIVE_OF_SIMULATION),
        },
        (
            MOTOR_STATES,
            # commands in transit to the drives matter only if the drives have a delay
            *((TORQUE_COMMAND,) if drives.delay_samples else ()),
            *((IMU_DATA,) if scenario.gyro else ()),
            *_passive_states(scenario),
            *((VISION_PLATFORM,) if scenario.sees else ()),
            *((READINGS_RELEASED,) if awaits_readings else ()),
            PAYLOAD,
            RUN_PLAN,
            RUN_EPOCH,
        ),
        (JOINT_STATES, ESTIMATE_COVARIANCE, ESTIMATE_DISTURBANCE, FAULTS, *_estimate_state(scenario)),
        in_chain=True,
    )


def _blender(scenario: Scenario, mode: Mode, endless: bool) -> NodeSpec:
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
                    # one cycle less than the drives allow, so that the blender, which knows what is missing, reports it
                    candidate_deadline_ms=LOCKSTEP_DEADLINE_MS if mode is Mode.LOCKSTEP else (cycles - 1) * period_ms,
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
            *_estimate_state(scenario),
            PAYLOAD,
            RUN_PLAN,
            RUN_EPOCH,
        ),
        (TORQUE_REQUESTED, TORQUE_COMMAND, FAULTS, SAFETY_STATE),
        in_chain=True,
    )


def _law_name(scenario: Scenario) -> str:
    """Return the name of the only law: its registered name, or MODULE:NAME."""
    name = scenario.scheme().nominal.name
    return name if name in LAWS else scenario.controller


def _plant(scenario: Scenario, mode: Mode, awaited: list[str]) -> NodeSpec:
    settings = PlantNodeSettings()
    if mode is Mode.REALTIME:
        settings = settings._replace(freshness_samples=scenario.stop_cycles() - 1)
    return NodeSpec(
        "fivebar_sim",
        PLANT,
        {
            **to_parameters(
                settings._replace(
                    robot=scenario.robot,
                    rate_hz=scenario.rate_hz,
                    samples=scenario.plan().path.samples(scenario.rate_hz),
                    mode=mode.value,
                    publishes=MOTORS if scenario.estimated else ALL_JOINTS,
                    initial_joints=initial_joints(scenario),
                    announces_readings=_announced(scenario, mode),
                    wait_for_nodes=tuple(awaited),
                )
            ),
            **to_parameters(scenario.plant),
            **to_parameters(scenario.imu, IMU_PREFIX),
            **to_parameters(scenario.passive, PASSIVE_PREFIX),
            **to_parameters(scenario.camera, CAMERA_PREFIX),
        },
        (TORQUE_COMMAND, *_awaited_sights(scenario, mode), PAYLOAD, RUN_READY, RUN_PLAN),
        (
            MOTOR_STATES if scenario.estimated else JOINT_STATES,
            *((GROUND_TRUTH,) if scenario.has_ground_truth else ()),
            IMU_DATA,
            *_passive_states(scenario),
            *((READINGS_RELEASED,) if _announced(scenario, mode) else ()),
            FAULTS,
            DRIVES_STATE,
            RUN_STATUS,
            RUN_EPOCH,
            *((CLOCK,) if mode is Mode.LOCKSTEP else ()),
        ),
    )
