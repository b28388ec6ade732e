# SPDX-License-Identifier: Apache-2.0
"""One row of the results: a controller's run of a case, or a case that the planner refused."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from fivebar_control.trajectory.time_laws import QUINTIC
from fivebar_studies.engine.table import RowTable
from fivebar_studies.sweep.drawing import Draw

REFUSED, SCREENED_OUT, FEASIBLE = "refused", "screened_out", "feasible"
"""Statuses of a case: refused by the planner, for all controllers; refused by the controller's screen, and run
nevertheless; judged feasible."""

STATUSES = (REFUSED, SCREENED_OUT, FEASIBLE)


SUCCESS_PROBABILITY = "success probability"
"""As the reason for a crossing to be screened out begins whose odds are too low."""

FAULT_DELAY = 0.05
"""A failure is silent if no fault comes within this time (s) of leaving 5 mm."""


class SweepRow(NamedTuple):
    """A line of sweep.csv; empty entries are None.

    Attributes:
        case: number.
        controller: "" where the planner refused the motion for all of them.
        status: `REFUSED`, `SCREENED_OUT` or `FEASIBLE`, known before the run.
        reason: why it was refused or screened out.
        success: of the run, by the rule of `success`.
        why_not: how it falls short of a success.
        mode1 ... way: as in `Draw`, lengths in m.
        crossings: planned changes of assembly mode.
        authority: least |n.v1| at the planned crossings.
        crossing_x, crossing_y: of the first one (m).
        reference_torque, dwell, rest_kappa: the screen's metrics: torque of the reference (Nm), longest time near the
            locus (s), least 1/cond(A) at rest.
        limit, limit_use: the screen's metric that is nearest to its limit, or furthest beyond, and how much of the
            limit it uses; more than 1 is beyond.
        fault, fault_time: name, and when (s); "" for none.
        mode_changes: of the assembly mode.
        error_peak, error_final: distance of the actual platform from the reference (m).
        path_error: largest distance of the actual platform from the path, whatever the time (m).
        requested, applied: larger of both motors' peaks (Nm).
        saturated: samples, of `samples`, that requested more than the limit.
        left_time: when the robot was first more than 5 mm from its reference (s).
        estimate_error: largest error of the estimated platform (m).
        type1_distance: least distance from Type 1 (m).
        work: spent by the motors (J).
        distal_links: how they lie at the planned crossings, "stretched", "folded" or "stretched and folded".
        likely_robots, drawn_robots: how many of the robots drawn within the rig's errors make the motion by the counted
            controller, of how many; None where none were drawn.
    """

    case: int
    controller: str
    status: str
    reason: str
    success: bool | None
    why_not: str
    mode1: int
    mode2: int
    start_x: float
    start_y: float
    end_x: float
    end_y: float
    duration: float
    mass_scale: float
    inertia_scale: float
    friction_scale: float
    encoder_counts: int | None
    delay_samples: int
    rig: str = ""
    seed: int = 1
    drawn_duration: float | None = None
    time_law: str = QUINTIC
    robot: str = ""
    way: str = ""
    crossings: int | None = None
    authority: float | None = None
    crossing_x: float | None = None
    crossing_y: float | None = None
    reference_torque: float | None = None
    dwell: float | None = None
    rest_kappa: float | None = None
    limit: str = ""
    limit_use: float | None = None
    fault: str = ""
    fault_time: float | None = None
    mode_changes: int | None = None
    error_peak: float | None = None
    error_final: float | None = None
    requested: float | None = None
    applied: float | None = None
    saturated: int | None = None
    samples: int | None = None
    left_time: float | None = None
    estimate_error: float | None = None
    type1_distance: float | None = None
    work: float | None = None
    distal_links: str = ""
    likely_robots: int | None = None
    drawn_robots: int | None = None
    path_error: float | None = None

    @property
    def silent(self) -> bool:
        """Whether the run was lost without a fault in time: more than 5 mm off, or in another mode than planned."""
        return lost_silently(self.left_time, self.fault_time, self.mode_changes == self.crossings)

    def within(self, limit: float) -> bool:
        """Return whether it stayed closer to its reference than a limit (m), without a fault, in the planned mode."""
        near = self.error_peak is not None and self.error_peak < limit
        return near and not self.fault and self.mode_changes == self.crossings

    @property
    def odds(self) -> float | None:
        """Share of the drawn robots that make it, None where none were drawn."""
        return self.likely_robots / self.drawn_robots if self.likely_robots is not None and self.drawn_robots else None

    @property
    def too_unlikely(self) -> bool:
        """Whether nothing but its odds has screened it out."""
        return self.status == SCREENED_OUT and self.reason.startswith(SUCCESS_PROBABILITY)

    @property
    def draw(self) -> Draw:
        """The case."""
        return Draw(self.case, *(getattr(self, name) for name in Draw._fields[1:]))


def lost_silently(left_time: float | None, fault_time: float | None, as_planned: bool) -> bool:
    """Return whether a run was lost without a fault in time.

    Args:
        left_time: when the robot was first more than 5 mm from its reference (s), None for never.
        fault_time: when it was stopped (s), None for never.
        as_planned: whether it ended in the planned assembly mode.
    """
    if left_time is not None:
        return fault_time is None or fault_time > left_time + FAULT_DELAY
    return fault_time is None and not as_planned


def controllers_of(rows: Iterable[SweepRow]) -> tuple[str, ...]:
    """Return the controllers that made crossings, in the order of their rows."""
    return tuple(dict.fromkeys(row.controller for row in rows if row.controller))


def _check(row: SweepRow) -> None:
    # a row with another status would count nowhere
    if row.status not in STATUSES:
        raise ValueError(f"status: {row.status!r}: expected one of {', '.join(STATUSES)}")


ROWS = RowTable(SweepRow, _check)
"""The table of sweep.csv."""
