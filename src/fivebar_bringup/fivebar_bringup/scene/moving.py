# SPDX-License-Identifier: Apache-2.0
"""The moving parts of the picture of a run: links, platform and its trail, reference, torques and forces."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from fivebar_bringup.scene.settings import SceneSettings
from fivebar_bringup.scene.shapes import (
    ABOVE,
    BLUE,
    GREEN,
    INK,
    PLANE,
    PURPLE,
    VERMILION,
    Colour,
    Kind,
    Shape,
    arc,
    in_plane,
)
from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.geometry import elbow_position
from fivebar_control.model.kinematics import det_a
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.model.state import State
from fivebar_description.parameters import FiveBar, lost_torque
from fivebar_description.robot_description import LAYERS, link_width

SPACING = 1e-3
"""Distance (m) after which the trail gets another point."""

LONGEST_ARROW = 0.1
"""Length (m) at which an arrow of a force ends, however large the force is."""

LONGEST_TURN = 1.8 * math.pi
"""Arc (rad) at which that of a torque ends, however large the torque is."""

ARC_RADIUS = 0.035

LINK_COLOURS = (BLUE, VERMILION)


class SceneSample(NamedTuple):
    """The known values of one sample.

    Attributes:
        state: of the robot.
        torque: of both motors (Nm), None where it is unknown.
        reference: place (m) where the platform should be, None where it is unknown.
    """

    state: State
    torque: tuple[float, float] | None = None
    reference: tuple[float, float] | None = None


class Trail:
    """Where the platform has been, coloured by the assembly mode; a limited number of points."""

    def __init__(self, length: int) -> None:
        """Begin an empty trail of at most so many points."""
        self._places: deque[tuple[float, float]] = deque(maxlen=length)
        self._colours: deque[Colour] = deque(maxlen=length)

    def __len__(self) -> int:
        return len(self._places)

    def add(self, state: State) -> None:
        """Add the platform's place, unless it has hardly moved since the last one."""
        place = state.x, state.y
        if self._places and math.dist(self._places[-1], place) < SPACING:
            return
        self._places.append(place)
        self._colours.append(assembly_colour(state))

    def clear(self) -> None:
        """Forget all."""
        self._places.clear()
        self._colours.clear()

    def shape(self) -> Shape:
        """Return it as a line."""
        points = in_plane(self._places, PLANE + 0.001) if len(self._places) > 1 else ()
        return Shape("trail", 0, Kind.LINE_STRIP, points, BLUE, 0.0015, tuple(self._colours) if points else ())


def assembly_colour(state: State) -> Colour:
    """Return the colour of the assembly mode, as in the reports."""
    return BLUE if det_a(state) >= 0.0 else VERMILION


def moving_shapes(robot: FiveBar, moment: SceneSample, settings: SceneSettings) -> list[Shape]:
    """Return the shapes of one moment; those whose quantity is unknown have no points."""
    return [
        *_links(robot, moment.state),
        *_torques(robot, moment, settings),
        *_forces(robot, moment, settings),
        _reference(moment),
        _words(moment.state),
    ]


def _links(robot: FiveBar, state: State) -> list[Shape]:
    """Return links as lines between the middles of their joints, in the layers of the URDF, and joints as spheres."""
    width = link_width(robot)
    shapes = []
    for index, (leg, angles) in enumerate(((robot.leg1, state.leg1), (robot.leg2, state.leg2))):
        elbow = elbow_position(leg, angles.q1)
        end = elbow[0] + leg.distal * angles.u_x, elbow[1] + leg.distal * angles.u_y
        lower = in_plane(((leg.base_x, 0.0), elbow), LAYERS.proximal[index])
        upper = in_plane((elbow, end), LAYERS.distal[index])
        shapes += [
            Shape("links", 2 * index, Kind.LINE_STRIP, lower, LINK_COLOURS[index], width),
            Shape("links", 2 * index + 1, Kind.LINE_STRIP, upper, LINK_COLOURS[index], 0.7 * width),
            Shape("joints", index, Kind.SPHERES, (*lower, upper[0]), INK, 0.8 * width),
        ]
    platform = in_plane(((state.x, state.y),), LAYERS.tool)
    return [*shapes, Shape("platform", 0, Kind.SPHERES, platform, assembly_colour(state), 1.3 * width)]


def _torques(robot: FiveBar, moment: SceneSample, settings: SceneSettings) -> list[Shape]:
    """Return the torque of each motor as an arc with an arrow's head, from the direction of its proximal link."""
    shapes = []
    for index, (leg, angles) in enumerate(((robot.leg1, moment.state.leg1), (robot.leg2, moment.state.leg2))):
        torque = moment.torque[index] if moment.torque is not None else 0.0
        turn = _limited(settings.torque_turn * torque, LONGEST_TURN)
        points = arc(leg.base_x, 0.0, ARC_RADIUS, angles.q1, turn, ABOVE)
        shapes.append(Shape("torques", index, Kind.LINE_STRIP, points, INK, 0.003))
    return shapes


def _forces(robot: FiveBar, moment: SceneSample, settings: SceneSettings) -> list[Shape]:
    """Return the forces of the distal links on the platform, and their sum, by the model."""
    state = moment.state
    arrows: list[tuple[float, float]] = [(0.0, 0.0)] * 3
    if moment.torque is not None:
        friction = (
            lost_torque(robot, robot.leg1, state.leg1.q1, state.leg1.dq1),
            lost_torque(robot, robot.leg2, state.leg2.q1, state.leg2.dq1),
        )
        motion = direct_dynamics(robot, state, *moment.torque, *friction)
        arrows = [
            (motion.lambda1 * state.leg1.u_x, motion.lambda1 * state.leg1.u_y),
            (motion.lambda2 * state.leg2.u_x, motion.lambda2 * state.leg2.u_y),
            (robot.mass * motion.ax, robot.mass * motion.ay),
        ]
    return [
        Shape("forces", number, Kind.ARROW, _arrow(state, force, settings.force_length), colour, 0.004)
        for number, (force, colour) in enumerate(zip(arrows, (*LINK_COLOURS, GREEN), strict=True))
    ]


def _arrow(state: State, force: tuple[float, float], scale: float) -> tuple[tuple[float, float, float], ...]:
    length = math.hypot(*force) * scale
    if not length > 0.0:
        return ()
    share = scale * min(1.0, LONGEST_ARROW / length)
    return in_plane(((state.x, state.y), (state.x + share * force[0], state.y + share * force[1])), ABOVE)


def _reference(moment: SceneSample) -> Shape:
    points = in_plane((moment.reference,), PLANE + 0.002) if moment.reference is not None else ()
    return Shape("reference", 0, Kind.SPHERES, points, PURPLE, 0.006)


def _words(state: State) -> Shape:
    sign = "+" if det_a(state) >= 0.0 else "-"
    text = f"1/cond(A) = {inverse_condition(state):.3f}, assembly mode {sign}"
    return Shape("text", 0, Kind.TEXT, ((0.0, -0.06, ABOVE),), INK, 0.01, text=text)


def _limited(value: float, limit: float) -> float:
    return min(limit, max(-limit, value))
