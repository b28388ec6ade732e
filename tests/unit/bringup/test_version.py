"""The command's version is that of its package."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

from typer.testing import CliRunner

import fivebar_bringup
from fivebar_bringup.cli.app import app


def test_the_command_names_the_version_of_its_package() -> None:
    package = ElementTree.parse(Path(fivebar_bringup.__file__).parents[1] / "package.xml")
    result = CliRunner().invoke(app, ["--version"])
    assert (result.exit_code, result.stdout) == (0, f"fivebar {package.findtext('version')}\n")
