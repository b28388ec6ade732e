# SPDX-License-Identifier: Apache-2.0
"""The node graph of a run: its nodes, their parameters, and the topics that connect them.

The `fivebar` command, the launch files and `fivebar nodes` all use this one description.
"""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import NamedTuple

from fivebar_bringup.bag import RECORDER
from fivebar_bringup.bag.recorder_settings import RecorderSettings
from fivebar_bringup.drives.run_files import Rehearsal
from fivebar_bringup.graph.control_nodes import (
    blender,
    controller,
    supervisor,
    trajectory_generator,
)
from fivebar_bringup.graph.node_spec import EMULATED_ROBOT, PLANT, SCENE_NODE, Mode, NodeSpec
from fivebar_bringup.graph.robot_nodes import beside_bridge, bridge, emulated_hardware, plant
from fivebar_bringup.graph.sensor_nodes import absent_of_vision, estimator, imu_listener
from fivebar_bringup.scenario import Scenario, scalar_topics
from fivebar_bringup.scene.settings import SceneSettings
from fivebar_control.ros.node_settings import ProgramSettings
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_description.interface import (
    CAMERA_TOPICS,
    CANDIDATES,
    ESTIMATION_TOPICS,
    EXTRA_READINGS,
    FAULTS,
    GOAL,
    GOAL_STATUS,
    GROUND_TRUTH,
    IMU_DATA,
    IMU_ERROR,
    JOINT_STATES,
    PASSIVE_STATES,
    PAYLOAD,
    PICTURES,
    PROGRAM,
    PROGRAM_STATUS,
    RECORDED_BESIDES,
    REFERENCE,
    RUN_EPOCH,
    RUN_PLAN,
    SAFETY_STATE,
    TOPICS,
    TORQUE_COMMAND,
    TWIN_OF_TEXT,
    WORK_TOPICS,
    output_topic,
)
from fivebar_description.optional import CAMERA_NODES, CAMERA_ON, optional_part
from fivebar_description.scenario_file import FILE_OF_RUN
from fivebar_description.settings import to_parameters


class Work(NamedTuple):
    """Work of a robot after its plan: the path of a program, if any, from an instruction on, with its pins."""

    program: str = ""
    begin: int = 0
    pins: tuple[str, ...] = ()


class Bridged(NamedTuple):
    """Real drives: the configuration of their bridge, and whether it enables them once all nodes are ready.

    Else the operator configures and activates it. It reports when the motion has ended.
    """

    drives: str
    activate: bool = False


class NoRobot(Enum):
    """A graph without plant and bridge, which somebody else starts."""

    NO_ROBOT = 0


NO_ROBOT = NoRobot.NO_ROBOT


def crossing_graph(
    scenario: Scenario,
    mode: Mode,
    bag: Path,
    robot: Rehearsal | Bridged | NoRobot | None = None,
    scene: bool = False,
    work: Work | None = None,
) -> tuple[NodeSpec, ...]:
    """Return the nodes that run a scenario and record it into the directory `bag`, in the order of data flow.

    They read the scenario from its file beside the bag.

    By default the robot is the simulated plant. With `scene`, a node publishes pictures of the run, which are recorded
    too. With `work`, a node carries out programs.

    Raises:
        InputError: the scenario's motion is refused.
    """
    scheme = scenario.scheme()
    bridged, own = robot is not None, robot is not NO_ROBOT
    rehearsal = robot if isinstance(robot, Rehearsal) else None
    real = robot if isinstance(robot, Bridged) else None
    nodes = [
        *([estimator(scenario, mode)] if scenario.estimated else []),
        trajectory_generator(scenario, mode),
        supervisor(scenario, mode),
        *(controller(scenario, law, mode) for law in tuned_controller(scenario).laws),
    ]
    nodes.append(blender(scenario, mode, endless=bridged))
    nodes += [] if bridged and own else [imu_listener(scenario)]
    nodes += [] if work is None else [_program_runner(scenario, work)]
    keeper = PLANT if rehearsal is None else EMULATED_ROBOT
    if scenario.camera.on:
        camera_nodes = optional_part(CAMERA_NODES, CAMERA_ON)
        nodes += camera_nodes(scenario, mode, None if real is not None or not own else keeper)
    candidates = [law.topic for law in scheme.laws]
    absent = (*(set(CANDIDATES) - set(candidates)), *(() if scenario.estimated else ESTIMATION_TOPICS))
    absent = (*absent, *(() if scenario.has_ground_truth else (GROUND_TRUTH,)))
    absent = (*absent, *{PASSIVE_STATES, EXTRA_READINGS}.difference(scalar_topics(scenario)))
    absent = (*absent, *absent_of_vision(scenario))
    if bridged:
        # the emulated robot has a gyroscope, but no accelerometer
        absent = (*absent, IMU_ERROR)
    if real is not None or not own:
        absent = (*absent, GROUND_TRUTH, *(() if scenario.gyro else (IMU_DATA,)))
    bridge_file = None if real is None else real.drives
    if rehearsal is not None:
        bridge_file = str(rehearsal.files.drives.absolute())
    beside = () if bridge_file is None else beside_bridge(scenario, bridge_file)
    awaited = [*(node.executable for node in (*nodes, *beside)), RECORDER]
    if real is not None:
        nodes.append(bridge(scenario, real.drives, awaited, real.activate, last_sample=True))
    elif rehearsal is not None:
        nodes += emulated_hardware(scenario, rehearsal, awaited)
    elif own:
        nodes.append(plant(scenario, mode, awaited))
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
                tuple(node.executable for node in (*nodes, *beside)),
                simulated_time=mode is Mode.LOCKSTEP,
            )
        ),
        recorded,
        (FAULTS,),
    )
    file = {"scenario": str((bag.parent / FILE_OF_RUN).absolute())}
    # the recorder does not wait for the pictures, which a late subscriber gets too
    reading = (*nodes, *([_scene()] if scene else ()))
    return (
        *(_with_twins(node._replace(parameters={**file, **node.parameters})) for node in reading),
        *beside,
        recorder,
    )


def _with_twins(node: NodeSpec) -> NodeSpec:
    """Return a node with the standard messages that it publishes beside its texts."""
    twins = tuple(TWIN_OF_TEXT[topic] for topic in node.publishes if topic in TWIN_OF_TEXT)
    return node._replace(publishes=(*node.publishes, *twins))


def _program_runner(scenario: Scenario, work: Work) -> NodeSpec:
    return NodeSpec(
        "fivebar_control",
        "program_runner",
        to_parameters(ProgramSettings(work.program, work.begin, scenario.plan().path.samples(scenario.rate_hz))),
        (GOAL_STATUS, SAFETY_STATE, PROGRAM, JOINT_STATES, RUN_PLAN, RUN_EPOCH),
        (GOAL, PAYLOAD, PROGRAM_STATUS, *(output_topic(pin) for pin in work.pins)),
    )


def _scene() -> NodeSpec:
    return NodeSpec(
        "fivebar_bringup",
        SCENE_NODE,
        to_parameters(SceneSettings()),
        (JOINT_STATES, REFERENCE, TORQUE_COMMAND, RUN_PLAN, RUN_EPOCH),
        PICTURES,
    )
