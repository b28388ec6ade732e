# SPDX-License-Identifier: Apache-2.0
"""The run's file as far as it decides the motion: where the platform goes and when, and which controller follows.

Nodes that need no more than that read it so, and leave the other keys to those that have them.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from itertools import chain
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import ConfigDict, Field, PrivateAttr, model_validator

from fivebar_control.estimation.settings import Drives
from fivebar_control.laws.registry import (
    CONTROLLERS,
    OF_CONTROLLER,
    Controller,
    controller_problem,
    find_controller,
    goal_controllers,
    stays_unopened,
    unopened_controller,
)
from fivebar_control.trajectory.planner import Plan, PlanRefused, plan_motion
from fivebar_control.trajectory.rounded import BLEND_RADIUS
from fivebar_control.trajectory.time_laws import QUINTIC, TimeLawName
from fivebar_control.trajectory.zones import ZoneSettings
from fivebar_description.errors import InputError, quoted
from fivebar_description.parameters import FiveBar, laden
from fivebar_description.physical_bounds import Duration
from fivebar_description.robot_file import RobotFile, load_robot
from fivebar_description.scenario_file import DEFAULT_ROBOT, ESTIMATOR, with_parts_of_robot
from fivebar_description.settings import Keys, Section, Setting
from fivebar_description.shared_settings import DRIVE_TORQUE_LIMIT, WORKING_MODE, RateHz, Robot
from fivebar_description.strict_yaml import StrictModel

if TYPE_CHECKING:
    from fivebar_control.planning.figures import Feasibility
    from fivebar_control.planning.orders import TrajectoryRequest
    from fivebar_control.planning.trajectory_file import FollowedFile

Sign = Literal[-1, 1]
Pair = Annotated[tuple[float, float], Field(strict=False)]
Mode = Annotated[tuple[Sign, Sign], WORKING_MODE]


def _ends_in_signs(place: tuple[float, ...]) -> str | None:
    return None if all(sign in (-1.0, 1.0) for sign in place[2:]) else "expected x, y, and two signs, each +1 or -1"


DECLARED, SEEN = "declared", "seen"
"""How the place and the modes are known in which the robot starts."""

CONTROLLER = Setting(
    "Controller of the run, such as multi_cartesian or unified (`fivebar compare --help` names all), or"
    " my_package.my_law:LAW for a law from elsewhere.",
    check=controller_problem,
)

_planned = functools.lru_cache(maxsize=16)(plan_motion)
"""The planner, which a run asks for its plan again and again."""


def _with_ends(content: Any) -> Any:
    """Return a scenario's content with what follows from its trajectory: where it starts and ends, and its duration.

    What cannot be read is left for the checks of the keys.

    Raises:
        InputError: the file is no trajectory, or does not say where the platform starts.
    """
    name = content.get("trajectory") if isinstance(content, Mapping) else None
    if not (isinstance(name, str) and name):
        return content
    # here, because few files follow another one
    from fivebar_control.planning.timed_points import end_of
    from fivebar_control.planning.trajectory_file import FollowedFile, TrajectoryFile, points_in, request_of

    file = TrajectoryFile.at(name)
    points, declared = points_in(file), content.get("waypoints")
    begin = declared[0] if isinstance(declared, list | tuple) and declared else points.start()
    if begin is None:
        raise InputError(f"waypoints: expected where the platform starts, [[x, y]]: {name} does not say so")
    if not (
        isinstance(begin, list | tuple)
        and len(begin) == 2
        and all(isinstance(coordinate, float | int) for coordinate in begin)
    ):
        return content
    mode = content.get("working_mode", [1, -1])
    if not (isinstance(mode, list | tuple) and len(mode) == 2 and all(sign in (-1, 1) for sign in mode)):
        return content
    robot = load_robot(content.get("robot", DEFAULT_ROBOT))
    followed = FollowedFile(file, (float(begin[0]), float(begin[1])), (int(mode[0]), int(mode[1])))
    request = request_of(robot, followed)
    waypoints = [list(followed.place), list(end_of(robot, request))]
    if declared is not None and len(declared) > 1 and [list(point) for point in declared] != waypoints:
        raise InputError(f"waypoints: {quoted(declared)}: expected with a trajectory where the platform starts alone")
    return {"segment_duration": request.duration, **content, "waypoints": waypoints}


class MotionFile(StrictModel):
    """The keys of a run's file that decide the motion; the others are not read."""

    model_config = ConfigDict(extra="ignore")

    controller: Annotated[str, CONTROLLER] = "multi_cartesian"
    robot: Robot = "dextar"
    working_mode: Mode = (1, -1)
    working_modes: Annotated[
        tuple[Mode, ...] | None,
        Setting("The working mode at each waypoint, for motions that may meet Type 1; controller `unified` only."),
    ] = None
    waypoints: Annotated[
        tuple[Pair, ...],
        Setting(
            "The points x, y through which the platform goes, at rest in each that `blend_radius` does not round, from"
            " where it starts; with `start: seen` those after the start.",
            "m",
        ),
    ]
    trajectory: Annotated[
        str,
        Setting(
            "A CSV file with times and positions of the platform or the motors, by its path: the motion goes through"
            " its rows at their times. `waypoints` are then where it starts, by default the place of the first row, and"
            " where it ends; `segment_duration` is that of the file."
        ),
    ] = ""
    start: Annotated[
        str,
        Setting(
            "How the place and the modes at the start are known: declared by the first waypoint and working_mode, or"
            " seen by the camera before the motion is planned.",
            choices=(DECLARED, SEEN),
        ),
    ] = DECLARED
    stands: Annotated[
        Annotated[tuple[float, float, float, float], Field(strict=False)] | None,
        Setting(
            "Where the simulated robot is put: x, y (m) and its working mode; by default where the motion begins. The"
            " planner does not know it.",
            check=_ends_in_signs,
        ),
    ] = None
    segment_duration: Annotated[
        Duration | Annotated[tuple[Duration, ...], Field(strict=False)],
        Setting("Duration of each segment: one number for all, or a list with one per segment.", "s"),
    ] = 1.0
    time_law: TimeLawName = QUINTIC
    blend_radius: Annotated[float | Annotated[tuple[float, ...], Field(strict=False)], BLEND_RADIUS] = 0.0
    rate_hz: RateHz = 500
    zone: Section[ZoneSettings] = ZoneSettings()
    plant: Annotated[Drives, Keys(others=True)] = Drives(torque_limit=DRIVE_TORQUE_LIMIT)
    estimator: Annotated[str, ESTIMATOR] = "none"
    _law_unopened: bool = PrivateAttr(default=False)
    _payload: float = PrivateAttr(default=0.0)

    @model_validator(mode="before")
    @classmethod
    def _sized(cls, content: Any) -> Any:
        return _with_ends(cls._with_robot(content)[0])

    @classmethod
    def _with_robot(cls, content: Any) -> tuple[Any, RobotFile | None]:
        """Return the content with what follows from the robot's file where it leaves that out, and the file."""
        return with_parts_of_robot(content)

    @model_validator(mode="after")
    def _goes_somewhere(self) -> MotionFile:
        self._law_unopened = stays_unopened(self.controller)
        seen = self.start == SEEN
        if len(self.waypoints) < (1 if seen else 2):
            raise ValueError(f"waypoints: {len(self.waypoints)} given: expected at least {'one' if seen else 'two'}")
        if seen and self.working_modes is not None:
            raise ValueError("start: seen: the working mode is not known before: expected no working_modes")
        return self

    @model_validator(mode="after")
    def _follows_a_file(self) -> MotionFile:
        if not self.trajectory:
            return self
        usual = type(self).model_fields
        for key in ("time_law", "blend_radius", "working_modes", "start"):
            if getattr(self, key) != usual[key].default:
                raise ValueError(f"{key}: {getattr(self, key)!r}: a trajectory says itself how it moves: leave it out")
        if not self.scheme().takes_goals:
            able = " or ".join(goal_controllers())
            raise ValueError(f"trajectory: controller {self.controller} follows no trajectories: expected {able}")
        if self.durations() != (self._request().duration,):
            raise ValueError("segment_duration: a trajectory says itself how long it takes: leave it out")
        return self

    @model_validator(mode="after")
    def _may_meet_type1(self) -> MotionFile:
        if self.working_modes is None:
            return self
        if self.rounded:
            raise ValueError("blend_radius: a motion with working_modes rests at each waypoint: expected 0")
        if len(self.working_modes) != len(self.waypoints):
            raise ValueError(
                f"working_modes: {len(self.working_modes)} given for {len(self.waypoints)} waypoints:"
                " expected one pair of signs per waypoint"
            )
        if self.working_modes[0] != self.working_mode:
            raise ValueError(
                f"working_modes: begins with {list(self.working_modes[0])}: expected the working_mode"
                f" {list(self.working_mode)}, in which the robot starts"
            )
        if not self.scheme().meets_type_1:
            able = ", ".join(controller.name for controller in CONTROLLERS.values() if controller.meets_type_1)
            raise ValueError(
                f"working_modes: controller {self.controller} cannot meet Type 1: expected controller {able}"
            )
        if self.estimated:
            raise ValueError(
                "working_modes: estimator ekf follows the platform in one working mode: expected estimator none"
            )
        return self

    def durations(self) -> tuple[float, ...]:
        """Return one duration (s) per segment.

        Raises:
            PlanRefused: a list was given whose length is not the number of segments.
        """
        segments = len(self.waypoints) - 1
        if isinstance(self.segment_duration, float | int):
            return (float(self.segment_duration),) * segments
        if len(self.segment_duration) != segments:
            raise PlanRefused(
                f"segment_duration: {len(self.segment_duration)} given for {segments} segments:"
                " expected one number or one per segment"
            )
        return self.segment_duration

    def blend_radii(self) -> tuple[float, ...]:
        """Return the blend radius (m) at each waypoint between the first and the last, or one number for all."""
        return (float(self.blend_radius),) if isinstance(self.blend_radius, float | int) else self.blend_radius

    @property
    def rounded(self) -> bool:
        """Whether the path rounds corners."""
        return any(self.blend_radii())

    def five_bar(self) -> FiveBar:
        """Return the robot that the controllers believe in."""
        robot = load_robot(self.robot)
        return laden(robot, self._payload) if self._payload else robot

    def carrying(self, payload: float) -> Self:
        """Return the same with a payload (kg) on the platform from the start on, of which the file says nothing."""
        copy = self.model_copy()
        copy._payload = payload
        return copy

    def plan(self) -> Plan:
        """Return the checked motion.

        Raises:
            PlanRefused: the motion cannot be made.
        """
        if self.trajectory:
            from fivebar_control.planning.trajectory_file import plan_file

            return plan_file(self.five_bar(), self._followed(), self.rate_hz)
        plan = _planned(
            self.five_bar(),
            self.signs(),
            self.waypoints,
            self.durations(),
            self.rate_hz,
            self.zone.as_rule(),
            self.time_law,
            self.min_authority,
            self.blend_radii(),
        )
        if any(meeting.leg == 2 for meeting in plan.meetings):
            raise PlanRefused(
                "working_modes: leg 2 meets Type 1, but it carries the IMU, whose check follows one working mode of"
                " that leg: expected only leg 1 to be stretched"
            )
        return plan

    def _followed(self) -> FollowedFile:
        from fivebar_control.planning.trajectory_file import FollowedFile, TrajectoryFile

        file = TrajectoryFile.at(self.trajectory)
        return FollowedFile(file, self.waypoints[0], self.working_mode, self._payload)

    def _request(self) -> TrajectoryRequest:
        from fivebar_control.planning.trajectory_file import request_of

        return request_of(self.five_bar(), self._followed())

    def refuse_infeasible(self, verdict: Feasibility) -> None:
        """Refuse the motion where a limit is broken, naming rows of its trajectory where it has one.

        Raises:
            PlanRefused: a limit is broken.
        """
        if self.trajectory:
            from fivebar_control.planning.point_planning import refuse_infeasible

            refuse_infeasible(self._request(), verdict)
        elif not verdict.feasible:
            raise PlanRefused("; ".join(verdict.reasons))

    def signs(self) -> tuple[int, ...]:
        """Return the working mode as the planner takes it: two signs, or two for every waypoint."""
        return self.working_mode if self.working_modes is None else tuple(chain.from_iterable(self.working_modes))

    @property
    def estimated(self) -> bool:
        """Whether the controllers work from the two motors' encoders alone."""
        return self.estimator == "ekf"

    @property
    def lead_samples(self) -> int:
        """Samples from a measurement to the moment that its answer is for: an estimator predicts over the delay."""
        return self.plant.delay_samples if self.estimated else 0

    @property
    def min_authority(self) -> float:
        """Least |n . v1| of a crossing that the controller can take."""
        return self.scheme().min_authority

    def scheme(self) -> Controller:
        """Return how the controller is put together."""
        controller = unopened_controller(self.controller) if self._law_unopened else find_controller(self.controller)
        chosen = self.zone.supervision
        return (
            controller if chosen == OF_CONTROLLER or not controller.blended else controller._replace(weighting=chosen)
        )

    @property
    def law_unopened(self) -> bool:
        """Whether the controller is a law from elsewhere whose module was not imported: see `modules_unopened`."""
        return self._law_unopened
