"""The executables of this package: controllers, listeners and bridges."""

from __future__ import annotations

from fivebar_description.executable import Executable

trajectory_generator = Executable("fivebar_control.nodes.trajectory_generator")
supervisor = Executable("fivebar_control.nodes.supervisor")
ctc_controller = Executable("fivebar_control.nodes.ctc_controller")
unified_controller = Executable("fivebar_control.nodes.unified_controller")
law_controller = Executable("fivebar_control.nodes.law_controller")
vhc_controller = Executable("fivebar_control.nodes.vhc_controller")
blender = Executable("fivebar_control.nodes.blender")
program_runner = Executable("fivebar_control.nodes.program_runner")
state_estimator = Executable("fivebar_control.nodes.state_estimator")
imu_listener = Executable("fivebar_control.nodes.imu_listener")
vision_listener = Executable("fivebar_control.nodes.vision_listener")
dextar_bridge = Executable("fivebar_control.nodes.dextar_bridge")
motkin_bridge = Executable("fivebar_control.nodes.motkin_bridge")
drive_bridge = Executable("fivebar_control.nodes.drive_bridge")
command_watchdog = Executable("fivebar_control.nodes.command_watchdog")
