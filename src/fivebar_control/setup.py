# SPDX-License-Identifier: Apache-2.0
from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

NAME = "fivebar_control"
SHARE = f"share/{NAME}"
DATA = ("config/**/*.yaml", "config/*.xml", "launch/*.launch.py", "urdf/*")
NEEDED = (
    "canopen>=2.2",
    "daqp>=0.10",
    "motkin-pcb>=1.0",
    "msgpack>=1.0.3,<1.2",
    "numba>=0.56.4",
    "numpy>=1.24",
    "opencv-python-headless>=4.9",
    "pydantic>=2.13",
    "python-can>=4.1",
    'python-can>=4.2; python_version >= "3.12"',
    "scipy>=1.10",
    "toppra>=0.6.9",
)
"""With the bounds of requirements.in; package.xml has those that apt meets.

An extra, because the executables of colcon let setuptools look for the distributions of `install_requires`, and what
ROS and apt install is not always one. The distribution `fivebar` asks for all of them.
"""

OPTIONAL = ("fivebar_moteus", "fivebar_motkin", "fivebar_odrive", "fivebar_vision")
"""Import packages without which a robot is controlled as well: drivers of vendors, and the camera."""

setup(
    name=NAME,
    version=ElementTree.parse("package.xml").findtext("version"),
    description="Model, control laws, trajectories, estimation and drive bridge of the five-bar robot.",
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
            "trajectory_generator = fivebar_control.executables:trajectory_generator",
            "supervisor = fivebar_control.executables:supervisor",
            "ctc_controller = fivebar_control.executables:ctc_controller",
            "unified_controller = fivebar_control.executables:unified_controller",
            "law_controller = fivebar_control.executables:law_controller",
            "vhc_controller = fivebar_control.executables:vhc_controller",
            "blender = fivebar_control.executables:blender",
            "program_runner = fivebar_control.executables:program_runner",
            "state_estimator = fivebar_control.executables:state_estimator",
            "imu_listener = fivebar_control.executables:imu_listener",
            "vision_listener = fivebar_control.executables:vision_listener",
            "dextar_bridge = fivebar_control.executables:dextar_bridge",
            "motkin_bridge = fivebar_control.executables:motkin_bridge",
            "drive_bridge = fivebar_control.executables:drive_bridge",
            "command_watchdog = fivebar_control.executables:command_watchdog",
        ],
        "fivebar.sensors": ["camera_optics = fivebar_vision.camera_file:optics_of"],
    },
)
