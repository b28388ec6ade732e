# SPDX-License-Identifier: Apache-2.0
"""The live page in a real browser, of a graph that stands and takes requests."""

from __future__ import annotations

import re
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from browser_pages import PATIENCE, assert_looks_like, until
from fivebar_command import InstalledCommand

from fivebar_bringup.bag.reader import read_bag
from fivebar_description.interface import FAULTS

pytestmark = pytest.mark.extra

SHORT = "name: short\ncontroller: unified\nwaypoints: [[0.0, 0.15], [0.0, 0.14]]\nsegment_duration: 0.2\n"
"""What a robot does before it stands, by default two seconds' motion."""

OpenPage = Callable[..., Any]


class Viewed:
    """A command with `--view`, by default `fivebar stand`, and the address that it has printed."""

    def __init__(self, folder: Path, name: str = "stand", *arguments: str) -> None:
        scenario = folder / "short.yaml"
        scenario.write_text(SHORT, encoding="utf-8")
        self.out = folder / name
        arguments = arguments or ("--seconds", "3600")
        self.command = InstalledCommand(
            folder / "call", name, str(scenario), *arguments, "--view", "--out", str(self.out)
        )
        end = time.monotonic() + PATIENCE
        while (found := re.search(r"view: (http\S+)", self.command.stderr)) is None:
            assert self.command.status is None and time.monotonic() < end, self.command.stderr
            time.sleep(0.05)
        self.address = found[1]


@pytest.fixture
def standing(tmp_path: Path) -> Iterator[Viewed]:
    standing = Viewed(tmp_path)
    yield standing
    standing.command.close()


def platform(page: Any) -> list[float]:
    place: list[float] = page.evaluate("live.stage.drawn[0].joints[2]")
    return place


def test_a_robot_is_asked_to_move_and_stopped(standing: Viewed, open_page: OpenPage) -> None:
    page = open_page(standing.address)
    until(page, "!!live.posture && !!live.source && Math.abs(live.posture.y - 140) < 0.5 && live.frames > 30")
    assert platform(page) == pytest.approx([0.0, 140.0], abs=0.5)

    # another run begins before the charts are painted for the first time: without samples Bokeh finds no ranges
    restarted = "live.find('charts').replaceChildren(), live.buildCharts(live.source.data), live.on_restart()"
    begun = page.evaluate(f"{restarted}, live.rows.time.at(-1)")
    until(page, f"live.source.data.time[0] > {begun}")

    # a click out of reach: refused, and nothing has moved
    page.mouse.click(*on_screen(page, -150.0, 160.0))
    until(page, "!!live.refused")
    assert page.text_content("#live-answer").startswith("Refused: ")
    assert page.is_disabled("#live-move")

    # a click beyond the locus: the plan is shown, and nothing has moved until it is wanted
    page.mouse.click(*on_screen(page, 0.0, 30.0))
    until(page, "!!live.plan")
    assert "Nothing has moved yet." in page.text_content("#live-answer")
    assert platform(page) == pytest.approx([0.0, 140.0], abs=0.5)
    assert_looks_like(page, ".player", "live", "#live-stage")
    page.click("#live-move")
    until(page, "document.getElementById('live-answer').textContent === 'Arrived.'")
    until(page, "Math.abs(live.posture.y - 30) < 2 && live.posture.mode === -1")

    page.keyboard.press("s")
    until(page, "document.querySelectorAll('#live-faults .box').length === 1")
    assert "Someone pressed emergency stop." in page.text_content("#live-faults")
    # the answer of the stop may come after the fault that it made
    until(page, "document.getElementById('live-notice').textContent.includes('/emergency_stop: ')")
    reset(page)
    until(page, "document.querySelectorAll('#live-faults .box').length === 0")

    standing.command.send(signal.SIGINT)
    until(page, "live.ended")
    assert standing.command.finish() == 1
    standing.command.expect_no_process(PATIENCE)
    assert any(text.startswith("emergency_stop") for text in read_bag(standing.out / "bag").texts(FAULTS))


def test_a_good_run_ends_as_finished_with_its_report(tmp_path: Path, open_page: OpenPage) -> None:
    run = Viewed(tmp_path, "run", "--page")
    try:
        page = open_page(run.address)
        until(page, "live.ended")
        assert page.text_content("#live-status").startswith("finished: succeeded, at most 0.")
        assert page.locator("#live-faults .box").count() == 0
        assert "stale" not in page.text_content("#live-nodes")
        assert run.command.finish() == 0
        run.command.expect_no_process(PATIENCE)
        # the server has ended, the report is there all the same, with scripts that run
        assert page.text_content("#live-place") == str(run.out / "report.html")
        with page.context.expect_page() as opened:
            page.click("#live-report")
        report = opened.value
        until(report, "!!window.replay")
        assert report.text_content(".verdict").startswith("The run succeeded: all 101 samples")
    finally:
        run.command.close()


def reset(page: Any) -> None:
    """Press R until the graph accepts it: before the first sample after the stop it says why it does not."""
    end = time.monotonic() + PATIENCE
    while True:
        page.evaluate("document.getElementById('live-notice').textContent = ''")
        page.keyboard.press("r")
        until(page, "document.getElementById('live-notice').textContent.includes('/reset: ')")
        notice = page.text_content("#live-notice")
        if "blender/reset: cleared emergency_stop" in notice:
            return
        assert "not cleared, no sample has been complete" in notice and time.monotonic() < end, notice


def on_screen(page: Any, x: float, y: float) -> tuple[float, float]:
    """Return where a point of the plane (mm) is in the window."""
    box = page.locator("#live-stage").bounding_box()
    column, row = page.evaluate("point => live.stage.toPixel(point)", [x, y])
    return box["x"] + column, box["y"] + row
