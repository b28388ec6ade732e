"""The distribution `fivebar`: no code of its own, but the four packages in this version with all that they need."""

from pathlib import Path
from xml.etree import ElementTree

from setuptools import setup

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("fivebar_description", "fivebar_control", "fivebar_sim", "fivebar_bringup")


def needed() -> list[str]:
    """Return what requirements.in asks for above its development section."""
    runtime = (ROOT / "requirements.in").read_text(encoding="utf-8").partition("# --- development")[0]
    lines = (line.partition("#")[0].strip() for line in runtime.splitlines())
    return [line for line in lines if line]


version = ElementTree.parse(ROOT / "src" / "fivebar_bringup" / "package.xml").findtext("version")
setup(
    name="fivebar",
    version=version,
    description="Through the Type 2 singularities of a five-bar parallel robot: simulation, control and ROS 2 nodes.",
    long_description=(ROOT / "docs" / "index.md").read_text(encoding="utf-8").partition("![")[0],
    long_description_content_type="text/markdown",
    license="Apache-2.0",
    maintainer="fivebar maintainers",
    maintainer_email="maintainers@example.com",
    python_requires=">=3.11,<3.14",
    packages=[],
    extras_require={"data": ["pandas", "pyarrow"]},
    install_requires=[*(f"{package}=={version}" for package in PACKAGES), *needed()],
)
