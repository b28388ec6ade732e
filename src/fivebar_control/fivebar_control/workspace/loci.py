# SPDX-License-Identifier: Apache-2.0
"""The singular loci as curves of postures, exact along their whole length.

Every singular posture is a point on a circle that a leg has to reach, which it does in two ways:

- Type 1, leg i stretched or folded: the platform is on a circle around O_i, and the other leg reaches it;
- Type 2, distal links aligned: elbow 1 is on a circle around O_1, and leg 2 reaches it with a distal link as long as
  both together (stretched) or as their difference (folded).

So the curves need neither a grid nor contouring, pass through Type 3 without a gap, and follow the locus where it
touches the boundary of the workspace, where det A has an infinite slope.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.model.geometry import leg_angles, leg_cosine, wrap
from fivebar_control.model.kinematics import assembly_mode, det_a, elbow_side, state_from_joints
from fivebar_control.model.singularity import DistalLinks
from fivebar_control.model.state import JointAngles, State, WorkingMode
from fivebar_control.root_search import zero_between
from fivebar_description.parameters import FiveBar, LegParameters

FloatArray = NDArray[np.float64]
Sign = Literal[-1, 1]
Shape = DistalLinks

SAMPLES = 1440
"""Postures per closed curve."""

FIRST = 0.3217
"""Where sampling starts along a closed curve (rad): symmetric robots have their special postures elsewhere."""

SAME_LENGTH = 1e-9
"""Lengths (m) that differ by less are equal."""


class Curve(NamedTuple):
    """A piece of a locus: joints [n, 4] = q11, q12, q21, q22 in rad and platform [n, 2] = x, y in m."""

    joints: FloatArray
    platform: FloatArray

    @property
    def length(self) -> float:
        """The platform's way along the curve (m)."""
        return float(np.sum(np.hypot(*np.diff(self.platform, axis=0).T)))


class Type1(NamedTuple):
    """A piece of the Type 1 locus: one leg stretched or folded, on one side of det A = 0."""

    leg: int
    shape: Shape
    assembly: Sign
    curve: Curve


class Type2(NamedTuple):
    """A piece of the Type 2 locus: distal links stretched or folded onto each other, in one working mode."""

    shape: Shape
    working_mode: WorkingMode
    curve: Curve


class Type3(NamedTuple):
    """A posture on both loci: leg `leg` stretched or folded, and the distal links aligned.

    Two working modes meet here. Joints in rad, platform in m.
    """

    leg: int
    shape: Shape
    distal_links: Shape
    joints: JointAngles
    x: float
    y: float
    working_modes: tuple[tuple[int, int], tuple[int, int]]


class Loci(NamedTuple):
    """All singular postures of one robot."""

    type1: list[Type1]
    type2: list[Type2]
    type3: list[Type3]


ROUNDING, SLACK = 1e-16, 1e-6
"""Angles (rad) that may differ by rounding alone, and that are not distinguished where a leg just reaches."""

Closed = Callable[[float], JointAngles]
"""Joint angles (rad) along a closed curve, for s in rad with period 2 pi."""


def singular_loci(robot: FiveBar, samples: int = SAMPLES) -> Loci:
    """Return the three loci, with `samples` postures along each closed curve."""
    type1 = [
        Type1(leg, shape, _assembly(robot, piece), piece)
        for leg in (1, 2)
        for shape in SHAPES
        for closed in type1_curves(robot, leg, shape)
        for piece in _pieces(robot, closed, _turning_points(robot, closed, samples, det_a), samples)
    ]
    type2: list[Type2] = []
    type3: list[Type3] = []
    for shape in SHAPES:
        for closed in type2_curves(robot, shape):
            turns = {
                s: leg
                for leg, bend in ((1, _bend_1), (2, _bend_2))
                for s in _turning_points(robot, closed, samples, bend)
            }
            pieces = _pieces(robot, closed, sorted(turns), samples)
            type2 += [Type2(shape, _working_mode(piece), piece) for piece in pieces]
            type3 += [_type3(robot, leg, shape, closed(s)) for s, leg in sorted(turns.items())]
    return Loci(type1, type2, type3)


SHAPES: tuple[Shape, Shape] = ("stretched", "folded")


