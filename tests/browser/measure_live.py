# SPDX-License-Identifier: Apache-2.0
"""Frames per second of the live page in Chromium, and the control cycle with and without it, side by side.

By hand: `PYTHONPATH=.browser .venv/bin/python tests/browser/measure_live.py [PAIRS]`.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from playwright.sync_api import sync_playwright

FIVEBAR = Path(sys.executable).with_name("fivebar")
SEGMENTS = 10
SCENARIO = {
    "name": "watched",
    "controller": "unified",
    "waypoints": [[0.0, 0.15 if number % 2 == 0 else 0.02] for number in range(SEGMENTS + 1)],
    "rate_hz": 500,
}
"""Ten seconds at 500 Hz."""


def run(folder: Path, name: str, *options: str) -> tuple[subprocess.Popen[str], Path]:
    """Start a run in real time; return its process and the file of what it says on standard error."""
    scenario, said = folder / "watched.yaml", folder / f"{name}.err"
    scenario.write_text(json.dumps(SCENARIO), encoding="utf-8")
    command = [str(FIVEBAR), "run", str(scenario), "--realtime", "--no-page", "--json", "--out", str(folder / name)]
    with said.open("w") as err:
        return subprocess.Popen([*command, *options], stdout=subprocess.PIPE, stderr=err, text=True), said


def figures(process: subprocess.Popen[str]) -> dict[str, Any]:
    """Return what a run's summary says of its cycle."""
    text, _ = process.communicate()
    summary = json.loads(text)
    return {
        "outcome": summary["outcome"],
        "p99_ms": round(summary["latency_ms"]["p99"], 2),
        "max_ms": round(summary["latency_ms"]["max"], 2),
        "late": summary["overruns"],
    }


def watched(browser: Any, folder: Path, name: str) -> dict[str, Any]:
    """Run with the page open and count its frames while the robot moves."""
    process, said = run(folder, name, "--view")
    while (address := re.search(r"http://\S+", said.read_text())) is None:
        time.sleep(0.1)
    page = browser.new_page(viewport={"width": 1100, "height": 1150})
    page.goto(address[0])
    while page.evaluate("live.frames") < 30:
        time.sleep(0.1)
    begun, first = time.monotonic(), page.evaluate("live.frames")
    time.sleep(0.7 * SEGMENTS)
    rate = (page.evaluate("live.frames") - first) / (time.monotonic() - begun)
    found = figures(process)
    page.close()
    return {"frames_per_s": round(rate, 1), **found}


def main() -> None:
    """Print the figures of pairs of runs."""
    pairs = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    chromium = shutil.which("chromium")
    assert chromium is not None, "apt install chromium"
    arguments = ["--disable-gpu", "--no-sandbox"]
    with tempfile.TemporaryDirectory() as name, sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=chromium, args=arguments)
        for number in range(pairs):
            alone, _ = run(Path(name), f"alone{number}")
            print("without", figures(alone), flush=True)
            print("with   ", watched(browser, Path(name), f"watched{number}"), flush=True)
        browser.close()


if __name__ == "__main__":
    main()
