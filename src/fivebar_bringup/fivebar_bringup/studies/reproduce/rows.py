"""A row of the page: one figure or claim of the thesis, what was measured, and the verdict."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from fivebar_bringup.pages.content import Picture
from fivebar_bringup.studies.reproduce.cases import ReproductionCase, ReproductionExtent
from fivebar_bringup.studies.reproduce.runner import Drawings, ReproductionResult, Results
from fivebar_bringup.studies.reproduce.verdicts import Judgement, finite_torque
from fivebar_bringup.units import plain


class ClaimRow(NamedTuple):
    """One comparison.

    Attributes:
        place: figure, equation or section of the thesis.
        title: what it is about.
        thesis: what the thesis reports, and where.
        measured: what was found here.
        numbers: the values behind it.
        judgement: verdict, rule and reason.
        remark: context for the reader.
        pictures: figures of this reproduction.
    """

    place: str
    title: str
    thesis: str
    measured: str
    numbers: Mapping[str, Any]
    judgement: Judgement
    remark: str = ""
    pictures: Sequence[Picture] = ()

    @property
    def anchor(self) -> str:
        """The target of a link on the page."""
        name = f"{self.place} {self.title}".lower()
        return "-".join("".join(letter if letter.isalnum() else " " for letter in name).split())

    def as_json(self) -> dict[str, Any]:
        """Return the row as plain values; pictures by name."""
        return {
            "place": self.place,
            "title": self.title,
            "thesis": self.thesis,
            "measured": self.measured,
            "numbers": dict(self.numbers),
            "verdict": str(self.judgement.verdict),
            "rule": self.judgement.rule,
            "reason": self.judgement.reason,
            "remark": self.remark,
            "pictures": [picture.name for picture in self.pictures],
        }


class Claim(NamedTuple):
    """How a row is evaluated: the runs and figures it needs, and the function that makes the row of them."""

    name: str
    needs: Callable[[ReproductionExtent], Mapping[ReproductionCase, Drawings]]
    make: Callable[[ReproductionExtent, Results], ClaimRow]


def of(
    cases: Sequence[ReproductionCase], shown: ReproductionCase | None = None, drawings: Drawings = ()
) -> dict[ReproductionCase, Drawings]:
    """Return cases as needs, one of them with drawings; the one that is shown need not be among the others."""
    needs: dict[ReproductionCase, Drawings] = dict.fromkeys(cases, ())
    if shown is not None:
        needs[shown] = drawings
    return needs


def largest(values: Sequence[float | None]) -> float | None:
    """Return the largest value; None where one is missing, which may be the largest."""
    known = [value for value in values if value is not None]
    return max(known, default=None) if len(known) == len(values) else None


def runs_of(cases: Sequence[ReproductionCase], results: Results) -> list[ReproductionResult]:
    """Return the results of cases."""
    return [results[case] for case in cases]


def by_duration(runs: Sequence[ReproductionResult], name: str) -> dict[str, float | None]:
    """Return a metric of runs that differ only in the duration."""
    return {f"{run.case.duration:g} s": getattr(run, name) for run in runs}


def torque_row(
    place: str, title: str, statement: str, runs: Sequence[ReproductionResult], remark: str, picture: Picture
) -> ClaimRow:
    """Return the row of a claim that the requested torques stay finite, over runs that differ in the duration."""
    peaks = by_duration(runs, "requested")
    return ClaimRow(
        place,
        title,
        statement,
        f"largest torque {plain(largest(list(peaks.values())), 'Nm')}: "
        + ", ".join(f"{plain(peak, 'Nm')} at {duration}" for duration, peak in peaks.items()),
        {"torque_requested_max_nm": peaks},
        finite_torque([run.completed for run in runs], list(peaks.values())),
        remark,
        [picture],
    )
