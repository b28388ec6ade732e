# SPDX-License-Identifier: Apache-2.0
"""Pictures for docs/laws.md: the path law beside `unified`, and the published peer.

`python docs/studies/law_pictures.py docs/images` writes them, from four simulated runs.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.pages.style import BLUE, GREY, VERMILION, ZONE, house_style, new_figure, svg
from fivebar_bringup.report.thesis import MULTIPLE
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.offline import simulate
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.model.singularity import inverse_condition

OBLIQUE = ((0.0, 0.15), (0.04, 0.03))
PUSH: dict[str, float] = {"force": 2.0, "heading": 1.57, "start": 0.52, "length": 0.05}
"""A push backwards (N, rad, s) as the oblique crossing meets the locus."""

NEAR = 0.056
"""1/cond(A) below which `unified` gives up more than half of an acceleration along t_s."""


class Motion(NamedTuple):
    """A run, sample by sample.

    Attributes:
        time: float64[n] (s).
        ahead: float64[n] (m), how far the platform is ahead of the plan along the first segment.
        beside: float64[n] (m), its distance from the line of that segment.
        torque: float64[n] (Nm), the larger one of both motors.
        kappa: float64[n], 1/cond(A).
    """

    time: FloatArray
    ahead: FloatArray
    beside: FloatArray
    torque: FloatArray
    kappa: FloatArray


def motion(controller: str, waypoints: Any, **others: Any) -> Motion:
    """Run a scenario of segments of 1 s on the robot as modelled."""
    scenario = Scenario.model_validate(
        {"name": "picture", "controller": controller, "waypoints": waypoints, "segment_duration": 1.0, **others}
    )
    robot, path = scenario.five_bar(), scenario.plan().path
    (x0, y0), (x1, y1) = scenario.waypoints[:2]
    length = math.hypot(x1 - x0, y1 - y0)
    dx, dy = (x1 - x0) / length, (y1 - y0) / length
    rows = []
    for sample in simulate(scenario).samples:
        state = state_from_joints(robot, *sample.exact.position, *sample.exact.velocity)
        time = sample.number / scenario.rate_hz
        wanted = path.at(time)
        ahead = dx * (state.x - wanted.x) + dy * (state.y - wanted.y)
        beside = abs(dx * (state.y - y0) - dy * (state.x - x0))
        rows.append((time, ahead, beside, max(map(abs, sample.command)), inverse_condition(state)))
    return Motion(*np.array(rows).T)


def pushed(controller: str) -> Motion:
    """Return the oblique crossing under the push."""
    return motion(controller, OBLIQUE, plant={"push": PUSH}, tracking_error_limit=0.05)


def crossed(time_law: str) -> Motion:
    """Return the first two segments of the multiple crossing by `lqr`."""
    return motion("lqr", MULTIPLE[:3], time_law=time_law)


def draw_path() -> Figure:
    """Draw how far both laws are from the plan and from the path after a push."""
    figure = new_figure(
        "After a push on the locus", "from (0, 150) to (40, 30) mm in 1 s, pushed back by 2 N for 50 ms", 3.4
    )
    along, across = figure.subplots(1, 2)
    for law, color in (("unified", GREY), ("path", BLUE)):
        run = pushed(law)
        along.plot(run.time, 1e3 * run.ahead, color=color, label=law)
        across.plot(run.time, 1e3 * run.beside, color=color, label=law)
    for axes, title in ((along, "ahead of the plan in mm"), (across, "distance from the path in mm")):
        axes.axvspan(PUSH["start"], PUSH["start"] + PUSH["length"], color=ZONE, label="push")
        axes.set_title(title)
        axes.set_xlabel("time in s")
    across.legend()
    return figure


def draw_lqr() -> Figure:
    """Draw the torque of `lqr` for two time laws, near the locus above all."""
    figure = new_figure("Torque of lqr near the locus", "two segments of the multiple crossing, 1 s each", 3.4)
    axes = figure.subplots()
    for time_law, color in (("quintic", VERMILION), ("criterion", BLUE)):
        run = crossed(time_law)
        axes.plot(run.time, run.torque, color=color, label=f"time law {time_law}")
    axes.fill_between(
        run.time, 0.0, 1.0, where=(run.kappa < NEAR).tolist(), transform=axes.get_xaxis_transform(), color=ZONE,
        label="near the locus",
    )  # fmt: skip
    axes.set_xlabel("time in s")
    axes.set_ylabel("larger torque in Nm")
    axes.set_ylim(0.0, None)
    axes.legend()
    return figure


def main() -> None:
    """Write both pictures into a folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="where both pictures are written")
    folder = parser.parse_args().folder
    with house_style():
        for name, draw in (("path", draw_path), ("lqr", draw_lqr)):
            (folder / f"{name}.svg").write_bytes(svg(draw()))


if __name__ == "__main__":
    main()
