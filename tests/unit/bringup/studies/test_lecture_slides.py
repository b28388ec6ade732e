"""The slides of the lecture: six pictures, and what the laws in them make of the crossing."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_bringup.recorded.outcome import RunOutcome
from fivebar_bringup.studies.lecture_slides import SLIDES, draw_slides, run_with


@pytest.mark.extra
def test_computed_torque_gets_lost_and_unified_gets_across() -> None:
    assert run_with("ctc").summary.outcome == RunOutcome.STOPPED
    assert run_with("unified").summary.outcome == RunOutcome.SUCCEEDED


def test_a_folder_that_cannot_be_made_is_refused_in_one_line(tmp_path: Path) -> None:
    out = tmp_path / "slides"
    out.write_text("a file")
    called = CliRunner().invoke(app, ["lecture", "--out", str(out)])
    assert called.exit_code == 2
    assert called.stderr == f"fivebar: {out}: cannot be used for the results: File exists\n"


@pytest.mark.extra
def test_six_slides_are_drawn(tmp_path: Path) -> None:
    reported: list[int] = []
    paths = draw_slides(tmp_path / "slides", lambda done, total: reported.append(done))
    assert [path.stem for path in paths] == [*SLIDES] == sorted(SLIDES)
    assert reported == [1, 2, 3, 4, 5, 6]
    for path in paths:
        assert ElementTree.parse(path).getroot().tag == "{http://www.w3.org/2000/svg}svg"
