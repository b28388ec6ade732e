# SPDX-License-Identifier: Apache-2.0
"""What `make dist` makes: in an environment of its own it is complete, and drives the robot through its singularity."""

from __future__ import annotations

import json
import os
import site
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CODE = Path("lib") / f"python{sys.version_info.major}.{sys.version_info.minor}" / "site-packages"


def called(*command: str | Path, folder: Path = ROOT) -> str:
    environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "MAKEFLAGS")}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The five wheels, beside the packages from PyPI that this environment has."""
    folder = tmp_path_factory.mktemp("wheels")
    called("make", "dist", f"DIST={folder / 'dist'}")
    wheels = sorted((folder / "dist").glob("*.whl"))
    assert len(wheels) == 5
    fresh = folder / "fresh"
    called(sys.executable, "-m", "venv", "--without-pip", fresh)
    called(sys.executable, "-m", "pip", "--python", fresh / "bin/python", "install", "--no-deps", "--quiet", *wheels)
    # with the .pth files of the packages; that of the source tree is among them, but the wheels come first
    lines = [f"import site; site.addsitedir({folder!r})\n" for folder in site.getsitepackages()]
    (fresh / CODE / "packages.pth").write_text("".join(lines), encoding="utf-8")
    return fresh


@pytest.mark.extra
def test_all_that_is_needed_is_asked_for(environment: Path) -> None:
    """And nothing of it is missing, by the wheel's own account."""
    called(sys.executable, "-m", "pip", "--python", environment / "bin/python", "check")
    code = "from importlib.metadata import requires; print(*requires('fivebar'), sep='\\n')"
    asked = called(environment / "bin/python", "-c", code).splitlines()
    assert sum(line == f"{name}=={version('fivebar_bringup')}" for line in asked for name in packages()) == 4
    assert any(line.startswith("ros-rclpy") for line in asked)
    assert not any(line.startswith("pytest") for line in asked)


@pytest.mark.extra
def test_the_installed_command_crosses(environment: Path, tmp_path: Path) -> None:
    simulated = called(environment / "bin/fivebar", "simulate", "middle", "--json", "--no-page", folder=tmp_path)
    summary = json.loads(simulated)
    assert summary["outcome"] == "succeeded"
    assert summary["assembly_mode_changes"] == 2
    code = "import fivebar, fivebar_control; print(fivebar.__file__, fivebar_control.__file__)"
    where = called(environment / "bin/python", "-c", code, folder=tmp_path)
    assert where.count(str(environment / CODE)) == 2


def packages() -> list[str]:
    return sorted(path.parent.name for path in ROOT.glob("src/*/package.xml"))
