# SPDX-License-Identifier: Apache-2.0
"""What the command prints: literal, printable, on any encoding, with one line where it cannot be written."""

from __future__ import annotations

import io
import json
import os
import re
import resource
import subprocess
import sys
from pathlib import Path

import pytest
from rich.table import Table
from rich.text import Text

from fivebar_bringup.cli.printing import IN_ASCII, PLAIN, Printer, accept_any_character

CLI = Path(__file__).parents[4] / "src" / "fivebar_bringup" / "fivebar_bringup" / "cli"
FIVEBAR = Path(sys.executable).with_name("fivebar")
HOSTILE = "x[/1] [red]y[/red] :cat: \x1b[31mz"


def test_words_of_the_user_are_literal(monkeypatch: pytest.MonkeyPatch) -> None:
    out = io.StringIO()
    monkeypatch.setattr(sys, "stdout", out)
    table = Table("a", box=None)
    table.add_row(HOSTILE)
    printer = Printer(soft_wrap=True)
    printer.print(HOSTILE)
    printer.print(Text("look at ", "red").append(HOSTILE))
    printer.print(table)
    shown = out.getvalue()
    assert shown.count(HOSTILE.replace("\x1b", "\\x1b")) == 3
    assert "\x1b" not in shown


def test_only_the_printer_makes_consoles() -> None:
    """Any other console would take brackets for markup."""
    makers = [path.name for path in CLI.glob("*.py") if re.search(r"\bConsole\b", path.read_text(encoding="utf-8"))]
    assert makers == ["printing.py"]


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_any_text_is_written_in_any_encoding(encoding: str, monkeypatch: pytest.MonkeyPatch) -> None:
    written = io.BytesIO()
    out = io.TextIOWrapper(written, encoding=encoding)
    monkeypatch.setattr(sys, "stdout", out)
    accept_any_character()
    assert out.errors == PLAIN
    print("1 ± 2 σ → 3 \u4e00 \udcff" + "".join(IN_ASCII))
    out.flush()
    assert b"2 sigma -> 3 \\u4e00 \\udcff" in written.getvalue()


def fivebar(*arguments: str, **environment: str) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(
        [FIVEBAR, *arguments], env={**os.environ, **environment}, capture_output=True, check=False, timeout=120
    )


@pytest.mark.extra
def test_a_notebook_s_backend_and_an_ascii_terminal_change_nothing(tmp_path: Path) -> None:
    """The page is drawn all the same, into a directory whose name looks like markup."""
    out = tmp_path / "x[/1]"
    backend = "module://matplotlib_inline.backend_inline"
    done = fivebar("simulate", "middle", "--out", str(out), MPLBACKEND=backend, PYTHONIOENCODING="ascii")
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.splitlines()[-1].endswith(f"look at {out / 'report.html'}".encode())
    assert (out / "report.html").stat().st_size > 100_000


@pytest.mark.parametrize(
    "arguments",
    [
        # a simulation has it in tests/system
        pytest.param(("guide", "calibration", "--out", "{}/led"), marks=pytest.mark.extra),
        ("camera-calibrate", "--board", "{}/board.png"),
    ],
)
def test_a_full_disk_is_one_line(arguments: tuple[str, ...], tmp_path: Path) -> None:
    """A limit on the size of files ends writing as a full disk does."""
    limit = 5000
    done = subprocess.run(
        [FIVEBAR, *(one.format(tmp_path) for one in arguments)],
        # some releases of CPython keep byte code that they could write in part only
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
        capture_output=True,
        check=False,
        timeout=120,
    )
    (line,) = done.stderr.decode().splitlines()
    assert (done.returncode, line[:9]) == (2, "fivebar: ")
    assert line.startswith(f"fivebar: {tmp_path}/")
    assert line.endswith(": File too large")


@pytest.mark.parametrize(
    "closed", [*(pytest.param(one, marks=pytest.mark.extra) for one in (">&-", "2>&-")), "<&- >&- 2>&-"]
)
def test_a_closed_stream_is_no_error_of_the_command(closed: str, tmp_path: Path) -> None:
    """What is written there goes nowhere, and not into the next file that is opened."""
    line = f"{FIVEBAR} simulate middle --no-page --out {tmp_path}/run {closed}"
    done = subprocess.run(["sh", "-c", line], capture_output=True, text=True, check=False, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads((tmp_path / "run" / "summary.json").read_text(encoding="utf-8"))["outcome"] == "succeeded"


@pytest.mark.extra
def test_a_process_without_memory_ends_with_its_line(tmp_path: Path) -> None:
    """And not in a segmentation fault of a library at the exit."""
    limit = 300_000_000
    done = subprocess.run(
        [FIVEBAR, "simulate", "middle", "--no-page", "--out", str(tmp_path / "run")],
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)),
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert done.returncode == 2
    assert done.stderr.startswith("fivebar: the system gives this process no more memory, threads or files: ")
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.extra
def test_an_output_that_is_full_is_one_line() -> None:
    with open("/dev/full", "wb") as full:
        done = subprocess.run(
            [FIVEBAR, "posture", "1.2", "1.9"], stdout=full, stderr=subprocess.PIPE, check=False, timeout=120
        )
    assert done.returncode == 2
    assert done.stderr == b"fivebar: a file or the output cannot be written: No space left on device\n"
