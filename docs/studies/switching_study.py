# SPDX-License-Identifier: Apache-2.0
"""How long a blended controller has to be out of its zones, so that errors shrink from crossing to crossing.

`python docs/studies/switching_study.py` prints both figures for the middle crossing, and with `--random`
the table of docs/bounds.md for random crossings.
Out of a zone the motors' errors under computed torque shrink at a known rate in a known norm. Through a zone they are
mapped linearly, to first order: the map follows from the exact model with slightly moved starts. Errors of some
millimetres are mapped as they are.
"""

from __future__ import annotations

import argparse
import math
from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_bringup.report.thesis import MIDDLE
from fivebar_bringup.scenario import Scenario
from fivebar_control.laws.blend import blend
from fivebar_control.laws.ctc import CtcSettings
from fivebar_control.laws.law import Instant
from fivebar_control.laws.registry import SUPERVISIONS
from fivebar_control.loop.supervisor import Supervisor
from fivebar_control.model.dynamics import direct_dynamics_of_platform
from fivebar_control.model.geometry import wrap
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.line import Line
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_control.trajectory.desired import desired_at
from fivebar_control.trajectory.planner import Plan
from fivebar_description.settings import as_numbers
from fivebar_studies.sweep.drawing import Draw, draw
from fivebar_studies.sweep.planning import accepted

SEED, RIG = 606060, "ideal"
"""Random crossings of robots without errors."""

LARGE, DIRECTIONS = 2e-3, 8
"""A large displacement of a start (m), and the number of its directions."""

FloatArray = NDArray[np.float64]

DURATIONS = (0.5, 1.0, 2.0)
CONTROLLER = "multi_cartesian"
"""Controller whose gains do not adapt, so that its laws have no memory."""

STEP = 2.5e-4
"""Step of the integration (s)."""

MOVED = 1e-6
"""How far starts are moved (m, and in a twentieth of a second)."""

MARGIN = 1e-3
"""Time (s) outside of a zone at which the map begins and ends."""


class ZoneMap(NamedTuple):
    """Passage of a zone.

    Attributes:
        growth: largest factor by which it multiplies errors of the motors, in the norm that shrinks outside.
        rate: at which they shrink there, at least (1/s).
    """

    growth: float
    rate: float

    @property
    def dwell(self) -> float:
        """Time (s) out of the zones after which errors are no larger than before the zone."""
        return max(0.0, math.log(self.growth)) / self.rate


def finite_growth(scenario: Scenario, distance: float) -> float:
    """Return the largest factor by which the first zone multiplies an error of a start that is moved so far (m).

    NaN where a law is undefined on the way.
    """
    plan, gains = scenario.plan(), tuned_controller(scenario).nominal.settings
    assert isinstance(gains, CtcSettings)
    c, ends = gains.kp / gains.kd, zone_ends(plan)
    start = np.array(plan.path.at(ends[0])[:4])
    kept, growths = passed(scenario, plan, start, ends), []
    for angle in np.linspace(0.0, 2.0 * math.pi, DIRECTIONS, endpoint=False).tolist():
        moved = start + distance * np.array((math.cos(angle), math.sin(angle), 0.0, 0.0))
        pairs = ((ends[0], moved, start), (ends[1], passed(scenario, plan, moved, ends), kept))
        before, after = (
            float(np.linalg.norm(_errors(scenario, plan, one, t, c) - _errors(scenario, plan, other, t, c)))
            for t, one, other in pairs
        )
        growths.append(after / before)
    return max(growths) if all(map(math.isfinite, growths)) else math.nan


def zone_ends(plan: Plan) -> tuple[float, float]:
    """Return the times (s) between which the first zone of a plan is passed."""
    middle = plan.crossings[0].time
    return middle - plan.zone_time - MARGIN, middle + plan.zone_time + MARGIN


def zone_map(scenario: Scenario) -> ZoneMap:
    """Return the map of a scenario's first zone."""
    plan, gains = scenario.plan(), tuned_controller(scenario).nominal.settings
    assert isinstance(gains, CtcSettings)
    ends = zone_ends(plan)
    start = np.array(plan.path.at(ends[0])[:4])
    c = gains.kp / gains.kd
    before: list[FloatArray] = []
    after: list[FloatArray] = []
    for move in MOVED * np.diag((1.0, 1.0, 20.0, 20.0)):
        starts = [start + move, start - move]
        ended = [passed(scenario, plan, one, ends) for one in starts]
        for errors, t, places in ((before, ends[0], starts), (after, ends[1], ended)):
            one, other = (_errors(scenario, plan, place, t, c) for place in places)
            errors.append(one - other)
    mapped = np.linalg.solve(np.array(before), np.array(after))
    rate = c * min(1.0, gains.kd**2 / gains.kp - 1.0)
    return ZoneMap(float(np.linalg.norm(mapped, 2)), rate)


