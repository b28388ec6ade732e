from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

NAME = "fivebar_description"
SHARE = f"share/{NAME}"
DATA = ("config/**/*.yaml", "config/*.xml", "launch/*.launch.py", "urdf/*")

setup(
    name=NAME,
    version=ElementTree.parse("package.xml").findtext("version"),
    description="Description of the five-bar robot: parameters, URDF, Pinocchio model and ROS interface.",
    license="Apache-2.0",
    maintainer="fivebar maintainers",
    maintainer_email="maintainers@example.com",
    python_requires=">=3.11",
    extras_require={"test": ["pytest"]},
    packages=find_packages(exclude=["tests", "tests.*"]),
    package_data={NAME: ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (SHARE, ["package.xml"]),
        # One entry per file keeps each in its own sub-folder.
        *((f"{SHARE}/{path.parent}", [str(path)]) for pattern in DATA for path in sorted(Path().glob(pattern))),
    ],
)
