# SPDX-License-Identifier: Apache-2.0
"""A run with its live page: how it ends is told to whoever looks, with the report."""

from __future__ import annotations

import re
from pathlib import Path

from fivebar_command import FivebarCommand
from graph_probe import Bench
from live_client import Page

SHORT = "name: short\ncontroller: unified\nwaypoints: [[0.0, 0.15], [0.0, 0.14]]\nsegment_duration: 0.2\n"


def test_the_page_of_a_good_run_says_finished_and_has_the_report(tmp_path: Path) -> None:
    (tmp_path / "short.yaml").write_text(SHORT, encoding="utf-8")
    with Bench(tmp_path) as bench:
        probe = bench.probe()
        arguments = ("run", "short.yaml", "--view", "--page", "--out", "out", "--domain", str(bench.domain))
        call = FivebarCommand(tmp_path, *arguments, domain=bench.domain)
        try:
            page = Page(probe.wait_for(lambda: re.search(r"view: (http\S+)", call.stderr), "the address")[1])
            try:
                end = page.next_of("ended", probe)
            finally:
                page.close()
            assert (call.finish(), end["outcome"]) == (0, "succeeded"), end["text"]
            assert re.fullmatch(
                r"finished: succeeded, at most 0\.\d\d mm from the reference, tolerance 2 mm", end["text"]
            )
            assert end["report"] == str(tmp_path / "out" / "report.html")
            assert end["html"] == (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
            call.expect_no_process(0.0)
        finally:
            call.close()
