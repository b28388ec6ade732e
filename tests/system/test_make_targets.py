# SPDX-License-Identifier: Apache-2.0
"""What a clone has besides: the extras, and the notebooks in JupyterLab."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sysconfig
import time
import urllib.request
import venv
from pathlib import Path
from typing import Any

import pytest
from fivebar_command import LONG

ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.extra


def test_the_extras_of_a_clone_are_installed_by_make(tmp_path: Path) -> None:
    venv.create(tmp_path / "venv", with_pip=True)
    made = subprocess.run(
        ["make", "--old-file=setup", "extras", f"VENV={tmp_path / 'venv'}"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    python = tmp_path / "venv" / "bin" / "python"
    # what .venv has already comes from there
    code = "import dask_jobqueue, distributed, cryptography; print(distributed.__file__)"
    path = {"PYTHONPATH": sysconfig.get_path("purelib")}
    found = subprocess.run([python, "-c", code], env=path, capture_output=True, text=True, check=True).stdout
    assert found.startswith(str(tmp_path))


def until_it_listens(port: int, server: subprocess.Popen[str]) -> None:
    end = time.monotonic() + LONG
    while True:
        try:
            socket.create_connection(("127.0.0.1", port), LONG).close()
            return
        except ConnectionRefusedError:
            assert server.poll() is None and time.monotonic() < end
            time.sleep(0.01)


def test_the_notebooks_open_in_jupyterlab_on_this_machine_alone(tmp_path: Path) -> None:
    # a port that is free, which the server names in its file
    options = "--no-browser --port=0 --allow-root"
    environment = {**os.environ, "JUPYTER_RUNTIME_DIR": str(tmp_path), "JUPYTER_CONFIG_DIR": str(tmp_path / "config")}
    server = subprocess.Popen(
        ["make", "notebook", f"OPTIONS={options}"], cwd=ROOT, env=environment, start_new_session=True,
        stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    try:
        assert server.stderr is not None
        for line in server.stderr:  # the server writes its file before it says how to reach it, and listens afterwards
            if "To access the server" in line:
                break
        described = json.loads(next(tmp_path.glob("jpserver-*.json")).read_text(encoding="utf-8"))
        assert described["url"].startswith("http://127.0.0.1:")
        until_it_listens(described["port"], server)

        def asked(place: str, content: Any = None) -> Any:
            url = f"{described['url']}api/{place}?token={described['token']}"
            data = None if content is None else json.dumps(content).encode()
            with urllib.request.urlopen(urllib.request.Request(url, data)) as answer:
                return json.load(answer)

        names = {one["name"] for one in asked("contents")["content"]}
        assert names >= {path.name for path in (ROOT / "docs" / "tutorials").glob("*.ipynb")}
        assert asked("kernels", {"name": "python3"})["name"] == "python3"
    finally:
        os.killpg(server.pid, signal.SIGTERM)
        server.communicate()


def test_the_locks_of_folders_beside_the_environment_do_not_name_what_that_has() -> None:
    def names(path: str) -> set[str]:
        lines = (ROOT / path).read_text(encoding="utf-8").splitlines()
        return {line.partition("==")[0].lower().replace("_", "-") for line in lines if "==" in line}

    assert not names("docs/site/notebook.lock") & names("requirements.lock")
