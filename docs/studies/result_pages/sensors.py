# SPDX-License-Identifier: Apache-2.0
"""The page of the faults of sensors: what is survived, what is noticed, and by which name."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.figure import Figure

from fivebar_bringup.odds.misfit_limits import alarm_rate
from fivebar_bringup.odds.odds import upper_bound
from fivebar_bringup.pages.style import BLUE, GREY, VERMILION
from fivebar_studies.engine.running import FinishedStudy
from fivebar_studies.engine.table import RowTable
from fivebar_studies.robustness.running import NOTICED, REFUSED, SILENT, SURVIVED, RobustnessRow
from fivebar_studies.robustness.sensor_effects import FAULTS, is_wrong_name
from fivebar_studies.robustness.tables import uses_by_crossing
from result_pages.page import ResultPage, StudyRun, TextTable

STUDY = "fivebar_studies.robustness.robustness:ROBUSTNESS"


def _faulted(rig: str, cases: int) -> StudyRun:
    whole = {"rig": rig, "seed": 616160, "cases": cases}
    return StudyRun(f"sensors_{rig}", STUDY, whole, {"cases": 6})


RUNS = (_faulted("calibrated", 60), _faulted("good", 60), _faulted("middling", 170))
"""The seed is another than that on which the watch was made."""


class SensorRow(NamedTuple):
    """A line of sensors.csv: runs with the same fault of a sensor of which the same became.

    Attributes:
        run: that made it.
        rig: whose robots.
        fault: injected, "" for sound runs.
        verdict: survived, noticed, or silent.
        named: fault of the run, "" for none.
        runs: how many.
        alarm_rate: of sound runs, the share that exceeds a limit of the watch, by the tail that is fitted to them.
        alarm_rate_upper: upper end of its interval for 95 %.
    """

    run: str
    rig: str
    fault: str
    verdict: str
    named: str
    runs: int
    alarm_rate: float | None
    alarm_rate_upper: float | None


def sensor_rows(run: str, finished: FinishedStudy) -> list[SensorRow]:
    """Return the rows of a study of a rig."""
    rows: Sequence[RobustnessRow] = [row for row in finished.rows if row.verdict != REFUSED]
    rate = alarm_rate(uses_by_crossing(row for row in rows if not row.effect))
    counts = Counter((row.effect, row.verdict, row.named) for row in rows)
    found = []
    for fault in ("", *FAULTS):
        for (_, verdict, named), count in sorted(one for one in counts.items() if one[0][0] == fault):
            sound = rate if not fault else None
            rates = (None, None) if sound is None else (sound.rate, sound.upper)
            found.append(SensorRow(run, run.removeprefix("sensors_"), fault, verdict, named, count, *rates))
    return found


def _rigs(rows: Sequence[SensorRow]) -> list[str]:
    return [*dict.fromkeys(row.rig for row in rows)]


def _sum(rows: Sequence[SensorRow], verdict: str = "") -> int:
    return sum(row.runs for row in rows if not verdict or row.verdict == verdict)


def _counts(fault: str, rows: Sequence[SensorRow]) -> tuple[int, int, int, int]:
    """Return how many runs survive, are noticed by the fault's own name, by another one, and are silent."""
    names = FAULTS[fault].names if fault else ()
    own = sum(row.runs for row in rows if row.verdict == NOTICED and row.named in names)
    return _sum(rows, SURVIVED), own, _sum(rows, NOTICED) - own, _sum(rows, SILENT)


def _became(fault: str, rows: Sequence[SensorRow]) -> str:
    """Return what became of runs, as four numbers."""
    *others, silent = _counts(fault, rows)
    return ", ".join([*map(str, others), f"**{silent}**" if silent else "0"])


def _bounded(count: int, runs: int) -> str:
    return f"{count} of {runs}, below {100 * upper_bound(count, runs):.2g} %" if runs else "–"


def _wrong(rows: Sequence[SensorRow]) -> int:
    return sum(row.runs for row in rows if is_wrong_name(row.fault, row.named))


def _alarms(rows: Sequence[SensorRow]) -> str:
    rates = [(row.alarm_rate, row.alarm_rate_upper) for row in rows if row.alarm_rate is not None]
    if not rates or rates[0][1] is None:
        return "–"
    return f"{rates[0][0]:.1g}, upper end {rates[0][1]:.1g}"


