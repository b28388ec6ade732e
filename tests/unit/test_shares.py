# SPDX-License-Identifier: Apache-2.0
"""`colcon test` and plain `pytest`, in a shell with ROS or without, run every test once."""

from __future__ import annotations

from collections import Counter
from configparser import ConfigParser
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = sorted(manifest.parent for manifest in (ROOT / "src").glob("*/package.xml"))
TESTS = sorted(path for path in (ROOT / "tests").rglob("test_*.py"))

OWN = "test"
"""The folder of a package's own test, which a released package has without the rest."""


def share(package: Path) -> list[Path]:
    """The test files of a package, as its configuration of pytest says."""
    configuration = ConfigParser()
    configuration.read(package / "setup.cfg", encoding="utf-8")
    found = []
    for words in configuration["tool:pytest"]["testpaths"].split():
        if words == OWN:
            continue
        # patterns as pytest takes them, from the folder of the package
        assert words.startswith("../../tests/")
        for path in ROOT.glob(words.removeprefix("../../")):
            found += [path] if path.is_file() else path.rglob("test_*.py")
    return found


def test_every_test_belongs_to_one_package() -> None:
    assert len(PACKAGES) == 4
    assert all(share(package) for package in PACKAGES)
    assert sorted(path for package in PACKAGES for path in share(package)) == TESTS


def test_no_two_test_files_have_the_same_name() -> None:
    """In a shell with ROS its plugin of pytest imports test files by their names alone, and refuses a second one."""
    assert [name for name, count in Counter(path.name for path in TESTS).items() if count > 1] == []


def test_every_package_has_a_test_of_its_own() -> None:
    for package in PACKAGES:
        configuration = ConfigParser()
        configuration.read(package / "setup.cfg", encoding="utf-8")
        assert configuration["tool:pytest"]["testpaths"].split()[0] == OWN
        (test,) = (package / OWN).glob("test_*.py")
        assert test.stem == f"test_{package.name}"
        # what a released package can run: nothing of tests/support
        assert "support" not in test.read_text(encoding="utf-8")
