# SPDX-License-Identifier: Apache-2.0
"""The core crosses where no optional package is installed, and refuses by name what needs one."""

from __future__ import annotations

import json
import os
import shutil
import site
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

SRC = Path(__file__).parents[2] / "src"
CORE = {*(manifest.parent.name for manifest in SRC.glob("*/package.xml")), "fivebar"}
"""The import packages that are named as their ROS package, and the Python interface."""

OPTIONAL = {package.parent.name for package in SRC.glob("*/*/__init__.py")} - CORE
CODE = Path("lib") / f"python{sys.version_info.major}.{sys.version_info.minor}" / "site-packages"
BAD_INPUT = 2

LAUNCHED = """
import json, sys
from fivebar_bringup.runs.launching import ControlRequest, described_processes
for hardware, scenario in (("simulated", "middle"), ("emulated", "middle_robot")):
    found = described_processes(ControlRequest(scenario, hardware=hardware))
    print(json.dumps([[process.package, process.executable] for process in found]))
"""


class CoreAlone:
    """An environment with the core's import packages and what else this one has."""

    def __init__(self, folder: Path) -> None:
        """Copy the core, and make an environment beside the packages that others have made."""
        for manifest in SRC.glob("*/package.xml"):
            left_out = shutil.ignore_patterns(*OPTIONAL, "__pycache__", "*.egg-info", "build")
            shutil.copytree(manifest.parent, folder / "src" / manifest.parent.name, ignore=left_out)
        self._python = folder / "fresh" / "bin" / "python"
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder / "fresh"], check=True)
        lines = [str(path) for path in sorted((folder / "src").iterdir())]
        for packages in map(Path, site.getsitepackages()):
            lines.append(str(packages))
            for file in packages.glob("*.pth"):
                # but that of this workspace
                if not any(Path(line) in SRC.iterdir() for line in file.read_text(encoding="utf-8").splitlines()):
                    shutil.copy(file, folder / "fresh" / CODE)
        (folder / "fresh" / CODE / "a_core.pth").write_text("\n".join(lines), encoding="utf-8")
        self._folder = folder / "work"
        self._folder.mkdir()

    def python(self, code: str, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run a program."""
        environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "PYTHONHOME")}
        command = [self._python, "-c", code, *arguments]
        return subprocess.run(command, cwd=self._folder, env=environment, capture_output=True, text=True, check=False)

    def fivebar(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run the command."""
        code = "import sys; sys.argv[0] = 'fivebar'; from fivebar_bringup.cli.entry import main; main()"
        return self.python(code, *arguments)

    def found(self, *arguments: str) -> Any:
        """Return what a command that succeeds prints."""
        done = self.fivebar(*arguments, "--json")
        assert done.returncode == 0, done.stdout + done.stderr
        return json.loads(done.stdout)

    def refused(self, *arguments: str) -> str:
        """Return in what words a command is refused as bad input, in one line."""
        done = self.fivebar(*arguments)
        assert (done.returncode, "Traceback" in done.stderr) == (BAD_INPUT, False), done.stdout + done.stderr
        return " ".join(done.stderr.split())


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> CoreAlone:
    return CoreAlone(tmp_path_factory.mktemp("core"))


@pytest.mark.extra
def test_nothing_but_the_core_is_there(core: CoreAlone) -> None:
    assert {"fivebar_studies", "fivebar_mujoco", "fivebar_odrive", "fivebar_motkin_emulation"} <= OPTIONAL
    code = "import sys; from importlib.util import find_spec; print([find_spec(n) is not None for n in sys.argv[1:]])"
    assert core.python(code, *sorted(OPTIONAL)).stdout.split() == str([False] * len(OPTIONAL)).split()
    where = core.python("import sys; print(*[__import__(n).__file__ for n in sys.argv[1:]])", *sorted(CORE)).stdout
    assert len(where.split()) == len(CORE)
    assert str(SRC) not in where


@pytest.mark.extra
def test_graph_and_offline_runner_cross_with_the_same_error(core: CoreAlone) -> None:
    simulated, run = core.found("simulate", "middle", "--no-page"), core.found("run", "middle", "--no-page")
    for summary in (simulated, run):
        assert (summary["outcome"], summary["assembly_mode_changes"]) == ("succeeded", 2)
    assert simulated["tracking_error_peak_m"] == run["tracking_error_peak_m"]
    assert 0.0 < run["tracking_error_peak_m"] < 1e-3


@pytest.mark.extra
def test_it_goes_to_a_point_in_another_assembly_mode(core: CoreAlone) -> None:
    gone = core.found("goto", "0", "0.02", "--mode=-", "--no-page")
    assert gone["plan"]["goal"] == {"x": 0.0, "y": 0.02, "assembly_mode": "-"}
    summary = gone["summary"]
    assert (summary["outcome"], summary["assembly_mode_changes"]) == ("succeeded", 1)
    predicted = {figure["name"]: figure["value"] for figure in gone["plan"]["figures"]}
    error = predicted["predicted distance from the reference"]
    assert summary["tracking_error_peak_m"] == pytest.approx(error, rel=1e-3)
    assert error < 1e-4


@pytest.mark.extra
@pytest.mark.clock
@pytest.mark.parametrize("scenario", ["middle_robot", "middle_ros2_control"])
def test_it_rehearses_on_emulated_drives(core: CoreAlone, scenario: str) -> None:
    summary = core.found("run", scenario, "--hardware", "emulated", "--no-page")
    assert (summary["outcome"], summary["assembly_mode_changes"]) == ("succeeded", 2)
    assert 0.0 < summary["tracking_error_peak_m"] < 4e-3


@pytest.mark.extra
@pytest.mark.timeout(1800)
def test_it_calibrates(core: CoreAlone) -> None:
    core.found("simulate", "calibration", "--no-page", "--out", "moved")
    found = core.found("calibrate", "moved")
    assert max(map(abs, found["elbow_gap_before_m"])) > 4e-4
    assert max(found["elbow_gap_half_widths_m"]) < 3e-5


@pytest.mark.extra
@pytest.mark.timeout(1800)
def test_it_identifies(core: CoreAlone) -> None:
    core.found("simulate", "excitation", "--no-page", "--out", "excited")
    found = core.found("identify", "excited")["parameters"]
    assert len(found) == 7
    for name, one in found.items():
        assert one["value"] == pytest.approx(one["before"], rel=0.01, abs=1e-3), name


@pytest.mark.extra
def test_it_tells_launch_files_what_to_start(core: CoreAlone) -> None:
    done = core.python(LAUNCHED)
    assert done.returncode == 0, done.stderr
    simulated, emulated = map(json.loads, done.stdout.splitlines())
    assert [*simulated[:5], simulated[-1]] == [
        ["fivebar_control", "trajectory_generator"],
        ["fivebar_control", "supervisor"],
        ["fivebar_control", "ctc_controller"],
        ["fivebar_control", "vhc_controller"],
        ["fivebar_control", "blender"],
        ["fivebar_sim", "plant"],
    ]
    assert emulated == [
        ["fivebar_bringup", "node_group"],
        ["fivebar_control", "dextar_bridge"],
        ["fivebar_sim", "emulated_robot"],
    ]


@pytest.mark.extra
def test_what_needs_another_package_is_refused_by_name(core: CoreAlone) -> None:
    install = "which is not installed: pip install fivebar, or make setup in a clone"
    for command, package in (("sweep", "fivebar_studies"), ("view", "fivebar_live"), ("play", "fivebar_play")):
        assert f"{command}: needs the package {package}, {install}" in core.refused(command)
    for drives, name in (("middle_odrive", "odrive"), ("middle_moteus", "moteus"), ("motkin_middle", "motkin")):
        words = core.refused("run", drives, "--hardware", "emulated")
        assert f"interface of the drives: '{name}': needs the package fivebar_vendor_drives, {install}" in words
    words = core.refused("run", "middle", "--set", "plant.engine=mujoco")
    assert f"plant.engine: mujoco: needs the package fivebar_mujoco, {install}" in words


@pytest.mark.extra
@pytest.mark.parametrize(
    ("executables", "name", "package"),
    [
        ("fivebar_control", "motkin_bridge", "fivebar_motkin"),
        ("fivebar_sim", "emulated_board", "fivebar_motkin_emulation"),
        ("fivebar_bringup", "viewer", "fivebar_live"),
    ],
)
def test_a_node_whose_package_is_missing_is_refused_by_name(
    core: CoreAlone, executables: str, name: str, package: str
) -> None:
    done = core.python(f"from {executables}.executables import {name}; {name}()")
    assert done.returncode == BAD_INPUT
    assert done.stderr.startswith(f"{name}: needs the package {package}, which is not installed")
