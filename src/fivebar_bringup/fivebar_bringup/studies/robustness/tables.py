"""The tables of the study: the first failures, their causes, and what was compared."""

from __future__ import annotations

from collections.abc import Sequence

from fivebar_bringup.pages.content import Cell, Line, Table, table
from fivebar_bringup.studies.robustness.effects import Effect
from fivebar_bringup.studies.robustness.running import Climb, equipment_named, failure_rule
from fivebar_bringup.studies.robustness.sensor_effects import ALL_EFFECTS
from fivebar_bringup.studies.sweep.drawing import ROBOT


def first_failures(climbs: Sequence[Climb], robot: str = ROBOT) -> Table:
    """Return the size at which each equipment first fails, an effect a row.

    An entry is good where even a middling robot has less of the effect, bad where a good one has as much.
    """
    used = list(dict.fromkeys(climb.equipment for climb in climbs))
    of = {(climb.effect, climb.equipment): climb for climb in climbs}
    rows = []
    for name in dict.fromkeys(climb.effect for climb in climbs):
        effect = ALL_EFFECTS[name]
        words = f"{effect.words} ({effect.unit})" if effect.unit else effect.words
        found = [of.get((name, equipment)) for equipment in used]
        first = [Cell("", None) if climb is None else _first(effect, climb) for climb in found]
        rows.append((Cell(words, name), _typical(effect.good), _typical(effect.middling), *first))
    return table(
        "first",
        "Where each controller first fails",
        f"Smallest size at which one of the runs fails: {failure_rule(robot)}. A dash: at no size, up to the one behind"
        " it. Green: even a middling robot has less; red: a good robot has as much. Each effect alone, on a robot that"
        " is otherwise exact.",
        ("effect", "good robot", "middling robot", *used),
        rows,
    )


def causes_table(climbs: Sequence[Climb]) -> Table:
    """Return how the runs failed at the first size with a failure, and at the largest."""
    rows: list[Line] = []
    for climb in climbs:
        if climb.first is None:
            continue
        causes = [
            ", ".join(f"{cause} {count}" for cause, count in climb.causes[step].items()) or "none"
            for step in (climb.first, -1)
        ]
        rows.append((climb.effect, climb.equipment, *causes, climb.runs))
    columns = ("effect", "controller", "first failures", "failures at the largest size", "of runs")
    return table("causes", "How they fail", "", columns, rows, folded=True)


def equipment_table(baseline: dict[str, int]) -> Table:
    """Return what the names of the controllers stand for, and how many runs without any effect failed."""
    rows = ((name, equipment_named(name).words, failed) for name, failed in baseline.items())
    return table("equipment", "What is compared", "", ("controller", "it has", "failures without any effect"), rows)


def _typical(size: float | None) -> Cell:
    return Cell("0" if size is None else f"{size:g}", size)


def _first(effect: Effect, climb: Climb) -> Cell:
    size = climb.first_size
    if size is None:
        return Cell(f"– ({effect.sizes[-1]:g})", None, True)
    if effect.good is not None and not worse(effect, size, effect.good):
        return Cell(f"{size:g}", size, False)
    return Cell(f"{size:g}", size, True if effect.middling is None or worse(effect, size, effect.middling) else None)


def worse(effect: Effect, size: float, other: float) -> bool:
    """Return whether a size is more of an effect than another."""
    return size < other if effect.falls else size > other
