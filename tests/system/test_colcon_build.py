# SPDX-License-Identifier: Apache-2.0
"""A ROS user's way in: colcon builds the workspace, and puts things where `ros2 run` and `ros2 launch` look."""

import os
import subprocess
import sys
from importlib.metadata import distribution
from pathlib import Path
from xml.etree import ElementTree

import pytest

pytestmark = pytest.mark.extra

SRC = Path(__file__).parents[2] / "src"
PACKAGES = sorted(manifest.parent.name for manifest in SRC.glob("*/package.xml"))


DATA = ("bin", "config", "foxglove", "hook", "launch", "plotjuggler", "rviz", "urdf")
"""Folders of a package whose files are installed."""


def tree(folder: Path) -> set[Path]:
    return {path for path in folder.rglob("*") if "__pycache__" not in path.parts}


@pytest.fixture(scope="module")
def install(tmp_path_factory: pytest.TempPathFactory) -> Path:
    base = tmp_path_factory.mktemp("colcon")
    before = tree(SRC)
    built = subprocess.run(
        [sys.executable, "-m", "colcon", "--log-base", base / "log", "build", "--base-paths", SRC,
         "--build-base", base / "build", "--install-base", base / "install"],
        cwd=base, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert built.returncode == 0, built.stdout + built.stderr
    assert tree(SRC) == before, "the build wrote into the source tree"
    return base / "install"


def test_there_are_packages() -> None:
    assert PACKAGES == ["fivebar_bringup", "fivebar_control", "fivebar_description", "fivebar_sim"]


@pytest.mark.parametrize("package", PACKAGES)
def test_every_command_is_an_executable_of_its_package(install: Path, package: str) -> None:
    commands = {entry.name for entry in distribution(package).entry_points.select(group="console_scripts")}
    folder = install / package / "lib" / package
    installed = {path.name for path in folder.iterdir() if os.access(path, os.X_OK)} if folder.exists() else set()
    assert installed == commands


@pytest.mark.parametrize("package", PACKAGES)
def test_ros_finds_the_package(install: Path, package: str) -> None:
    share = install / package / "share"
    assert (share / "ament_index/resource_index/packages" / package).is_file()
    assert (share / package / "package.xml").is_file()
    assert "AMENT_PREFIX_PATH" in (share / package / "hook/ament_prefix_path.sh").read_text()


@pytest.mark.parametrize("package", PACKAGES)
def test_every_data_file_is_installed(install: Path, package: str) -> None:
    source, share = SRC / package, install / package / "share" / package
    paths = {path for folder in DATA for path in tree(source / folder) if path.is_file()}
    assert not {path for path in paths if not (share / path.relative_to(source)).is_file()}


def test_the_command_is_on_the_path_of_a_shell_that_sources_the_workspace(install: Path, tmp_path: Path) -> None:
    """It is that of the interpreter which colcon built with, also where another one comes first on the path."""
    line = f"source {install}/setup.bash && command -v fivebar && fivebar --version"
    done = subprocess.run(["bash", "-c", line], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found, version = done.stdout.splitlines()
    assert found == str(install / "fivebar_bringup/share/fivebar_bringup/bin/fivebar")
    assert version.endswith(str(ElementTree.parse(SRC / "fivebar_bringup/package.xml").findtext("version")))
    first = (install / "fivebar_bringup/lib/fivebar_bringup/fivebar").read_text(encoding="utf-8").splitlines()[0]
    assert first == f"#!{sys.executable}"


def test_page_templates_are_installed_beside_the_code(install: Path) -> None:
    templates = {path.name for path in (SRC / "fivebar_bringup/fivebar_bringup/pages/templates").iterdir()}
    assert "base.html" in templates
    (folder,) = (install / "fivebar_bringup").glob("lib/python*/site-packages/fivebar_bringup/pages/templates")
    assert {path.name for path in folder.iterdir()} == templates


def test_colcon_test_runs_the_tests_of_a_package(install: Path) -> None:
    """Of one package and one file of it; which tests are whose is in `tests/unit/test_shares.py`."""
    base = install.parent
    done = subprocess.run(
        [sys.executable, "-m", "colcon", "--log-base", base / "log", "test", "--base-paths", SRC,
         "--build-base", base / "build", "--install-base", base / "install", "--return-code-on-test-failure",
         "--packages-select", "fivebar_description", "--pytest-args", "-k", "test_share"],
        cwd=base, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    (suite,) = ElementTree.parse(base / "build" / "fivebar_description" / "pytest.xml").getroot()
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("2", "0", "0")
