# SPDX-License-Identifier: Apache-2.0
"""The executables of this package: controllers, listeners and bridges."""

from __future__ import annotations

from fivebar_description.executable import Executable

trajectory_generator = Executable("fivebar_control.nodes.trajectory_generator", "-p scenario:=middle")
supervisor = Executable("fivebar_control.nodes.supervisor", "-p scenario:=middle")
ctc_controller = Executable("fivebar_control.nodes.ctc_controller", "-p scenario:=middle")
unified_controller = Executable("fivebar_control.nodes.unified_controller", "-p scenario:=unified_middle")
law_controller = Executable("fivebar_control.nodes.law_controller", "-p scenario:=mpc_middle")
vhc_controller = Executable("fivebar_control.nodes.vhc_controller", "-p scenario:=middle")
blender = Executable("fivebar_control.nodes.blender", "-p scenario:=middle")
program_runner = Executable("fivebar_control.nodes.program_runner", "-p program:=pick_and_place.yaml")
state_estimator = Executable("fivebar_control.nodes.state_estimator", "-p scenario:=middle_encoders")
imu_listener = Executable("fivebar_control.nodes.imu_listener", "-p scenario:=imu_middle")
vision_listener = Executable("fivebar_vision.nodes.vision_listener", "-p scenario:=camera_slow", "fivebar_control")
dextar_bridge = Executable(
    "fivebar_control.nodes.dextar_bridge", "-p scenario:=middle_robot -p drives:=dextar_socketcan"
)
motkin_bridge = Executable(
    "fivebar_motkin.nodes.motkin_bridge", "-p scenario:=motkin_middle -p drives:=my_board.yaml", "fivebar_control"
)
drive_bridge = Executable("fivebar_control.nodes.drive_bridge", "-p scenario:=middle_odrive -p drives:=my_odrives.yaml")
command_watchdog = Executable("fivebar_control.nodes.command_watchdog", "-p drives:=my_joints.yaml")
