"""The executables of this package: recorder, pictures, live page, and several nodes in one process."""

from __future__ import annotations

from fivebar_description.executable import Executable

bag_recorder = Executable("fivebar_bringup.nodes.bag_recorder", "-p directory:=bag")
scene = Executable("fivebar_bringup.nodes.scene", "-p scenario:=middle")
node_group = Executable("fivebar_bringup.nodes.node_group")
viewer = Executable("fivebar_bringup.nodes.viewer", "-p port:=8080")
