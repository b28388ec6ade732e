# SPDX-License-Identifier: Apache-2.0
"""How closely laws follow the estimate from the motors' encoders, and with which torque: the tables of docs/laws.md.

`python docs/studies/encoders_study.py --seed 1 --runs 60` draws motions through the locus, and runs
each on a rig of the comparison, by default `encoders`, whose robot is as believed, with `unified` and with `mpc` by
several weights. What a law adds to the error is *beyond* the estimate's: the largest error of a run less the largest
error of its estimate. 60 motions take some seven minutes of processor time.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from fivebar_bringup.report.thesis import MIDDLE, MULTIPLE
from fivebar_bringup.scenario import Scenario
from fivebar_control.laws.mpc import MpcSettings
from fivebar_studies.rigs.named import find_rig
from mpc_study import run_once

WEIGHTS = MpcSettings().weight, 3e-6, 1e-5
"""Weights of `mpc` on what departs from the torques planned before ((m/Nm)^2)."""

LAWS: dict[str, tuple[str, dict[str, Any]]] = {
    "`unified`": ("unified", {}),
    **{f"`mpc`, `weight` {weight:g}": ("mpc", {"law": {"weight": weight}}) for weight in WEIGHTS},
}
"""Words, and the controller with sections that replace those of the rig."""

PATHS = (MIDDLE, *(MULTIPLE[first : first + 3] for first in range(0, len(MULTIPLE) - 2, 2)))
"""Waypoints of the middle crossing, and pairs of segments of the multiple one."""

MOVED = 5e-4
"""Bound (m) by which each coordinate of a waypoint is moved."""

DURATIONS = 0.5, 3.0
"""Bounds of a segment's duration (s), which is drawn evenly by its logarithm."""

BEYOND, RATIO = 5e-5, 1.2
"""Limits for a law: its addition to the estimate's error (m), and its torque as a multiple of that of `unified`."""


class ThesisMotion(NamedTuple):
    """A motion of the thesis, moved a little: waypoints (m) and the duration of a segment (s)."""

    waypoints: tuple[tuple[float, float], ...]
    duration: float


class EncoderRun(NamedTuple):
    """A run: largest error and error of the estimate (m), largest torque that was asked for (Nm), and whether it was
    stopped."""

    error: float
    estimate: float
    torque: float
    stopped: bool


def drawn(seed: int, runs: int) -> list[ThesisMotion]:
    """Return the motions of a seed."""
    random = np.random.default_rng(seed)
    low, high = np.log(DURATIONS)
    motions = []
    for _ in range(runs):
        path = PATHS[int(random.integers(len(PATHS)))]
        places = np.array(path) + random.uniform(-MOVED, MOVED, (len(path), 2))
        duration = round(float(np.exp(random.uniform(low, high))), 3)
        motions.append(ThesisMotion(tuple((float(x), float(y)) for x, y in places), duration))
    return motions


class EncoderTask(NamedTuple):
    """A motion with one of `LAWS` on a rig of the comparison."""

    rig: str
    words: str
    motion: ThesisMotion


def run(task: EncoderTask) -> EncoderRun:
    """Run a task without a recording."""
    rig, words, motion = task
    controller, sections = LAWS[words]
    given = Scenario.model_validate(
        {"name": "study", "waypoints": motion.waypoints, "segment_duration": motion.duration}
    )
    scenario = Scenario.model_validate(find_rig(rig).content(given, controller) | sections)
    outcome = run_once(scenario)
    torque = max(outcome.requested1, outcome.requested2)
    return EncoderRun(outcome.error_peak, outcome.estimate_error, torque, bool(outcome.fault))


def line(words: str, runs: Sequence[EncoderRun], peers: Sequence[EncoderRun]) -> str:
    """Return a law's row of the table in Markdown; `peers` are the same motions with `unified`."""
    errors = 1e3 * np.array([one.error for one in runs])
    estimates = 1e3 * np.array([one.estimate for one in runs])
    torques = np.array([one.torque for one in runs])
    beyond = errors - estimates
    ratios = torques / np.array([peer.torque for peer in peers])

    def spread(values: Any) -> str:
        return " / ".join(f"{value:.3f}" for value in np.percentile(values, (50.0, 80.0, 100.0)))

    return (
        f"| {words} | {spread(errors)} mm | {spread(estimates)} mm | {spread(beyond)} mm,"
        f" {np.sum(beyond <= 1e3 * BEYOND)} of {len(runs)} | {spread(torques)} Nm | {spread(ratios)},"
        f" {np.sum(ratios <= RATIO)} of {len(runs)} | {sum(one.stopped for one in runs)} |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1, help="of the motions")
    parser.add_argument("--runs", type=int, default=60, help="motions, each with every law")
    parser.add_argument("--rig", default="encoders", choices=("encoders", "realistic"))
    given = parser.parse_args()
    motions = drawn(given.seed, given.runs)
    tasks = [EncoderTask(given.rig, words, motion) for words in LAWS for motion in motions]
    found = []
    with ProcessPoolExecutor() as pool:
        for done, made in enumerate(pool.map(run, tasks), start=1):
            found.append(made)
            print(f"\r{done} of {len(tasks)} runs", end="\n" if done == len(tasks) else "", file=sys.stderr, flush=True)
    by_law = {words: found[n * given.runs : (n + 1) * given.runs] for n, words in enumerate(LAWS)}
    print(
        f"| law | error | of the estimate | beyond, and runs of at most {1e3 * BEYOND:g} mm | torque"
        f" | as a multiple of `unified`, and runs of at most {RATIO:g} | stopped |"
    )
    print("|---|---|---|---|---|---|---|")
    for words, runs in by_law.items():
        print(line(words, runs, by_law["`unified`"]))


if __name__ == "__main__":
    main()
