"""The command `fivebar posture`: what it refuses."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("inf", "1"), "Q11: inf: expected a finite number"),
        (("nan", "1"), "Q11: nan: expected a finite number"),
        (("1.2", "-inf"), "Q21: -inf: expected a finite number"),
        (("1.2", "1.9", "--rate", "nan"), "--rate: nan: expected a finite number"),
        (("1.2",), "Q11 Q21 and --after: expected one of them"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(arguments: tuple[str, ...], expected: str) -> None:
    done = CliRunner().invoke(app, ["posture", *arguments])
    assert (done.exit_code, done.stdout, done.stderr) == (2, "", f"fivebar: {expected}\n")
