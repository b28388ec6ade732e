# SPDX-License-Identifier: Apache-2.0
"""The command's version is that of its package; each package has an address and a changelog as ROS' tools want them."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest
from catkin_pkg.changelog import get_changelog_from_path
from catkin_pkg.package import parse_package
from typer.testing import CliRunner

import fivebar_bringup
from fivebar_bringup.cli.app import app

SRC = Path(__file__).parents[3] / "src"
PACKAGES = sorted(path.parent for path in SRC.glob("*/package.xml"))


def test_the_command_names_the_version_of_its_package() -> None:
    package = ElementTree.parse(Path(fivebar_bringup.__file__).parents[1] / "package.xml")
    result = CliRunner().invoke(app, ["--version"])
    assert (result.exit_code, result.stdout) == (0, f"fivebar {package.findtext('version')}\n")


@pytest.mark.filterwarnings("ignore:nodes.Node.traverse:DeprecationWarning")
@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.name)
def test_a_package_can_be_released(package: Path) -> None:
    manifest = parse_package(str(package))
    manifest.validate()
    changelog = get_changelog_from_path(str(package), package_name=manifest.name)
    assert f"Changelog for package {manifest.name}" in changelog.rst
    # the heading under which catkin_prepare_release puts the version and the date
    assert "\nForthcoming\n-----------\n* " in changelog.rst
    assert "CHANGELOG.md" in changelog.rst
    assert (SRC.parent / "CHANGELOG.md").is_file()
