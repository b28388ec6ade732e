# SPDX-License-Identifier: Apache-2.0
"""The distribution `fivebar`: no code of its own, but the four packages in this version with all that they need."""

from pathlib import Path
from runpy import run_path
from xml.etree import ElementTree

from setuptools import setup

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("fivebar_description", "fivebar_control", "fivebar_sim", "fivebar_bringup")
# setuptools does not put this folder on the path
requirements = run_path(str(ROOT / "packaging" / "requirements.py"))
section, name_of = requirements["section"], requirements["name_of"]

version = ElementTree.parse(ROOT / "src" / "fivebar_bringup" / "package.xml").findtext("version")
setup(
    name="fivebar",
    version=version,
    description="Through the Type 2 singularities of a five-bar parallel robot: simulation, control and ROS 2 nodes.",
    long_description=(ROOT / "docs" / "index.md").read_text(encoding="utf-8").partition("![")[0],
    long_description_content_type="text/markdown",
    license="Apache-2.0",
    maintainer="fivebar maintainers",
    python_requires=">=3.11,<3.14",
    packages=[],
    extras_require={
        "cluster": ["distributed>=2026.8", "dask-jobqueue>=0.9", "cryptography>=42"],
        **{
            extra: [one for one in section("tests") if name_of(one) in names]
            for extra, names in {"data": ("pandas", "pyarrow"), "gym": ("gymnasium",), "moteus": ("moteus",)}.items()
        },
    },
    install_requires=[
        *(f"{package}=={version}" for package in PACKAGES),
        *section("ROS 2"),
        *section("runtime"),
    ],
)
