# SPDX-License-Identifier: Apache-2.0
"""The slides of the lecture: six pictures, and what the laws in them make of the crossing."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from fivebar_bringup.recorded.outcome import RunOutcome
from lecture_slides import SLIDES, draw_slides, run_with


@pytest.mark.extra
def test_computed_torque_gets_lost_and_unified_gets_across() -> None:
    assert run_with("ctc").summary.outcome == RunOutcome.STOPPED
    assert run_with("unified").summary.outcome == RunOutcome.SUCCEEDED


@pytest.mark.extra
def test_six_slides_are_drawn(tmp_path: Path) -> None:
    paths = draw_slides(tmp_path / "slides")
    assert [path.stem for path in paths] == [*SLIDES] == sorted(SLIDES)
    for path in paths:
        assert ElementTree.parse(path).getroot().tag == "{http://www.w3.org/2000/svg}svg"
