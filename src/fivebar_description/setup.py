# SPDX-License-Identifier: Apache-2.0
from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

NAME = "fivebar_description"
SHARE = f"share/{NAME}"
DATA = ("config/**/*.yaml", "config/*.xml", "launch/*.launch.py", "urdf/*")
NEEDED = (
    "annotated-types>=0.6",
    "numpy>=1.24",
    "pin>=4.0",
    "pydantic>=2.13",
    "pyyaml>=6.0",
    "ruamel.yaml>=0.17.21",
)
"""With the bounds of requirements.in; package.xml has those that apt meets.

An extra, because the executables of colcon let setuptools look for the distributions of `install_requires`, and what
ROS and apt install is not always one. The distribution `fivebar` asks for all of them.
"""

setup(
    name=NAME,
    version=ElementTree.parse("package.xml").findtext("version"),
    description="Description of the five-bar robot: parameters, URDF, Pinocchio model and ROS interface.",
    license="Apache-2.0",
    maintainer="fivebar maintainers",
    python_requires=">=3.11",
    extras_require={"pip": NEEDED, "test": ["pytest>=7.2"]},
    packages=find_packages(exclude=["tests", "tests.*"]),
    package_data={package: ["py.typed"] for package in (NAME, "fivebar_motkin_description", "fivebar_optics")},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (SHARE, ["package.xml"]),
        # One entry per file keeps each in its own sub-folder.
        *((f"{SHARE}/{path.parent}", [str(path)]) for pattern in DATA for path in sorted(Path().glob(pattern))),
    ],
    entry_points={"fivebar.sensors": ["camera_model = fivebar_optics.camera_model:nominal_optics"]},
)
