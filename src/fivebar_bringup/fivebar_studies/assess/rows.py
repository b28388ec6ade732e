# SPDX-License-Identifier: Apache-2.0
"""One row of the results: a run of a motion on a drawn robot, or a motion that has none."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_studies.engine.table import RowTable

RANDOM = "random crossing"
"""Kind of the motions that are drawn; the typical ones have names."""

REFUSED, OUT_OF_REACH, UNLIKELY, ACCEPTED = "refused", "out_of_reach", "unlikely", "accepted"
"""Statuses of a motion: refused by the planner for any robot; refused by the screen even for a robot that is
exactly known, with a gyroscope; refused by screen or odds for the robot as it is declared, and run nevertheless;
judged feasible and likely."""

AS_IN_FILE = "as_in_file"
"""In place of a variant: the robot as `fivebar goto` takes its file, known exactly where it declares no errors."""


class AssessRow(NamedTuple):
    """A line of assess.csv; empty entries are None.

    Attributes:
        case: number of the motion.
        motion: what it is: `random crossing`, or the name of a typical motion.
        status: `refused`, `out_of_reach`, `unlikely` or `accepted`, known before the run.
        reason: why it was not accepted.
        variant: which error the robot does not have, which sensors it has, which bandwidth; "" for as declared,
            `as_in_file` for exactly as its file says.
        controller: of the run, "" where there is none.
        robot: number of the drawn robot, the same one for all motions and variants.
        success: of the run.
        why_not: how it falls short of a success.
        fault: name, "" for none.
        error_peak, error_final: distance of the actual platform from the reference (m).
        estimate_error: largest error of the estimated platform (m).
        mode1, mode2: working mode.
        crossing_x, crossing_y: place of the first planned crossing (m).
        distal_links: how they lie there, "stretched" or "folded".
        duration: of the motion (s).
    """

    case: int
    motion: str
    status: str
    reason: str = ""
    variant: str = ""
    controller: str = ""
    robot: int | None = None
    success: bool | None = None
    why_not: str = ""
    fault: str = ""
    error_peak: float | None = None
    error_final: float | None = None
    estimate_error: float | None = None
    mode1: int | None = None
    mode2: int | None = None
    crossing_x: float | None = None
    crossing_y: float | None = None
    distal_links: str = ""
    duration: float | None = None


ROWS = RowTable(AssessRow)
"""The table of assess.csv."""
