# SPDX-License-Identifier: Apache-2.0
"""A step of a commissioning, and how it ends."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Generic, NamedTuple, TypeVar

from fivebar_bringup.recorded.summary import Summary

S = TypeVar("S")


class GateClosed(Exception):
    """A step has not been passed: what was found, and what to do about it."""

    def __init__(self, name: str, words: str, figures: Mapping[str, Any] | None = None) -> None:
        """Close the gate for a reason with a name, in words, with what was measured."""
        super().__init__(f"{name}: {words}")
        self.name, self.words = name, words
        self.figures = dict(figures or {})


def fault_or_outcome(summary: Summary) -> str:
    """Return the name of a reason for which a run has not succeeded: its first fault, else its outcome."""
    return summary.faults[0] if summary.faults else str(summary.outcome)


class Findings(NamedTuple):
    """The findings of a step that was passed.

    Attributes:
        words: in a sentence.
        figures: plain values by their names with units, for the report.
        pages: names of further pages or folders, relative to the directory of the commissioning.
    """

    words: str
    figures: Mapping[str, Any] = {}
    pages: tuple[str, ...] = ()


class GatedStep(NamedTuple, Generic[S]):
    """A step.

    Attributes:
        name: by which state, answers and `--again` know it.
        title: for a person.
        does: what is done.
        cost: how long it takes, roughly.
        risk: what can go wrong, and what is done against it.
        gate: what has to hold for the next step to begin.
        run: does it, or raises `GateClosed`.
    """

    name: str
    title: str
    does: str
    cost: str
    risk: str
    gate: str
    run: Callable[[S], Findings]
