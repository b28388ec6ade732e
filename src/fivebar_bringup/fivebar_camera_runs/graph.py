# SPDX-License-Identifier: Apache-2.0
"""The nodes of a camera in the graph: the simulated camera and the vision listener."""

from __future__ import annotations

from fivebar_bringup.graph.node_spec import Mode, NodeSpec
from fivebar_bringup.scenario import Scenario
from fivebar_camera.node_settings import CameraNodeSettings
from fivebar_description.interface import (
    CAMERA_IMAGE,
    CAMERA_INFO,
    CAMERA_TOPICS,
    FAULTS,
    GROUND_TRUTH,
    JOINT_STATES,
    RUN_EPOCH,
    RUN_PLAN,
    RUN_READY,
    VISION_PLATFORM,
    VISION_TOPICS,
)
from fivebar_description.settings import to_parameters
from fivebar_vision.node_settings import VisionListenerSettings


def camera_nodes(scenario: Scenario, mode: Mode, keeper: str | None) -> list[NodeSpec]:
    """Return the camera of a scenario, where it is simulated, and who reads its pictures.

    `keeper` is the node that publishes the robot's exact state, None for a real robot.
    """
    camera = scenario.camera
    waits = () if keeper is None else ("camera", "state_estimator" if scenario.estimated else keeper)
    simulation = NodeSpec(
        "fivebar_sim",
        "camera",
        to_parameters(CameraNodeSettings(mode.value, () if keeper is None else (keeper,))),
        (GROUND_TRUTH, RUN_READY, RUN_PLAN, RUN_EPOCH),
        CAMERA_TOPICS if camera.pictures else (VISION_PLATFORM,),
    )
    listener = NodeSpec(
        "fivebar_control",
        "vision_listener",
        to_parameters(VisionListenerSettings(mode.value, waits)),
        (CAMERA_IMAGE, CAMERA_INFO, JOINT_STATES, FAULTS, RUN_READY, RUN_PLAN, RUN_EPOCH),
        (*VISION_TOPICS, FAULTS),
    )
    return [*([] if keeper is None else [simulation]), *([listener] if camera.pictures else [])]
