# SPDX-License-Identifier: Apache-2.0
"""Looks up the locked packages in the database of known weaknesses, and says so where that cannot be reached.

Exit status: 0 none known, 1 some are, 3 nothing was looked up.
"""

from __future__ import annotations

import json
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

LOCK = Path(__file__).resolve().parents[1] / "requirements.lock"
DATABASE = "https://api.osv.dev/v1/query"
NONE_KNOWN, SOME_KNOWN, NOT_LOOKED_UP = 0, 1, 3
PATIENCE = 10.0
"""For the first answer (s); `pip-audit` itself tries again for minutes."""


def unreachable() -> str | None:
    """Return why the database gives no answer, None if it does."""
    question = json.dumps({"package": {"name": "pip", "ecosystem": "PyPI"}, "version": "1.0"}).encode()
    try:
        with urllib.request.urlopen(urllib.request.Request(DATABASE, question), timeout=PATIENCE) as answer:
            json.load(answer)
    except (OSError, ValueError, urllib.error.URLError) as error:
        return str(error)
    return None


def found_in(report: dict[str, Any]) -> list[str]:
    """Return one line for each known weakness in a report of `pip-audit`, and for each package that it skipped."""
    lines = []
    for one in report["dependencies"]:
        if "skip_reason" in one:
            lines.append(f"{one['name']}: not looked up: {one['skip_reason']}")
        for weakness in one.get("vulns", []):
            mended = ", ".join(weakness["fix_versions"]) or "none yet"
            lines.append(f"{one['name']} {one['version']}: {weakness['id']}, mended in: {mended}")
    return lines


def audit() -> int:
    """Audit the lock file, print what is known, and return the exit status."""
    why = unreachable()
    if why is not None:
        print(f"audit: NOT LOOKED UP: no answer from {DATABASE}: {why}", file=sys.stderr)
        return NOT_LOOKED_UP
    command = [
        sys.executable,
        "-m",
        "pip_audit",
        "-r",
        LOCK,
        "--no-deps",
        "--disable-pip",
        "--vulnerability-service",
        "osv",
    ]
    ended = subprocess.run(
        [*command, "--format", "json", "--progress-spinner", "off"], capture_output=True, text=True, check=False
    )
    try:
        report = json.loads(ended.stdout)
    except ValueError:
        print(f"audit: NOT LOOKED UP: pip-audit failed:\n{ended.stderr}", file=sys.stderr)
        return NOT_LOOKED_UP
    lines = found_in(report)
    print("\n".join([*lines, f"audit: {len(report['dependencies'])} packages, {len(lines)} findings"]))
    return SOME_KNOWN if lines else NONE_KNOWN


if __name__ == "__main__":
    sys.exit(audit())
