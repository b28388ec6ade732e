# SPDX-License-Identifier: Apache-2.0
"""Writes the licence into every source file that git tracks, once: python packaging/spdx.py.

With --check it writes nothing, names the files that have it not or not once, and exits with status 1 if there are some.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

TAG = "SPDX-" + "License-Identifier:"
LICENSE = f"{TAG} Apache-2.0"

COMMENTS = {".py": "#", ".sh": "#", ".js": "//"}
"""What begins a comment, by the suffix of a source file; a script without one has #."""

SHEBANG = "#!"


def main() -> int:
    """Write or check the line in all files; return the exit status."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing, name the files that lack the line")
    check = parser.parse_args().check
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    wrong = 0
    for path in (ROOT / name for name in listed.split("\0") if name and not name.startswith(".")):
        comment = _comment(path)
        if not comment:
            continue
        text = path.read_text(encoding="utf-8")
        licensed = with_license(text, comment)
        if licensed == text:
            continue
        if check:
            wrong += 1
            print(f"{path.relative_to(ROOT)}: expected once, at the top: {comment} {LICENSE}", file=sys.stderr)
        else:
            path.write_text(licensed, encoding="utf-8")
    if wrong:
        print("write it: python packaging/spdx.py", file=sys.stderr)
    return 1 if wrong else 0


def _comment(path: Path) -> str:
    """Return what begins a comment in a source file, "" for another file."""
    if not path.is_file():
        return ""
    if path.suffix:
        return COMMENTS.get(path.suffix, "")
    with path.open("rb") as file:
        return "#" if file.read(len(SHEBANG)) == SHEBANG.encode() else ""


def with_license(text: str, comment: str) -> str:
    """Return the text of a source file with the licence at its top, below the line that names its interpreter."""
    lines = [line for line in text.splitlines(keepends=True) if not line.startswith(f"{comment} {TAG}")]
    at = 1 if lines and lines[0].startswith(SHEBANG) else 0
    return "".join([*lines[:at], f"{comment} {LICENSE}\n", *lines[at:]])


if __name__ == "__main__":
    sys.exit(main())
