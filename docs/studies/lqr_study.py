# SPDX-License-Identifier: Apache-2.0
"""The published peer beside `unified` and `mpc`, with and without the dynamic criterion: the tables of docs/laws.md.

`python docs/studies/lqr_study.py [criterion | quintic]` prints the table for a time law.
"""

from __future__ import annotations

import argparse

from fivebar_bringup.report.thesis import MIDDLE, MULTIPLE
from fivebar_bringup.scenario import Scenario
from fivebar_control.trajectory.time_laws import CRITERION, QUINTIC
from fivebar_description.rounding import in_millimetres
from mpc_study import run_once

LAWS = ("unified", "mpc", "lqr")
DURATIONS = (0.5, 1.0, 2.0)
MOTIONS = {"middle": MIDDLE, "first two segments of multiple": MULTIPLE[:3]}


def cell(controller: str, time_law: str, motion: str, duration: float) -> str:
    """Return largest distance from the reference and largest torque of a run on the robot as believed."""
    fields = {
        "name": "study",
        "controller": controller,
        "time_law": time_law,
        "waypoints": MOTIONS[motion],
        "segment_duration": duration,
    }
    outcome = run_once(Scenario.model_validate(fields))
    return f"{in_millimetres(outcome.error_peak, 3)}, {max(outcome.requested1, outcome.requested2):.2f} Nm"


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("time_law", nargs="?", default=CRITERION, choices=(CRITERION, QUINTIC))
    time_law = parser.parse_args().time_law
    print(f"| `{time_law}` | " + " | ".join(f"`{law}`" for law in LAWS) + " |")
    print("|---|" + "---|" * len(LAWS))
    for motion in MOTIONS:
        for duration in DURATIONS:
            cells = " | ".join(cell(law, time_law, motion, duration) for law in LAWS)
            print(f"| {motion}, {duration:g} s | {cells} |", flush=True)


if __name__ == "__main__":
    main()
