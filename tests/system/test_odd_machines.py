# SPDX-License-Identifier: Apache-2.0
"""Commands on machines that lack something: disk, network, home; and what many runs leave over.

What takes a mount or a network away needs root or a user's own namespaces, and is skipped where the system has none.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from fivebar_bringup.bag.reader import read_bag
from fivebar_description.interface import JOINT_STATES

FIVEBAR = Path(sys.executable).with_name("fivebar")
LONGEST = 240.0
"""Time (s) for a command that takes some ten seconds on an idle machine."""

RUNS = 20
SHORT = "{name: short, waypoints: [[0.0, 0.15], [0.0, 0.14]], segment_duration: 0.1, force: true}\n"


@cache
def can_unshare(kind: str) -> bool:
    """Return whether this system gives a process mounts or a network of its own."""
    if shutil.which("unshare") is None:
        return False
    return (
        subprocess.run(["unshare", kind, "--map-root-user", "true"], capture_output=True, check=False).returncode == 0
    )


def without(kind: str, script: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a shell script with mounts or a network of its own."""
    if not can_unshare(kind):
        pytest.skip(f"needs `unshare {kind}`, which this system does not allow")
    command = ["unshare", kind, "--map-root-user", "sh", "-c", script]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=LONGEST)


def summary_of(run: Path) -> dict[str, object]:
    found: dict[str, object] = json.loads((run / "summary.json").read_text(encoding="utf-8"))
    return found


def on_a_small_disk(command: str, folder: Path, size: str = "400k") -> subprocess.CompletedProcess[str]:
    """Run a command that writes to `disk`, which is copied to `kept` as it then is."""
    (folder / "disk").mkdir()
    script = f"mount -t tmpfs -o size={size} none disk && {command}; status=$?; cp -r disk kept; exit $status"
    return without("--mount", script, folder)


@pytest.mark.parametrize(
    ("command", "size"),
    [
        ("simulate middle --no-page --out disk/o", "400k"),
        pytest.param("simulate middle --no-page --out disk/o", "4k", marks=pytest.mark.extra),
        pytest.param(
            "camera-calibrate --simulate unified_middle --views 6 --out disk/absent/c.yaml",
            "400k",
            marks=pytest.mark.extra,
        ),
    ],
)
def test_a_full_disk_is_one_line(command: str, size: str, tmp_path: Path) -> None:
    done = on_a_small_disk(f"{FIVEBAR} {command}", tmp_path, size)
    (line,) = done.stderr.splitlines()
    assert done.returncode == 2
    assert line.startswith("fivebar: disk/")
    assert line.endswith((": No space left on device", ": No such file or directory"))


@pytest.mark.extra
def test_a_run_on_a_full_disk_is_stopped_and_its_bag_reads(tmp_path: Path) -> None:
    done = on_a_small_disk(f"{FIVEBAR} run middle --no-page --out disk/o", tmp_path)
    assert done.returncode == 1
    assert "recording_failed: No space left on device" in done.stdout.splitlines()[-1]
    run = tmp_path / "kept" / "o"
    assert summary_of(run)["outcome"] == "stopped"
    assert read_bag(run / "bag").count(JOINT_STATES) == summary_of(run)["samples"] != 0


@pytest.mark.extra
@pytest.mark.parametrize(
    ("command", "cause"),
    [
        ("run middle", "the network interface lo does not carry datagrams"),
        ("run middle_robot --hardware emulated", "no multicast route"),
    ],
)
def test_a_run_without_a_network_names_the_cause(command: str, cause: str, tmp_path: Path) -> None:
    done = without("--net", f"{FIVEBAR} {command} --domain 46 --no-page --out o", tmp_path)
    assert done.returncode == 2
    assert summary_of(tmp_path / "o")["outcome"] == "refused"
    assert cause in done.stdout.splitlines()[-1]


@pytest.mark.extra
def test_a_rehearsal_without_a_multicast_route_names_it(tmp_path: Path) -> None:
    if shutil.which("ip") is None:
        pytest.skip("needs `ip`, to set the interface lo up")
    rehearse = f"{FIVEBAR} run middle_robot --hardware emulated --domain 46 --no-page --out o"
    done = without("--net", f"ip link set lo up && {rehearse}", tmp_path)
    assert done.returncode == 2
    assert "no multicast route: `ip route add 239.0.0.0/8 dev lo`" in done.stdout.splitlines()[-1]


@pytest.mark.extra
def test_many_runs_leave_nothing_over(tmp_path: Path) -> None:
    """Without a home too: no process, file, socket or shared memory but the results."""
    (tmp_path / "short.yaml").write_text(SHORT, encoding="utf-8")
    folders = {name: tmp_path / name.lower() for name in ("TMPDIR", "XDG_RUNTIME_DIR")}
    for folder in folders.values():
        folder.mkdir(mode=0o700)
    kept = {name: value for name, value in os.environ.items() if name not in ("HOME", "ROS_LOG_DIR", "ROS_HOME")}
    shared = set(os.listdir("/dev/shm"))
    for number in range(RUNS):
        done = subprocess.run(
            [FIVEBAR, "run", "short.yaml", "--no-page", "--out", f"o{number}"],
            cwd=tmp_path,
            env={**kept, **{name: str(folder) for name, folder in folders.items()}},
            capture_output=True,
            text=True,
            check=False,
            timeout=LONGEST,
        )
        assert (done.returncode, done.stderr) == (0, "")
        here = [pid for pid in Path("/proc").glob("[0-9]*") if cwd_of(pid) == tmp_path]
        assert not here
    assert {name: os.listdir(folder) for name, folder in folders.items()} == {name: [] for name in folders}
    assert not set(os.listdir("/dev/shm")) - shared


def cwd_of(process: Path) -> Path | None:
    try:
        return (process / "cwd").readlink()
    except OSError:
        return None