def sensors_table(rows: Sequence[SensorRow]) -> TextTable:
    """Return the confusion table: what was injected, and what became of it on each rig."""
    rigs, lines = _rigs(rows), list[tuple[str, ...]]()
    for fault in ("", *FAULTS):
        words = FAULTS[fault].words if fault else "nothing"
        of = ([row for row in rows if (row.rig, row.fault) == (rig, fault)] for rig in rigs)
        lines.append((words, *(_became(fault, one) for one in of)))
    faulted = [[row for row in rows if row.rig == rig and row.fault] for rig in rigs]
    sound = [[row for row in rows if row.rig == rig and not row.fault] for rig in rigs]
    lines += [
        ("**silent**, of the faulted runs", *(_bounded(_sum(one, SILENT), _sum(one)) for one in faulted)),
        ("**a wrong name**, of the faulted runs", *(_bounded(_wrong(one), _sum(one)) for one in faulted)),
        ("**a fault**, of the sound runs", *(_bounded(_sum(one, NOTICED), _sum(one)) for one in sound)),
        ("false alarms of the watch in a sound run, by the fitted tail", *(_alarms(one) for one in sound)),
    ]
    return TextTable(("injected", *rigs), lines)


def _answer(rows: Sequence[SensorRow]) -> str:
    parts = []
    for rig in _rigs(rows):
        mine = [row for row in rows if row.rig == rig and row.fault]
        parts.append(f"on `{rig}` {_sum(mine, SILENT)} of {_sum(mine)}")
    words = ", ".join(parts).replace("on", "On", 1)
    wrong = _wrong([row for row in rows if row.fault])
    return (
        f"{words} runs with a faulty sensor are silent. A silent run leaves 5 mm, or ends in the wrong mode,"
        f" without a fault within 50 ms. In {wrong or 'none'} of all these runs the fault has the name of another"
        " cause."
    )


def _figure(rows: Sequence[SensorRow]) -> Figure:
    rigs = _rigs(rows)
    figure = Figure(figsize=(3.2 * len(rigs) + 2.2, 4.6), layout="constrained")
    panels = figure.subplots(1, len(rigs), sharey=True, squeeze=False)[0]
    for panel, rig in zip(panels, rigs, strict=True):
        for place, fault in enumerate(FAULTS):
            mine = [row for row in rows if (row.rig, row.fault) == (rig, fault)]
            left, total = 0.0, max(1, _sum(mine))
            for count, colour, alpha in zip(
                _counts(fault, mine), (GREY, BLUE, BLUE, VERMILION), (0.5, 1.0, 0.45, 1.0), strict=True
            ):
                panel.barh(place, 100 * count / total, left=left, color=colour, alpha=alpha)
                left += 100 * count / total
        panel.set_title(rig)
        panel.set_xlabel("runs, %")
        panel.set_xlim(0, 100)
    panels[0].set_yticks(range(len(FAULTS)), [*FAULTS])
    panels[0].invert_yaxis()
    return figure


SENSORS = ResultPage(
    name="sensors",
    title="Are faults of sensors noticed?",
    question="which faults of sensors are survived, which are noticed, and by which name?",
    runs=tuple(run.name for run in RUNS),
    table=RowTable(SensorRow),
    rows=sensor_rows,
    answer=_answer,
    shown=sensors_table,
    figure=_figure,
    caption="Runs with each fault. Grey: survived; blue: a fault with the name of the cause; light blue: another fault"
    " in time; red: silent.",
    words="An entry counts the runs that survive, that stop with the name of the cause, with another fault in time, and"
    " **silent** ones. Robots of each [rig](../sweeps.md#rigs) make random accepted crossings with every fault, of a"
    " random size, on either motor, from a random moment on. Bounds are one-sided for 95 %."
    " [Estimation](../estimation.md#when-the-estimate-is-not-to-be-trusted) says how faults are noticed.",
    limits=(
        "Two faults at once, and other sizes than those that are drawn.",
        "How much runs of the same crossing are alike; only the fitted tail draws crossings again.",
    ),
)
