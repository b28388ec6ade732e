# SPDX-License-Identifier: Apache-2.0
"""The executables of this package: the simulated robot and emulated hardware."""

from __future__ import annotations

from fivebar_description.executable import Executable

plant = Executable("fivebar_sim.nodes.plant", "-p scenario:=middle")
cell_clock = Executable("fivebar_sim.nodes.cell_clock", "-p robots:=[left,right]")
camera = Executable("fivebar_camera.nodes.camera", "-p scenario:=camera_slow", package="fivebar_sim")
emulated_board = Executable("fivebar_motkin_emulation.emulated_board", package="fivebar_sim")
emulated_drives = Executable("fivebar_sim.emulators.drives")
emulated_robot = Executable(
    "fivebar_sim.nodes.emulated_robot", "-p scenario:=middle_robot -p emulation:=dextar_emulated"
)
