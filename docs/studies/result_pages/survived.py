# SPDX-License-Identifier: Apache-2.0
"""The page of what each law survives of its surroundings and of what its robot's model lacks."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from fivebar_studies.engine.table import RowTable
from fivebar_studies.robustness.figures import share_figure
from fivebar_studies.robustness.robustness import QUICK
from fivebar_studies.robustness.sensor_effects import ALL_EFFECTS
from result_pages.faults import STUDY, FaultRow, climbs_of_rows, fault_rows, first_failing
from result_pages.page import JUDGED_IN_TIME, ResultPage, StudyRun, TextTable

EFFECTS = {
    "vibration": "a table that vibrates",
    "drag": "a constant pull",
    "cable": "a cable that stretches",
    "heating": "friction that heats up",
    "supply": "a supply that sags",
    "distal_mass": "distal links with mass",
    "height": "a leg that is above the other",
}
"""Effects of the surroundings, and of the robot, that no law's model has; in words."""

LAWS = ("unified", "multi_cartesian", "multi_joint", "multi_model_ctc", "mpc", "lqr", "path")

SENSORS = ("encoders", "gyro")

RUNS = (
    StudyRun(
        "robustness_laws",
        STUDY,
        {**QUICK, "effects": tuple(EFFECTS), "controllers": LAWS},
        {"effects": tuple(EFFECTS)[:2], "controllers": LAWS[:3]},
    ),
)

DRAWN = tuple(f"{law}, gyro" for law in ("unified", "multi_cartesian", "mpc", "path"))
"""Equipment in the figure."""


def survived_table(rows: Sequence[FaultRow]) -> TextTable:
    """Return the smallest sizes at which a run of each law fails: from encoders alone, and with a gyroscope."""
    of = {(climb.effect, climb.equipment): climb for climb in climbs_of_rows(rows)}
    laws = [law for law in LAWS if any(row.equipment == f"{law}, gyro" for row in rows)]
    lines = []
    for name in dict.fromkeys(row.effect for row in rows):
        effect, entries = ALL_EFFECTS[name], list[str]()
        for law in laws:
            sizes = [first_failing(of.get((name, f"{law}, {sensors}")), "{:.3g}".format) for sensors in SENSORS]
            entries.append("; ".join(sizes))
        lines.append((f"{effect.words} ({effect.unit})", *entries))
    return TextTable(("one effect alone", *laws), lines)


def _answer(rows: Sequence[FaultRow]) -> str:
    of = {(climb.effect, climb.equipment): climb for climb in climbs_of_rows(rows)}
    parts = []
    for name in dict.fromkeys(row.effect for row in rows):
        mine = {law: of.get((name, f"{law}, gyro")) for law in LAWS}
        steps = {law: len(climb.failed) if climb.first is None else climb.first for law, climb in mine.items() if climb}
        best = max(steps.values())
        winners = [f"`{law}`" for law, step in steps.items() if step == best]
        others = [f"`{law}`" for law, step in steps.items() if step < best]
        words = ", ".join(winners) if len(others) > 1 else f"all laws but {others[0]}" if others else "all laws alike"
        parts.append(f"{EFFECTS[name].capitalize()}: {words}.")
    return f"These laws survive most with a gyroscope. {' '.join(parts)}"


def _figure(rows: Sequence[FaultRow]) -> Figure:
    used = {row.equipment for row in rows}
    return share_figure([name for name in DRAWN if name in used], climbs_of_rows(rows), "What each law survives")


SURVIVED = ResultPage(
    name="survived",
    title="What does each law survive?",
    question="up to which size of an effect that no law's model has does each law cross?",
    runs=("robustness_laws",),
    table=RowTable(FaultRow),
    rows=fault_rows,
    answer=_answer,
    shown=survived_table,
    figure=_figure,
    caption="Share of the runs that fail at each size, growing from left to right, with a gyroscope; blue and dark"
    " line: a good and a middling robot.",
    words="An entry is the smallest size at which one of two runs fails, from encoders alone; with a gyroscope."
    " A dash: none does, up to the largest size that is tried.",
    limits=(
        "Motions other than the middle crossing in 1 s, and more than two runs at a size.",
        "More than one effect at a time, and laws whose gains were chosen for the effect.",
        JUDGED_IN_TIME,
    ),
)
