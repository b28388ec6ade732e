# SPDX-License-Identifier: Apache-2.0
from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

NAME = "fivebar_bringup"
SHARE = f"share/{NAME}"
DATA = (
    "bin/*",
    "hook/*.dsv",
    "config/**/*.yaml",
    "config/**/*.csv",
    "config/*.xml",
    "launch/*.launch.py",
    "rviz/*.rviz",
    "foxglove/*.json",
    "plotjuggler/*.xml",
)

NEEDED = (
    "bokeh>=3.1",
    "jinja2>=3.1.2",
    "matplotlib>=3.6.3",
    "mcap>=1.5",
    "mujoco-core>=4.0",
    "numpy>=1.24",
    "opencv-python-headless>=4.9",
    "pillow>=9.4",
    "pin>=4.0",
    "pydantic>=2.13",
    "pyyaml>=6.0",
    "rich>=13.3.1",
    "rosbags>=0.11.6",
    "scipy>=1.10",
    "tornado>=6.2",
    "typer>=0.16",
)
"""With the bounds of requirements.in; package.xml has those that apt meets.

An extra, because the executables of colcon let setuptools look for the distributions of `install_requires`, and what
ROS and apt install is not always one. The distribution `fivebar` asks for all of them.
"""

OPTIONAL = (
    "fivebar_camera_runs",
    "fivebar_commission",
    "fivebar_gym",
    "fivebar_live",
    "fivebar_play",
    "fivebar_studies",
    "fivebar_vendor_drives",
)
"""Import packages without which a robot crosses as well; they register what they add below."""

setup(
    name=NAME,
    version=ElementTree.parse("package.xml").findtext("version"),
    description="Launch files, scenarios, the fivebar command, the bag recorder and the reports of the five-bar robot.",
    license="Apache-2.0",
    maintainer="fivebar maintainers",
    python_requires=">=3.11",
    extras_require={"pip": NEEDED, "test": ["pytest>=7.2"]},
    packages=find_packages(exclude=["tests", "tests.*"]),
    package_data={
        NAME: ["py.typed", "pages/scripts/*", "pages/templates/*"],
        "fivebar": ["py.typed"],
        **{package: ["py.typed", "scripts/*", "templates/*"] for package in OPTIONAL},
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (SHARE, ["package.xml"]),
        # One entry per file keeps each in its own sub-folder.
        *((f"{SHARE}/{path.parent}", [str(path)]) for pattern in DATA for path in sorted(Path().glob(pattern))),
    ],
    entry_points={
        "console_scripts": [
            "bag_recorder = fivebar_bringup.executables:bag_recorder",
            "fivebar = fivebar_bringup.cli.entry:main",
            "scene = fivebar_bringup.executables:scene",
            "node_group = fivebar_bringup.executables:node_group",
            "viewer = fivebar_bringup.executables:viewer",
        ],
        "fivebar.commands": [
            "camera = fivebar_camera_runs.cli",
            "commission = fivebar_commission.cli",
            "live = fivebar_live.cli",
            "play = fivebar_play.cli",
            "studies = fivebar_studies.cli",
        ],
        "fivebar.live_page": ["live_page = fivebar_live.attached:live_page"],
        "fivebar.sensors": [
            "camera_accuracy = fivebar_camera_runs.accuracy:position_errors",
            "camera_figure = fivebar_camera_runs.figure:vision",
            "camera_nodes = fivebar_camera_runs.graph:camera_nodes",
            "camera_series = fivebar_camera_runs.series:vision_series",
            "camera_simulation = fivebar_camera_runs.simulation:SimulatedVision",
        ],
        "fivebar.python": ["sweep = fivebar_studies.python:sweep"],
        "fivebar.drives": [
            "canopen = fivebar_bringup.drives.kinds:CANOPEN_DRIVES",
            "motkin = fivebar_vendor_drives.kinds:MOTKIN_BOARD",
            "moteus = fivebar_vendor_drives.kinds:MOTEUS_DRIVES",
            "odrive = fivebar_vendor_drives.kinds:ODRIVES",
            "ros2_control = fivebar_bringup.drives.kinds:CONTROLLED_JOINTS",
        ],
    },
)
