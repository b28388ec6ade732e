# SPDX-License-Identifier: Apache-2.0
"""Feeds random inputs to every parser of input from outside, each in a process of its own: `make fuzz`.

An input that is neither understood nor refused in one line, or that takes too long, ends the run of its parser and is
kept in `.fuzz/NAME/`. The inputs that reached something new are kept there too, and are where the next run begins.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TARGET = Path(__file__).with_name("target.py")
KEPT = ROOT / ".fuzz"
RESULTS = ROOT / "runs" / "fuzz.txt"
MEMORY = Path("/dev/shm")

sys.path.insert(0, str(ROOT / "tests" / "support"))

from parsers import PARSERS  # noqa: E402


def main() -> int:
    """Run the parsers that are named, or all; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"which parsers: {', '.join(PARSERS)}")
    parser.add_argument("--inputs", type=int, default=20_000, help="for each parser (20000)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes to use")
    given = parser.parse_args()
    if unknown := sorted(set(given.names) - set(PARSERS)):
        parser.error(f"{unknown[0]}: expected some of {', '.join(PARSERS)}")
    RESULTS.parent.mkdir(exist_ok=True)
    with ThreadPoolExecutor(given.jobs) as pool:
        good = list(pool.map(lambda name: run_one(name, given.inputs), given.names or PARSERS))
    return 0 if all(good) else 1


def run_one(name: str, inputs: int) -> bool:
    """Run a parser, print what came of it and add that to the results; return whether all inputs were run."""
    begun = time.monotonic()
    # in memory, where there is room for files: there is one for each input
    with tempfile.TemporaryDirectory(dir=MEMORY if MEMORY.is_dir() else None) as folder:
        command = [sys.executable, str(TARGET), name, str(inputs), str(KEPT / name), folder]
        done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace")
    count = re.search(r"number_of_executed_units: (\d+)", done.stderr)
    line = f"{name}: {count[1] if count else 'no'} inputs in {time.monotonic() - begun:.0f} s"
    good = done.returncode == 0 and count is not None and int(count[1]) >= inputs
    if not good:
        log = KEPT / f"{name}.log"
        log.write_text(done.stderr, encoding="utf-8")
        line += f", FAILED: see {log}, and {KEPT / name} for the input"
    print(line, flush=True)
    with RESULTS.open("a", encoding="utf-8") as results:
        results.write(f"{line}\n")
    return good


if __name__ == "__main__":
    sys.exit(main())
