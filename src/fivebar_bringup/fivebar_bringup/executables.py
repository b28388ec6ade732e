# SPDX-License-Identifier: Apache-2.0
"""The executables of this package: recorder, pictures, several nodes in one process, and the live page."""

from __future__ import annotations

from fivebar_description.executable import Executable

bag_recorder = Executable("fivebar_bringup.nodes.bag_recorder", "-p directory:=bag")
scene = Executable("fivebar_bringup.nodes.scene", "-p scenario:=middle")
node_group = Executable("fivebar_bringup.nodes.node_group")
viewer = Executable("fivebar_live.nodes.viewer", "-p port:=8080", "fivebar_bringup")
