# SPDX-License-Identifier: Apache-2.0
"""`fivebar run` refuses processors that are none, or not there, before it starts a node."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--realtime", "--processors", "a,b"), "--processors: 'a,b': expected processor numbers with commas"),
        (("--realtime", "--processors", "-1"), "--processors: '-1': expected processor numbers with commas"),
        (("--realtime", "--processors", "0,4095"), "--processors: '0,4095': expected some of "),
        (("--processors", "0"), "--processors: expected with --realtime or --hardware"),
        (("--separate",), "--separate: expected with --realtime or --hardware"),
        (("--together",), "--together: expected with --hardware, where there is a bridge"),
        (("--realtime", "--together", "--separate"), "--together: expected without --separate"),
    ],
)
def test_it_is_refused_in_one_line(options: tuple[str, ...], expected: str, tmp_path: Path) -> None:
    out = tmp_path / "run"
    result = CliRunner().invoke(app, ["run", "middle", "--out", str(out), *options])
    assert result.exit_code == 2
    assert result.stderr.startswith(f"fivebar: {expected}")
    assert result.stderr.count("\n") == 1
    assert not out.exists()
