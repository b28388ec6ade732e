# SPDX-License-Identifier: Apache-2.0
"""Progress without a terminal: a line now and then, with the stage, what is done and for how long."""

from __future__ import annotations

import re
import threading
import time

import pytest

from fivebar_bringup.cli import progress
from fivebar_bringup.cli.progress import TimeLeft, progress_bar
from fivebar_description.stages import stage, stages_told


def wait_for(capsys: pytest.CaptureFixture[str], expected: str) -> None:
    """Wait until a line has been printed on standard error."""
    end, seen = time.monotonic() + 60.0, ""
    while not re.search(expected, seen):
        assert time.monotonic() < end, seen
        seen += capsys.readouterr().err


def test_a_line_now_and_then_tells_what_is_done(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(progress.SWITCH)
    monkeypatch.setattr(progress, "FIRST_LINE", 0.01)
    monkeypatch.setattr(progress, "NEXT_LINES", 0.01)
    with progress_bar("sweep") as update:
        wait_for(capsys, r"^sweep: 0 s\n")
        # a run whose nodes are starting
        update(0, 0)
        capsys.readouterr()
        wait_for(capsys, r"^sweep: \d+ s\n")
        update(3, 7)
        wait_for(capsys, r"sweep: 3 of 7, \d+ s\n")
        with stage("compiling"):
            wait_for(capsys, r"sweep: compiling, 3 of 7, \d+ s\n")
    capsys.readouterr()
    with progress_bar("sweep", quiet=True) as update:
        update(1, 7)
    assert capsys.readouterr() == ("", "")


def test_what_ends_soon_prints_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with progress_bar("sweep") as update:
        update(7, 7)
    assert capsys.readouterr() == ("", "")


def test_a_stage_within_another_ends_with_the_words_of_that() -> None:
    told: list[str] = []
    with stages_told(told.append), stage("outer"), stage("inner"):
        pass
    with stage("unheard"):
        pass
    assert told == ["outer", "inner", "outer", ""]


def test_the_time_left_follows_from_how_fast_it_went_on() -> None:
    now = [100.0]
    left = TimeLeft(lambda: now[0])
    left.report(0, 0)
    assert left.words == ""
    # what an interrupted study has already says nothing about the speed
    left.report(40, 100)
    now[0] = 110.0
    assert left.words == ""
    left.report(50, 100)
    assert left.words == "about 50 s left"
    now[0] = 140.0
    left.report(60, 100)
    assert left.words == "about 80 s left"
    # and the time since the last report is part of it
    now[0] = 160.0
    assert left.words == "about 60 s left"
    left.report(61, 1000)
    assert left.words == "about 45 min left"
    left.report(1000, 1000)
    assert left.words == ""


def test_what_waits_for_its_user_prints_lines_only_until_it_has_begun(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(progress.SWITCH)
    monkeypatch.setattr(progress, "FIRST_LINE", 0.01)
    monkeypatch.setattr(progress, "NEXT_LINES", 0.01)
    with progress_bar("stand", until_begun=True) as update:
        wait_for(capsys, r"^stand: 0 s\n")
        update(1, 0)
        teller = next(thread for thread in threading.enumerate() if thread.name == "progress")
        teller.join(60.0)
        assert not teller.is_alive()
