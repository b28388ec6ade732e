"""The executables of this package: the simulated robot and emulated hardware."""

from __future__ import annotations

from fivebar_description.executable import Executable

plant = Executable("fivebar_sim.nodes.plant", "-p scenario:=middle")
cell_clock = Executable("fivebar_sim.nodes.cell_clock", "-p robots:=[left,right]")
camera = Executable("fivebar_sim.nodes.camera", "-p scenario:=camera_slow")
emulated_board = Executable("fivebar_sim.emulators.board")
emulated_drives = Executable("fivebar_sim.emulators.drives")
emulated_robot = Executable(
    "fivebar_sim.nodes.emulated_robot", "-p scenario:=middle_robot -p emulation:=dextar_emulated"
)