def type1_curves(robot: FiveBar, leg: int, shape: Shape) -> list[Closed]:
    """Return the closed curves on which a leg is stretched or folded; none where the other leg cannot follow."""
    own, other = (robot.leg1, robot.leg2) if leg == 1 else (robot.leg2, robot.leg1)
    bend = 0.0 if shape == "stretched" else math.pi
    radius = own.proximal + (own.distal if shape == "stretched" else -own.distal)

    def posture(angle: float, side: int) -> JointAngles:
        x, y = _on_circle(own.base_x, radius, angle)
        q1, q2 = leg_angles(other, side, x, y)
        turned = wrap(angle)
        return JointAngles(turned, bend, q1, q2) if leg == 1 else JointAngles(q1, q2, turned, bend)

    return [_along(way, posture) for way in _ways_around(own.base_x, radius, other)]


def type2_curves(robot: FiveBar, shape: Shape) -> list[Closed]:
    """Return the closed curves on which the distal links are stretched or folded; none where that cannot be."""
    own, other = robot.leg1, robot.leg2
    longer = 1.0 if other.distal > own.distal else -1.0
    span = own.distal + other.distal if shape == "stretched" else abs(own.distal - other.distal)
    if span < SAME_LENGTH:
        return _elbows_together(robot)
    bridge = other._replace(distal=span)

    def posture(angle: float, side: int) -> JointAngles:
        q21, bend = leg_angles(bridge, side, *_on_circle(own.base_x, own.proximal, angle))
        toward_elbow_1 = q21 + bend
        if shape == "stretched":
            theta1, theta2 = toward_elbow_1 + math.pi, toward_elbow_1
        else:
            theta1 = theta2 = toward_elbow_1 if longer > 0.0 else toward_elbow_1 + math.pi
        return JointAngles(wrap(angle), wrap(theta1 - angle), q21, wrap(theta2 - q21))

    return [_along(way, posture) for way in _ways_around(own.base_x, own.proximal, bridge)]


def _elbows_together(robot: FiveBar) -> list[Closed]:
    """Equal distal links are folded where both elbows are in one place; the platform is then free on a circle."""
    own, other = robot.leg1, robot.leg2
    curves: list[Closed] = []
    for side in (1, -1):
        q11, bend = leg_angles(own._replace(distal=other.proximal), side, other.base_x, 0.0)
        elbow_x, elbow_y = _on_circle(own.base_x, own.proximal, q11)
        q21 = math.atan2(elbow_y, elbow_x - other.base_x)
        # with the bend straight the two places are one
        if not math.isnan(q11) and (side > 0 or abs(math.sin(bend)) > SAME_LENGTH):
            curves.append(partial(_around_elbows, q11, q21))
    return curves


def _around_elbows(q11: float, q21: float, s: float) -> JointAngles:
    return JointAngles(q11, wrap(s - q11), q21, wrap(s - q21))


class _Way(NamedTuple):
    """A way around a circle: all of it with the elbow on one side, or an arc out on one side and back on the other."""

    start: float
    end: float
    side: int

    def at(self, s: float) -> tuple[float, int]:
        """Return the angle on the circle (rad) and the elbow's side."""
        s = s % (2.0 * math.pi)
        if self.side:
            return s, self.side
        middle, half = 0.5 * (self.start + self.end), 0.5 * (self.end - self.start)
        return min(max(middle - half * math.cos(s), self.start), self.end), 1 if s < math.pi else -1


def _along(way: _Way, posture: Callable[[float, int], JointAngles]) -> Closed:
    """Return the postures along a way; at its ends, where rounding may put them out of reach, the nearest in reach."""

    def at(s: float) -> JointAngles:
        angle, side = way.at(s)
        q, step = posture(angle, side), ROUNDING
        while any(map(math.isnan, q)) and step < SLACK:
            before, after = posture(angle - step, side), posture(angle + step, side)
            q, step = after if any(map(math.isnan, before)) else before, 2.0 * step
        return q

    return at


def _on_circle(center_x: float, radius: float, angle: float) -> tuple[float, float]:
    return center_x + radius * math.cos(angle), radius * math.sin(angle)