def passed(scenario: Scenario, plan: Plan, start: FloatArray, ends: tuple[float, float]) -> FloatArray:
    """Return position and velocity of the platform at the end of a time (s), by the laws on the exact model."""
    robot, tuned, rate_hz = scenario.five_bar(), tuned_controller(scenario), scenario.rate_hz
    supervise = Supervisor(plan, rate_hz, tuned.controller.weighting)
    constraint = tuned.constraint
    assert constraint is not None
    settings = [as_numbers(one.settings) for one in (tuned.nominal, constraint)]
    steps = [one.law.step for one in (tuned.nominal, constraint)]

    def slope(t: float, at: FloatArray) -> FloatArray:
        state = state_from_platform(robot, plan.mode, *at.tolist())
        reference = desired_at(robot, plan, t, plan.path.at(t))
        segment = plan.path.line_at(t)
        line = Line(reference.state.x, reference.state.y, segment.direction_x, segment.direction_y)
        sigma = supervise.at(t, state).sigma
        instant = Instant(state, reference, line, plan.mode, sigma, 1.0 / rate_hz, None)
        torques = [step(robot, instant, None, numbers)[0] for step, numbers in zip(steps, settings, strict=True)]
        torque = blend(sigma, *torques)
        found = direct_dynamics_of_platform(robot, state, *torque, reference.f1, reference.f2)
        return np.array((at[2], at[3], *found))

    at, count = start, math.ceil((ends[1] - ends[0]) / STEP)
    step = (ends[1] - ends[0]) / count
    for number in range(count):
        t = ends[0] + number * step
        k1 = slope(t, at)
        k2 = slope(t + 0.5 * step, at + 0.5 * step * k1)
        k3 = slope(t + 0.5 * step, at + 0.5 * step * k2)
        k4 = slope(t + step, at + step * k3)
        at = at + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return at


def _errors(scenario: Scenario, plan: Plan, at: FloatArray, t: float, c: float) -> FloatArray:
    """Return c e and e' + c e of both motors (rad/s)."""
    robot = scenario.five_bar()
    state = state_from_platform(robot, plan.mode, *at.tolist())
    wanted = desired_at(robot, plan, t, plan.path.at(t)).state
    legs = ((state.leg1, wanted.leg1), (state.leg2, wanted.leg2))
    places = [c * wrap(leg.q1 - desired.q1) for leg, desired in legs]
    return np.array(
        [*places, *(leg.dq1 - desired.dq1 + place for (leg, desired), place in zip(legs, places, strict=True))]
    )


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--random", type=int, metavar="COUNT", help="random crossings in place of the middle one")
    given = parser.parse_args()
    if given.random is not None:
        print_random(given.random)
        return
    print("| supervision | T | growth through the zone | out of the zone for at least |")
    print("|---|---|---|---|")
    for supervision in SUPERVISIONS:
        for duration in DURATIONS:
            found = zone_map(middle(duration, supervision))
            print(f"| `{supervision}` | {duration:g} s | {found.growth:.2f} | {1e3 * found.dwell:.0f} ms |")


def print_random(count: int) -> None:
    """Print the table of random crossings."""
    print("| supervision | growth, median and largest | of 2 mm | of these undefined | dwell time for the largest |")
    print("|---|---|---|---|---|")
    cases = list(islice(accepted(lambda number: draw(SEED, number, RIG), CONTROLLER), count))
    for supervision in SUPERVISIONS:
        scenarios = [crossing(case, supervision) for case in cases]
        maps = [zone_map(scenario) for scenario in scenarios]
        small, large = [one.growth for one in maps], [finite_growth(scenario, LARGE) for scenario in scenarios]
        defined = [growth for growth in large if not math.isnan(growth)]
        told = [f"{np.median(each):.0f}, {max(each):.0f}" for each in (small, defined)]
        dwell = 1e3 * max(one.dwell for one in maps)
        print(f"| `{supervision}` | {told[0]} | {told[1]} | {count - len(defined)} | {dwell:.0f} ms |", flush=True)


def crossing(case: Draw, supervision: str) -> Scenario:
    """Return the scenario of a random crossing under one of `SUPERVISIONS`."""
    scenario = case.scenario(CONTROLLER)
    return scenario.model_copy(update={"zone": scenario.zone._replace(supervision=supervision)})


def middle(duration: float, supervision: str) -> Scenario:
    """Return the middle crossing under one of `SUPERVISIONS`."""
    content = {"name": "switching", "controller": CONTROLLER, "waypoints": MIDDLE, "segment_duration": duration}
    return Scenario.model_validate({**content, "zone": {"supervision": supervision}})


if __name__ == "__main__":
    main()
