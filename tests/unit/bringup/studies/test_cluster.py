# SPDX-License-Identifier: Apache-2.0
"""Studies on a Dask cluster: the rows of a local one, whoever dies, a law from elsewhere, and the recipe for SLURM."""

from __future__ import annotations

import importlib
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_description.strict_yaml import InputError
from fivebar_studies.assess.assess import ASSESSMENT
from fivebar_studies.benchmark.study import BENCHMARK
from fivebar_studies.compare.compare import COMPARISON
from fivebar_studies.engine.running import run_study
from fivebar_studies.engine.study import Study, StudySettings
from fivebar_studies.robustness.robustness import ROBUSTNESS
from fivebar_studies.sweep.sweep import SWEEP

pytestmark = pytest.mark.extra

ROOT = Path(__file__).parents[4]
SUPPORT = ROOT / "tests" / "support"
TOY = "toy_law:LAW"
PATIENCE = 60.0


@contextmanager
def program(*words: str) -> Iterator[subprocess.Popen[str]]:
    """One of Dask's programs, killed at the end."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(SUPPORT), os.environ.get("PYTHONPATH", "")])}
    command = [sys.executable, "-m", *words]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment) as process:
        try:
            yield process
        finally:
            process.kill()


def line_with(process: subprocess.Popen[str], pattern: str) -> str:
    """The part of a line on standard error that a pattern names; the test's own timeout bounds the wait."""
    assert process.stderr is not None
    for line in process.stderr:
        found = re.search(pattern, line)
        if found:
            return found[1]
    raise AssertionError(f"{pattern}: the program has ended")


@pytest.fixture
def cluster() -> Iterator[tuple[str, list[subprocess.Popen[str]]]]:
    """The address of a scheduler on loopback, and its two workers."""
    with ExitStack() as stack:
        host = ("--host", "127.0.0.1", "--no-dashboard")
        scheduler = stack.enter_context(program("distributed.cli.dask_scheduler", *host, "--port", "0"))
        address = line_with(scheduler, r"Scheduler at: +(tcp://127\.0\.0\.1:\d+)")
        words = ("distributed.cli.dask_worker", address, *host, "--nthreads", "1", "--no-nanny")
        yield address, [stack.enter_context(program(*words)) for _ in range(2)]


STUDIES: list[tuple[Study[Any, Any], dict[str, Any]]] = [
    (SWEEP, {"seed": 3, "cases": 12, "controllers": ("unified", TOY)}),
    (COMPARISON, {"scenarios": ("middle",), "controllers": (TOY,), "durations": (0.8, 1.0), "rigs": ("ideal",)}),
    (BENCHMARK, {"controllers": (TOY,), "cases": 8}),
    (ROBUSTNESS, {"effects": ("mass",), "controllers": (TOY,), "draws": 10, "durations": (0.5, 1.0)}),
    (
        ROBUSTNESS,
        {"rig": "good", "seed": 3, "cases": 3, "controllers": ("unified", TOY), "robots": 2, "faulty": 1},
    ),
    (ASSESSMENT, {"robot": str(ROOT / "tests" / "data" / "belt.yaml"), "controllers": (TOY,), "cases": 2, "robots": 2}),
]
"""Every study that takes laws, with settings of a few chunks."""


def test_no_study_that_takes_laws_is_left_out() -> None:
    source = ROOT / "src" / "fivebar_bringup"
    for path in source.rglob("fivebar_studies/**/*.py"):
        if "= Study(" in path.read_text(encoding="utf-8"):
            importlib.import_module(".".join(path.relative_to(source).with_suffix("").parts))
    taking = {one for one in StudySettings.__subclasses__() if "controllers" in one.model_fields}
    assert taking == {study.settings for study, _ in STUDIES}


@pytest.mark.timeout(1800)  # the compilation alone takes minutes on a busy machine
@pytest.mark.parametrize(("study", "given"), STUDIES, ids=[study.name for study, _ in STUDIES])
def test_a_toy_law_has_its_local_rows_on_a_cluster_that_loses_a_worker(
    cluster: tuple[str, list[subprocess.Popen[str]]], tmp_path: Path, study: Study[Any, Any], given: dict[str, Any]
) -> None:
    from fivebar_studies.engine.cluster import cluster_of

    address, workers = cluster
    told: list[str] = []
    done: list[int] = []

    def kill_after_a_chunk(there: int, wanted: int) -> None:
        done.append(there)
        if len(done) == 2:
            workers[0].send_signal(signal.SIGKILL)

    with cluster_of(address, None, told.append) as executor:
        shared = run_study(study, given, tmp_path / "shared", executor, kill_after_a_chunk)
    assert workers[0].wait(PATIENCE) == -signal.SIGKILL and workers[1].poll() is None
    assert len(done) > 2 and not told
    local = run_study(study, given, tmp_path / "local")
    name = f"{study.name}.csv"
    assert (tmp_path / "shared" / name).read_bytes() == (tmp_path / "local" / name).read_bytes()
    assert shared.content == local.content
    assert TOY in (tmp_path / "local" / name).read_text(encoding="utf-8")


def test_a_law_that_a_worker_cannot_import_is_refused_in_one_line(
    cluster: tuple[str, list[subprocess.Popen[str]]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "own_law.py").write_text("from toy_law import LAW\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    words = [
        "sweep",
        "--quick",
        "--controllers",
        "own_law:LAW",
        "--scheduler",
        cluster[0],
        "--out",
        str(tmp_path / "x"),
    ]
    called = CliRunner().invoke(app, words)
    assert called.exit_code == 2
    assert "own_law:LAW" in called.stderr and "No module named 'own_law'" in called.stderr


def test_what_is_no_scheduler_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from fivebar_studies.engine import cluster as clusters

    monkeypatch.setattr(clusters, "CONNECT", 0.5)
    for place in ("tcp://127.0.0.1:9", "nowhere"):
        with pytest.raises(InputError, match="no Dask scheduler answers"), clusters.cluster_of(place, None, print):
            pass
    with (
        pytest.raises(InputError, match="is no file"),
        clusters.cluster_of(None, tmp_path / "scheduler.json", print),
    ):
        pass


def test_the_recipe_for_slurm_makes_a_job_that_starts_workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs" / "cluster.md").read_text(encoding="utf-8")
    (recipe,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    made: dict[str, object] = {}
    exec(recipe.partition("cluster.adapt")[0], made)
    script = made["cluster"].job_script()  # type: ignore[attr-defined]
    made["cluster"].close()  # type: ignore[attr-defined]
    assert script.startswith("#!/usr/bin/env bash\n")
    assert {"#SBATCH -p short", "#SBATCH --mem=15G", "#SBATCH -t 02:00:00"} <= set(script.splitlines())
    assert "\nexport NUMBA_CACHE_DIR=" in script and "\nexport OPENBLAS_NUM_THREADS=1\n" in script
    (command,) = (line for line in script.splitlines() if "dask_worker" in line or "dask worker" in line)
    assert (
        "tls://" in command
        and "--nthreads 1 " in command
        and "--nworkers 8 " in command
        and "--lifetime 110m " in command
    )