def _ways_around(center_x: float, radius: float, leg: LegParameters) -> list[_Way]:
    """Return the parts of a circle around (center_x, 0) that a leg reaches.

    From the angle 0 to pi the distance from the leg's base only grows or only shrinks, so at most one arc of it is in
    reach, and the lower half mirrors the upper.
    """

    def over(limit: float, angle: float) -> float:
        return leg_cosine(leg, *_on_circle(center_x, radius, angle)) - limit

    ends = [0.0, math.pi]
    for limit in (-1.0, 1.0):
        outside = [over(limit, end) * limit > 0.0 for end in (0.0, math.pi)]
        if all(outside):
            return []
        if any(outside):
            edge = zero_between(partial(over, limit), 0.0, math.pi, 1e-15)
            ends[outside.index(True)] = edge
    start, end = ends
    if end - start < SLACK:
        return []
    if start > 0.0 and end < math.pi:
        return [_Way(start, end, 0), _Way(-end, -start, 0)]
    if end < math.pi:
        return [_Way(-end, end, 0)]
    if start > 0.0:
        return [_Way(start, 2.0 * math.pi - start, 0)]
    return [_Way(0.0, 2.0 * math.pi, 1), _Way(0.0, 2.0 * math.pi, -1)]


def _state(robot: FiveBar, q: JointAngles) -> State:
    return state_from_joints(robot, *q, 0.0, 0.0, 0.0, 0.0)


def _bend_1(state: State) -> float:
    return state.leg1.sin_q2


def _bend_2(state: State) -> float:
    return state.leg2.sin_q2


def _turning_points(robot: FiveBar, closed: Closed, samples: int, quantity: Callable[[State], float]) -> list[float]:
    """Return where along a closed curve a quantity changes its sign, refined to rounding."""

    def value(s: float) -> float:
        return quantity(_state(robot, closed(s)))

    steps = _steps(samples)
    positive = [value(s) >= 0.0 for s in steps]
    return [
        zero_between(value, low, high, 1e-15)
        for (low, high), (before, after) in zip(pairwise(steps), pairwise(positive), strict=True)
        if before != after
    ]


def _steps(samples: int) -> list[float]:
    steps: list[float] = np.linspace(FIRST, FIRST + 2.0 * math.pi, samples + 1).tolist()
    return steps


def _pieces(robot: FiveBar, closed: Closed, cuts: list[float], samples: int) -> list[Curve]:
    """Return a closed curve as pieces that end at the cuts; the first and the last one meet at its start."""
    marks = np.array(_steps(samples))
    bounds = [marks[0], *cuts, marks[-1]]
    pieces = []
    for low, high in pairwise(bounds):
        inside = marks[(marks > low) & (marks < high)]
        joints = [closed(s) for s in (low, *inside.tolist(), high)]
        places = [_state(robot, q)[2:4] for q in joints]
        pieces.append(Curve(np.array(joints), np.array(places)))
    return pieces


def _middle(curve: Curve) -> JointAngles:
    """Return a posture in the middle of a piece; two are needed where a piece is a single step."""
    if len(curve.joints) > 2:
        return JointAngles(*curve.joints[len(curve.joints) // 2].tolist())
    turn = np.angle(np.exp(1j * (curve.joints[1] - curve.joints[0])))
    return JointAngles(*(curve.joints[0] + 0.5 * turn).tolist())


def _assembly(robot: FiveBar, curve: Curve) -> Sign:
    return 1 if assembly_mode(_state(robot, _middle(curve))) > 0 else -1


def _working_mode(curve: Curve) -> tuple[int, int]:
    q = _middle(curve)
    return elbow_side(math.sin(q.q12)), elbow_side(math.sin(q.q22))


def _type3(robot: FiveBar, leg: int, distal_links: Shape, q: JointAngles) -> Type3:
    state = _state(robot, q)
    if leg == 1:
        side = elbow_side(state.leg2.sin_q2)
        meeting, cosine = ((1, side), (-1, side)), state.leg1.cos_q2
    else:
        side = elbow_side(state.leg1.sin_q2)
        meeting, cosine = ((side, 1), (side, -1)), state.leg2.cos_q2
    shape: Shape = "stretched" if cosine > 0.0 else "folded"
    return Type3(leg, shape, distal_links, q, state.x, state.y, meeting)
