# SPDX-License-Identifier: Apache-2.0
"""The settings of the camera's node; nothing here needs ROS."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_description.shared_settings import LOCKSTEP, AwaitedNodes, RunMode


class CameraNodeSettings(NamedTuple):
    """The camera's node."""

    mode: RunMode = LOCKSTEP
    wait_for_nodes: AwaitedNodes = ()
