# SPDX-License-Identifier: Apache-2.0
"""The passage condition against runs: how far a load on the locus moves the platform, over load and speed.

`python docs/studies/passage_study.py [--figure FILE.png]` prints the least displacement that
bounds.md proves for every law, and that of runs on the plant, for forces along t_s onwards and against the motion; the
figure is the phase diagram in the plane of load and speed.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fivebar_bringup.pages.style import BLUE, INK, VERMILION, house_style, new_figure, png
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.engine import crossing
from fivebar_control.laws.unified import input_map
from fivebar_control.loop.sampled_plan import sampled
from fivebar_control.model.dynamics import platform_model
from fivebar_control.model.singularity import ParallelSvd, inverse_condition, parallel_svd
from fivebar_control.model.state import State
from fivebar_control.trajectory.desired import desired_at

TORQUE_LIMIT = 2.0
DURATIONS = (0.4, 0.6, 0.9, 1.3, 1.9)
FORCES = (1.0, 2.0, 3.0, 4.5, 6.5, 9.0)

WINDOW, INSTANTS, ROUNDS = 0.15, 81, 6
"""Time (s) about the crossing, at most, instants at which the model is evaluated, and rounds in which the time that a
load takes and the window that it needs are found."""

TOLERANCE = 2e-3
"""Displacement (m) that counts as passed in the figure."""

LINES = (5e-4, 1e-3, 2e-3, 4e-3)
"""Least displacements (m) that are drawn as lines."""


SLOWEST_SHIFT, SHIFT_STEPS = 1e-3, 400
"""Limits of `unavoidable`: the root of beta below which the closed form does, and steps of the search for the
largest."""


class Passage(NamedTuple):
    """A crossing under a load.

    Attributes:
        kappa_rate: of the crossing (1/s).
        least: displacement that no law avoids which is on its reference when the force begins (m).
        onwards, against: that of a run with the force along the motion's share of t_s and against it (m).
    """

    kappa_rate: float
    least: float
    onwards: float
    against: float


def exposure(kappa_rate: float, gain: float, torque: float, load: float) -> float:
    """Return the displacement (m) by a lasting load that the drives' limit alone opposes, at constant speed.

    The closed form of bounds.md: 1.94 a_F^3 / (gain kappa_rate torque)^2.

    Args:
        kappa_rate: of the crossing (1/s).
        gain: acceleration along t_s by torque and kappa (m/s^2 per Nm).
        torque: that is left for the load (Nm).
        load: acceleration by the load (m/s^2).
    """
    time = load / (gain * kappa_rate * torque)
    return (1.0 + 2.0 * math.sqrt(2.0) / 3.0) * load * time * time


def unavoidable(kappa_rate: float, gain: float, torque: float, load: float, speed: float) -> float:
    """Return the displacement (m) that a load makes at least, whatever the law, when it begins at the worst.

    The platform is on its reference and at rest relative to it when the load begins; a law that knows the load before
    may be elsewhere, and does better. The displacement is that of `exposure` for a platform that the load pushes
    onwards along its path, whose displacement takes it away from the locus: bounds.md. In units of a_F
    t_F^2 and t_F it is the largest eta of eta'' = 1 - |s| - beta eta, beta = a_F t_F / speed, that begins at rest at s
    = -1, as long as the comparison with any other motion holds, sqrt(beta) (s + 1) <= pi.

    Args:
        kappa_rate: of the crossing (1/s).
        gain: largest acceleration along t_s by 1 Nm of each motor and kappa (m/s^2 per Nm).
        torque: that is left for the load (Nm).
        load: acceleration by the load (m/s^2).
        speed: at which the platform goes through the locus along t_s (m/s); infinite where it goes across.
    """
    time = load / (gain * kappa_rate * torque)
    omega = math.sqrt(load * time / speed)
    if omega < SLOWEST_SHIFT:
        return exposure(kappa_rate, gain, torque, load)
    largest = 0.0
    end = min(math.pi / omega - 1.0, 1.0 + math.sqrt(2.0))
    for step in range(SHIFT_STEPS + 1):
        s = -1.0 + (end + 1.0) * step / SHIFT_STEPS
        if s <= 0.0:
            eta = 1.0 + s - math.sin(omega * (1.0 + s)) / omega
        else:
            eta = (
                1.0
                - s
                + ((2.0 - math.cos(omega)) * math.sin(omega * s) - math.sin(omega) * math.cos(omega * s)) / omega
            )
        largest = max(largest, eta / (omega * omega))
    return largest * load * time * time


def passage(controller: str, duration: float, force: float) -> Passage:
    """Return the middle crossing under a force (N) that begins where the motors no longer hold it."""
    fields = {
        "name": "passage",
        "controller": controller,
        "waypoints": ((0.0, 0.15), (0.0, 0.02)),
        "segment_duration": duration,
        "plant": {"torque_limit": TORQUE_LIMIT},
        # what is lost should be seen
        "tracking_error_limit": 0.08,
    }
    scenario = Scenario.model_validate(fields)
    plan, robot = scenario.plan(), scenario.five_bar()
    crossed = plan.crossings[0]

    def reference(after: float) -> State:
        return desired_at(robot, plan, crossed.time + after, plan.path.at(crossed.time + after)).state

    svd = parallel_svd(reference(0.0))
    step = 4e-3
    kappa_rate = sum(inverse_condition(reference(sign * step)) for sign in (1.0, -1.0)) / (2.0 * step)
    along = plan.path.at(crossed.time)
    speed = along.vx * svd.t_x + along.vy * svd.t_y
    samples = sampled(robot, plan, scenario.rate_hz)
    free = crossing(case_of(scenario), samples)
    # the motors may turn from what the motion takes to the other limit
    torque, window = TORQUE_LIMIT + max(free.applied1, free.applied2), 0.01
    for _ in range(ROUNDS):
        states = [(t, reference(t)) for t in np.linspace(-window, window, INSTANTS).tolist()]
        gain = max(_along_t_s(scenario, svd, state) / abs(t) for t, state in states if abs(t) > 1e-4)
        load = force * min(_by_force(scenario, svd, state) for _, state in states)
        time = load / (gain * torque)
        window = min((1.0 + math.sqrt(2.0)) * time, WINDOW)
    errors = []
    for sign in (1.0, -1.0):
        heading = math.atan2(sign * speed * svd.t_y, sign * speed * svd.t_x)
        push = scenario.plant.push._replace(
            force=force, heading=heading, start=crossed.time - time, length=2e-3 + (2.0 + math.sqrt(2.0)) * time
        )
        loaded = scenario.model_copy(update={"plant": scenario.plant._replace(push=push)})
        errors.append(crossing(case_of(loaded), samples).error_peak)
    least = unavoidable(kappa_rate, gain / kappa_rate, torque, load, abs(speed))
    return Passage(kappa_rate, least, *errors)


def _along_t_s(scenario: Scenario, svd: ParallelSvd, state: State) -> float:
    """Return the acceleration along t_s (m/s^2) by 1 Nm of each motor, with the signs that suit it."""
    mapped = input_map(scenario.five_bar(), state)
    assert mapped is not None
    return abs(mapped.g_x1 * svd.t_x + mapped.g_y1 * svd.t_y) + abs(mapped.g_x2 * svd.t_x + mapped.g_y2 * svd.t_y)


def _by_force(scenario: Scenario, svd: ParallelSvd, state: State) -> float:
    """Return the acceleration along t_s (m/s^2) by 1 N along it."""
    model = platform_model(scenario.five_bar(), state)
    determinant = model.m_xx * model.m_yy - model.m_xy * model.m_xy
    across = model.m_yy * svd.t_x**2 - 2.0 * model.m_xy * svd.t_x * svd.t_y + model.m_xx * svd.t_y**2
    return across / determinant


def diagram(controller: str, found: Mapping[tuple[float, float], Passage]) -> bytes:
    """Return the phase diagram of a controller's passages by duration (s) and force (N) as PNG."""
    rates = [found[duration, FORCES[0]].kappa_rate for duration in DURATIONS]
    least = np.array([[found[duration, force].least for duration in DURATIONS] for force in FORCES])
    with house_style():
        figure = new_figure(
            "The passage condition",
            f"least displacement that no law avoids (lines, mm), and runs of {controller}: filled within"
            f" {1e3 * TOLERANCE:g} mm of the reference, open beyond",
            4.6,
        )
        axes = figure.subplots()
        lines = axes.contour(rates, FORCES, 1e3 * least, [1e3 * line for line in LINES], colors=INK, linewidths=1.2)
        axes.clabel(lines, fmt="%g mm", fontsize=8)
        for shift, name, words, colour in (
            (1.02, "onwards", "with", BLUE),
            (1.0 / 1.02, "against", "against", VERMILION),
        ):
            for (_, force), one in found.items():
                passed = getattr(one, name) < TOLERANCE
                axes.plot(
                    one.kappa_rate * shift, force, "o", ms=5, color=colour, markerfacecolor=colour if passed else "none"
                )
            axes.plot([], [], "o", ms=5, color=colour, label=f"force {words} the motion")
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_ylim(0.9 * FORCES[0], 1.1 * FORCES[-1])
        axes.set_xticks(rates, [f"{rate:.1f}" for rate in rates])
        axes.set_xticks([], minor=True)
        axes.set_yticks(FORCES, [f"{force:g}" for force in FORCES])
        axes.set_yticks([], minor=True)
        axes.set_xlabel("rate of 1/cond(A) at the crossing (1/s): faster to the right")
        axes.set_ylabel("force along t_s (N)")
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.09))
        return png(figure)


def main() -> None:
    """Print the grid, and draw it on request."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--controller", default="unified")
    parser.add_argument("--figure", type=Path, metavar="FILE.png", help="the phase diagram")
    given = parser.parse_args()
    table: dict[tuple[float, float], Passage] = {}
    print("T in s | N | 1/s | least, onwards, against in mm | times the least")
    ratios = []
    for duration in DURATIONS:
        for force in FORCES:
            found = table[duration, force] = passage(given.controller, duration, force)
            ratios.append(min(found.onwards, found.against) / found.least)
            lengths = ", ".join(f"{1e3 * value:.2f}" for value in found[1:])
            print(f"{duration} | {force} | {found.kappa_rate:.2f} | {lengths} | {ratios[-1]:.2f}", flush=True)
    bounds = ", ".join(f"{value:.2f}" for value in np.percentile(ratios, (0, 50, 100)).tolist())
    print(f"least, median and largest of the last column: {bounds}")
    if given.figure is not None:
        given.figure.write_bytes(diagram(given.controller, table))


if __name__ == "__main__":
    main()
