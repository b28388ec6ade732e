# SPDX-License-Identifier: Apache-2.0
"""Modules of the user in the working directory do not take the place of installed ones."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from fivebar_description.modules import RUN_MODULE, module_command

MODULE = "fivebar_description.forbidden"


@pytest.mark.parametrize("command", [module_command(MODULE), [sys.executable, "-c", RUN_MODULE.format(MODULE)]])
def test_a_module_of_the_working_directory_is_not_imported(command: list[str], tmp_path: Path) -> None:
    for name in ("numpy", "json", "typing", "random"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('imported the wrong module')\n", encoding="utf-8")
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, check=False, timeout=60)
    assert (done.returncode, done.stderr) == (0, b"")
