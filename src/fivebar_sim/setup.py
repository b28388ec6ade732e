# SPDX-License-Identifier: Apache-2.0
from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

NAME = "fivebar_sim"
SHARE = f"share/{NAME}"
DATA = ("config/**/*.yaml", "config/*.xml", "launch/*.launch.py", "urdf/*")
NEEDED = (
    "canopen>=2.2",
    "msgpack>=1.0.3,<1.2",
    "mujoco-core>=4.0",
    "numpy>=1.24",
    "opencv-python-headless>=4.9",
    "pin>=4.0",
    "pydantic>=2.13",
    "python-can>=4.1",
    'python-can>=4.2; python_version >= "3.12"',
)
"""With the bounds of requirements.in; package.xml has those that apt meets.

An extra, because the executables of colcon let setuptools look for the distributions of `install_requires`, and what
ROS and apt install is not always one. The distribution `fivebar` asks for all of them.
"""

OPTIONAL = (
    "fivebar_camera",
    "fivebar_moteus_emulation",
    "fivebar_motkin_emulation",
    "fivebar_mujoco",
    "fivebar_odrive_emulation",
)
"""Import packages without which a robot is simulated as well."""

setup(
    name=NAME,
    version=ElementTree.parse("package.xml").findtext("version"),
    description="Simulation of the five-bar robot: Pinocchio and MuJoCo plants, their sensors and emulated drives.",
    license="Apache-2.0",
    maintainer="fivebar maintainers",
    python_requires=">=3.11",
    extras_require={"pip": NEEDED, "test": ["pytest>=7.2"]},
    packages=find_packages(exclude=["tests", "tests.*"]),
    package_data={package: ["py.typed"] for package in (NAME, *OPTIONAL)},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (SHARE, ["package.xml"]),
        # One entry per file keeps each in its own sub-folder.
        *((f"{SHARE}/{path.parent}", [str(path)]) for pattern in DATA for path in sorted(Path().glob(pattern))),
    ],
    entry_points={
        "console_scripts": [
            "plant = fivebar_sim.executables:plant",
            "cell_clock = fivebar_sim.executables:cell_clock",
            "camera = fivebar_sim.executables:camera",
            "emulated_board = fivebar_sim.executables:emulated_board",
            "emulated_drives = fivebar_sim.executables:emulated_drives",
            "emulated_robot = fivebar_sim.executables:emulated_robot",
        ],
        "fivebar.plants": ["mujoco = fivebar_mujoco.mujoco_motion:MujocoMotion"],
        "fivebar.plant_checks": ["mujoco = fivebar_mujoco.mujoco_robot:check_has_effects"],
        "fivebar.sensors": [
            "camera_frames = fivebar_camera.frames:frame_of",
            "camera_sights = fivebar_camera.sights:Sights",
        ],
        "fivebar.models": ["mujoco = fivebar_mujoco.mujoco_file:mjcf_file"],
    },
)
