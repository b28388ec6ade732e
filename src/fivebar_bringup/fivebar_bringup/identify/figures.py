# SPDX-License-Identifier: Apache-2.0
"""The figures of an identification: measured and predicted torques, and the parameters against those before."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.identify.result import INTERVALS, IdentificationResult, IdentifiedParameter
from fivebar_bringup.pages.content import Picture
from fivebar_bringup.pages.style import BLUE, GREY, MOTORS, house_style, new_figure, png
from fivebar_bringup.units import engineering, suitable_unit

TORQUES = (
    "Torques of both motors after the filters, measured and as the identified model predicts them, with the"
    " residuals. Grey alone where a motor's equation is not used: the motor is slow or reverses within the filters'"
    " length, the platform is near the Type 2 locus, or the recording begins or ends."
)
PARAMETERS = (
    "The identified parameters relative to the initial ones, with their intervals, and the friction offsets. Where a"
    " bar is too short to be seen, the interval is narrower than the dot."
)


def draw_pictures(findings: IdentificationResult) -> list[Picture]:
    """Return the pictures in the order in which the page shows them."""
    with house_style():
        return [
            Picture("torques", TORQUES, png(torques(findings))),
            Picture("parameters", PARAMETERS, png(parameters(findings))),
        ]


def torques(findings: IdentificationResult) -> Figure:
    """Draw measured and predicted torques of both motors, and the residuals below them."""
    identification = findings.identification
    misfits = " and ".join(f"{100.0 * part:.2g} %" for part in identification.misfit)
    figure = new_figure("Measured and predicted torque", f"unexplained: {misfits} of the torque", 8.4)
    panels = figure.subplots(4, 1, sharex=True, height_ratios=[2.2, 1.0, 2.2, 1.0])
    equations, residuals = identification.equations, identification.fit.residuals
    time, measured = equations.time, equations.torque
    for motor in range(2):
        above, below = panels[2 * motor], panels[2 * motor + 1]
        above.plot(time, measured[:, motor], color=GREY, linewidth=1.0, label="measured")
        predicted = measured[:, motor] - residuals[:, motor]
        above.plot(time, predicted, color=MOTORS[motor], linewidth=2.2, label="predicted")
        above.set_title(f"motor {motor + 1}: {identification.used_s[motor]:.1f} s used")
        above.set_ylabel("torque in Nm")
        above.legend(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=2, borderpad=0.0)
        _residual(below, time, residuals[:, motor], motor)
    panels[-1].set_xlabel("time in s")
    return figure


def _residual(axes: Axes, time: FloatArray, residual: FloatArray, motor: int) -> None:
    scale, unit = suitable_unit(float(np.nanmax(np.abs(residual))), "Nm")
    axes.axhline(0.0, color=GREY, linewidth=0.7, zorder=1.0)
    axes.plot(time, residual * scale, color=MOTORS[motor], linewidth=1.2, marker=".", markersize=3.0)
    axes.set_ylabel(f"residual\nin {unit}")
    axes.set_title(f"residual: root mean square {engineering(float(np.sqrt(np.nanmean(residual**2))), 'Nm')}")


def parameters(findings: IdentificationResult) -> Figure:
    """Draw every parameter with its interval, relative to the starting value; the offsets in Nm."""
    all_parameters = findings.parameters()
    relative, offsets = all_parameters[:5], all_parameters[5:]
    figure = new_figure(
        "Identified parameters", f"with {INTERVALS}, beside the initial ones of {findings.start.name}", 4.6
    )
    left, right = figure.subplots(1, 2, width_ratios=[1.5, 1.0])
    largest = _interval_rows(
        left, relative, [100.0 / abs(parameter.before) if parameter.before else 1.0 for parameter in relative], 100.0
    )
    left.axvline(100.0, color=GREY, linewidth=1.2, linestyle="--")
    left.set_xlim(100.0 - 1.15 * largest, 100.0 + 1.15 * largest)
    left.set_xlabel("identified in % of the starting value")
    _interval_rows(right, offsets, [1.0, 1.0], 0.0)
    for row, parameter in enumerate(offsets):
        right.plot(
            parameter.before, row, marker="|", markersize=16.0, color=GREY, markeredgewidth=2.0, linestyle="none"
        )
    right.margins(x=0.15)
    right.set_xlabel("offset in Nm (grey: before)")
    return figure


def _interval_rows(axes: Axes, rows: list[IdentifiedParameter], scales: list[float], centre: float) -> float:
    """Draw one row per parameter, the first on top; return the largest distance of an interval's end from `centre`."""
    largest = 1.0 if centre else 0.0
    for row, (parameter, scale) in enumerate(zip(rows, scales, strict=True)):
        place, half = parameter.value * scale, parameter.half_width * scale
        axes.errorbar(place, row, xerr=half, color=BLUE, marker="o", markersize=6.5, capsize=5.0, linestyle="none")
        largest = max(largest, abs(place - centre) + half)
    axes.set_yticks(range(len(rows)), [f"{parameter.name}\n{parameter.text()} {parameter.unit}" for parameter in rows])
    axes.set_ylim(len(rows) - 0.5, -0.5)
    return largest
