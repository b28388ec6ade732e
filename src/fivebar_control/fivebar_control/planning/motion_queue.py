# SPDX-License-Identifier: Apache-2.0
"""The reference of a robot that takes requests: first its plan, then one motion after the other, rests between them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from fivebar_control.model.state import Platform
from fivebar_control.planning.line_of_sight import Point
from fivebar_control.planning.orders import PlanningRequest
from fivebar_control.trajectory.path import Path
from fivebar_control.trajectory.planner import Plan
from fivebar_control.trajectory.refusal import PlanRefused
from fivebar_control.trajectory.rounded import blend_radius_problem

GOAL_NAMES = ("x", "y", "assembly_mode", "mode1", "mode2", "duration", "torque_share", "speed_share", "blend_radius")
"""Fields of a request. Only x and y (m) have to be there; the rest may be left out, or be 0 or NaN for "as it comes":
the sign of det A at the goal, the two signs of the working mode, the duration (s), the shares of the limits of torque
and speed that the motion may use, and the radius (m) within which it rounds the corners at its via points."""

MOST_VIA = 20
"""Via points of a request."""

MOST_FIELDS = len(GOAL_NAMES) + 3 * MOST_VIA
"""Fields of a request."""

SHORTEST_MOTION, LONGEST_MOTION = 1e-3, 86_400.0
"""Durations (s) that a request may ask for."""

VIA_NAME = re.compile(r"via([1-9][0-9]?)_(x|y|blend_radius)")
"""Fields of a via point, the first of which is number 1: where it is (m), and where they differ, its blend radius."""


SAME_PLACE = 1e-9
"""Distance (m) up to which places differ by rounding alone, as those of a motion in motor angles do."""


class GoalRefused(PlanRefused):
    """A request that is not accepted, and the reason."""


class Goal(NamedTuple):
    """A request: where to (m), in which assembly mode and working mode, how long (s); 0 is "as it comes".

    The shares are those of the limits of torque and speed that the motion may use. Via points (m) have a blend radius
    (m) each, 0 for a rest.
    """

    x: float
    y: float
    assembly: int = 0
    mode1: int = 0
    mode2: int = 0
    duration: float = 0.0
    torque_share: float = 1.0
    speed_share: float = 1.0
    via: tuple[Point, ...] = ()
    blend_radius: tuple[float, ...] = ()


def read_goal(names: Sequence[str], values: Sequence[float]) -> Goal:
    """Return the request that a list of named numbers makes.

    Raises:
        GoalRefused: a name is unknown, given twice or missing, or a number is impossible.
    """
    if len(names) > MOST_FIELDS:
        raise GoalRefused(f"{len(names)} names: expected at most {MOST_FIELDS}")
    if len(names) != len(values):
        raise GoalRefused(f"{len(names)} names and {len(values)} positions: expected one position per name")
    known = {name for name in names if name in GOAL_NAMES or VIA_NAME.fullmatch(name)}
    if len(known) != len(names) or not {"x", "y"} <= known:
        raise GoalRefused(
            f"names {list(names)}: expected x and y, and of the others each at most once: {GOAL_NAMES}, and via1_x,"
            " via1_y, via1_blend_radius and so on"
        )
    exact = dict(zip(names, values, strict=True))
    fields = {name: 0.0 if math.isnan(value) else value for name, value in exact.items()}
    x, y = exact["x"], exact["y"]
    if not (math.isfinite(x) and math.isfinite(y)):
        raise GoalRefused(f"goal ({x}, {y}): expected finite coordinates in m")
    assembly, mode1, mode2 = (_sign(name, fields.get(name, 0.0)) for name in ("assembly_mode", "mode1", "mode2"))
    duration = fields.get("duration", 0.0)
    if not (duration == 0.0 or SHORTEST_MOTION <= duration <= LONGEST_MOTION):
        raise GoalRefused(
            f"duration {duration}: expected {SHORTEST_MOTION:g} to {LONGEST_MOTION:g} s, or 0 for as it comes"
        )
    torque, speed = (fields.get(name, 0.0) or 1.0 for name in ("torque_share", "speed_share"))
    if not (0.0 < torque <= 1.0 and 0.0 < speed <= 1.0):
        raise GoalRefused(f"torque_share {torque}, speed_share {speed}: expected numbers above 0, at most 1")
    via, radii = _read_via(exact, fields.get("blend_radius", 0.0))
    return Goal(x, y, assembly, mode1, mode2, duration, torque, speed, via, radii)


def _read_via(fields: Mapping[str, float], radius: float) -> tuple[tuple[Point, ...], tuple[float, ...]]:
    """Return the via points of a request and their blend radii (m), `radius` unless one has its own."""
    numbers = {int(match[1]) for name in fields if (match := VIA_NAME.fullmatch(name))}
    count = len(numbers)
    if numbers != set(range(1, count + 1)) or count > MOST_VIA:
        raise GoalRefused(f"via points {sorted(numbers)}: expected them numbered from 1, at most {MOST_VIA}")
    if radius != 0.0 and not count:
        raise GoalRefused(f"blend_radius {radius}: expected with via points, whose corners are rounded")
    via, radii = [], []
    for number in range(1, count + 1):
        x, y, own = (fields.get(f"via{number}_{field}", math.nan) for field in ("x", "y", "blend_radius"))
        if not (math.isfinite(x) and math.isfinite(y)):
            raise GoalRefused(f"via point {number} ({x}, {y}): expected finite coordinates in m")
        via.append((x, y))
        radii.append(radius if math.isnan(own) else own)
        problem = blend_radius_problem(radii[-1])
        if problem is not None:
            raise GoalRefused(f"blend_radius {radii[-1]} at via point {number}: {problem}")
    return tuple(via), tuple(radii)


def via_fields(via: Sequence[Point], blend_radius: Sequence[float]) -> dict[str, float]:
    """Return via points with a blend radius each (m) as fields of a request."""
    fields: dict[str, float] = {}
    for number, ((x, y), radius) in enumerate(zip(via, blend_radius, strict=True), start=1):
        fields |= {f"via{number}_x": x, f"via{number}_y": y, f"via{number}_blend_radius": radius}
    return fields


def _sign(name: str, value: float) -> int:
    if value not in (-1.0, 0.0, 1.0):
        raise GoalRefused(f"{name} {value}: expected 1, -1, or 0 for as it comes")
    return int(value)


class MotionQueue:
    """Gives the reference of every sample, and takes a request whenever the robot is to be at rest.

    Its methods take numbers of samples of the reference. Nothing here plans: a goal becomes a planning request, and the
    motion that answers it begins at a sample that is still to come, from where the reference rests.
    """

    def __init__(self, plan: Plan, rate_hz: int) -> None:
        """Begin with a plan."""
        self._rate_hz = rate_hz
        self._working_mode = plan.mode
        self._through_type1 = bool(plan.modes)
        self._motion = ScheduledPath(plan.path, 0)
        self._before = self._motion
        self._requested = False
        self._window: tuple[Platform, ...] = ()
        self._window_first = 0
        self._announced: tuple[int, tuple[float, ...]] = (0, ())

    def announced(self, sample: int) -> tuple[float, ...]:
        """Return the references of the motion that begins, or changes, with a sample; nothing where none does."""
        first, references = self._announced
        return references if sample == first else ()

    def at(self, sample: int) -> Platform:
        """Return the reference of a sample."""
        motion = self._motion if sample >= self._motion.first else self._before
        return motion.path.at((sample - motion.first) / self._rate_hz)

    def window(self, sample: int, ahead: int) -> tuple[Platform, ...]:
        """Return the references of a sample and of those that follow.

        Of a window that follows the last one only the end is evaluated.
        """
        if len(self._window) == ahead + 1 and sample == self._window_first + 1:
            self._window = (*self._window[1:], self.at(sample + ahead))
        elif len(self._window) != ahead + 1 or sample != self._window_first:
            self._window = tuple(self.at(number) for number in range(sample, sample + ahead + 1))
        self._window_first = sample
        return self._window

    def resting_from(self) -> int:
        """Return the first sample from which on the reference rests."""
        return self._motion.first + self._motion.path.samples(self._rate_hz)

    def request(self, sample: int, goal: Goal) -> PlanningRequest:
        """Return what to plan for a request that comes at a sample; no other is taken until `begin` or `cancel`.

        Raises:
            GoalRefused: the robot is still moving, another request is being planned, or the request cannot be met.
        """
        place = self.resting_place(sample)
        mode = (goal.mode1 or self._working_mode[0], goal.mode2 or self._working_mode[1])
        if mode != self._working_mode:
            raise GoalRefused(
                f"working mode ({mode[0]:+d}, {mode[1]:+d}) is reached only through a Type 1 singularity from"
                f" ({self._working_mode[0]:+d}, {self._working_mode[1]:+d})"
            )
        self.reserve()
        return PlanningRequest(
            place,
            self._working_mode,
            (goal.x, goal.y),
            goal.assembly,
            goal.duration,
            goal.torque_share,
            goal.speed_share,
            via=goal.via,
            blend_radius=goal.blend_radius,
        )

    def resting_place(self, sample: int) -> Point:
        """Return where the robot rests (m) when a request comes at a sample.

        Raises:
            GoalRefused: it takes no requests, is still moving, or another request is being planned.
        """
        if self._through_type1:
            raise GoalRefused("requests are not taken after a motion with working_modes")
        if self._requested:
            raise GoalRefused("another request is being planned")
        rest = self.resting_from()
        if sample < rest:
            raise GoalRefused(f"the robot is moving for another {(rest - sample) / self._rate_hz:.2f} s")
        place = self.at(sample)
        return place.x, place.y

    def reserve(self) -> None:
        """Take no other request until `begin` or `cancel`."""
        self._requested = True

    def begin(self, sample: int, path: Path, references: tuple[float, ...] = ()) -> None:
        """Follow a path, whose references may be given in one row, from a sample on.

        Raises:
            GoalRefused: nothing was ordered, the robot is not at rest by then, or the path begins elsewhere.
        """
        if not self._requested or sample < self.resting_from():
            raise GoalRefused("there is no request that this motion could answer")
        self._requested = False
        here, there = self.at(sample), path.at(0.0)
        if math.dist((here.x, here.y), (there.x, there.y)) > SAME_PLACE:
            raise GoalRefused("the motion does not begin where the reference rests")
        self._before, self._motion = self._motion, ScheduledPath(path, sample)
        self._window = ()
        self._announced = (sample, references)

    def under_way(self, sample: int) -> ScheduledPath | None:
        """Return the motion of a sample, None where the reference rests."""
        return None if sample >= self.resting_from() or self._through_type1 else self._motion

    @property
    def working_mode(self) -> tuple[int, int]:
        """The working mode of every motion."""
        return self._working_mode

    def stop(self, path: Path, sample: int = 0, references: tuple[float, ...] = ()) -> None:
        """Follow another path in the place of the one under way, which is the same up to samples that are to come.

        Its references, in one row, may be given to be announced with one of these samples.
        """
        self._motion = self._motion._replace(path=path)
        self._window = ()
        self._announced = (sample, references)

    def rest_at(self, sample: int, x: float, y: float) -> None:
        """Rest at (x, y) m from a sample on, where a fault has left the robot; a request is withdrawn."""
        self._requested = False
        self._before = self._motion = ScheduledPath(StandingStill(x, y), sample)
        self._window = ()

    def cancel(self) -> None:
        """Withdraw the request: its planning has failed."""
        self._requested = False


class StandingStill(NamedTuple):
    """A place (m) in the place of a path."""

    x: float
    y: float

    def at(self, t: float) -> Platform:
        """Return the reference at any time."""
        return Platform(self.x, self.y, 0.0, 0.0, 0.0, 0.0)

    def samples(self, rate_hz: int) -> int:
        """Return that it takes no time."""
        return 0


class ScheduledPath(NamedTuple):
    """A path, and the sample at which it begins."""

    path: Path | StandingStill
    first: int
