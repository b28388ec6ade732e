# SPDX-License-Identifier: Apache-2.0
"""The archive of a reproduction holds what it lists, and the same twice."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[2]
CONTENT = {
    "quick": False,
    "rows": [{"place": "Figure 1", "numbers": {"error_m": 1e-4, "kappa": [0.1, 0.2]}, "verdict": "agreed"}],
    "tables": [{"name": "delays", "title": "t", "rows": [{"law": "unified", "mm": 0.1}, {"law": "ctc", "mm": None}]}],
    "runs": [{"case": {"controller": "ctc"}, "summary": None, "refused": "too slow"}],
}


def packed(directory: Path, archive: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(ROOT / "packaging" / "archive.py"), str(directory), str(archive)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_an_archive_holds_what_it_lists(tmp_path: Path) -> None:
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "one.png").write_bytes(b"png")
    (tmp_path / "reproduce.html").write_text("<p>page</p>", encoding="utf-8")
    (tmp_path / "reproduce.json").write_text(json.dumps(CONTENT), encoding="utf-8")
    for name in ("a", "b"):
        assert packed(tmp_path, tmp_path / name / "x.zip").returncode == 1
        (tmp_path / name).mkdir()
        assert packed(tmp_path, tmp_path / name / "x.zip").returncode == 0
    first = tmp_path / "a" / "x.zip"
    assert first.read_bytes() == (tmp_path / "b" / "x.zip").read_bytes()
    with zipfile.ZipFile(first) as archive:
        files = {name.removeprefix("x/"): archive.read(name) for name in archive.namelist()}
    sums = dict(reversed(line.split("  ")) for line in files.pop("SHA256SUMS").decode().splitlines())
    assert sums == {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}
    assert {"figures/one.png", "table-delays.csv", "requirements.lock", "crossings.csv"} <= files.keys()
    (claim,) = csv.DictReader(io.StringIO(files["claims.csv"].decode()))
    assert claim["numbers.kappa"] == "[0.1, 0.2]"
    deposit = json.loads(files[".zenodo.json"])
    assert deposit["upload_type"] == "dataset"
    assert deposit["creators"]
    assert "numpy" in json.loads(files["environment.json"])["distributions"]


def test_a_quick_reproduction_is_not_archived(tmp_path: Path) -> None:
    (tmp_path / "reproduce.html").write_text("", encoding="utf-8")
    (tmp_path / "reproduce.json").write_text(json.dumps({**CONTENT, "quick": True}), encoding="utf-8")
    ended = packed(tmp_path, tmp_path / "x.zip")
    assert (ended.returncode, "--quick" in ended.stderr, ended.stderr.count("\n")) == (1, True, 1)
