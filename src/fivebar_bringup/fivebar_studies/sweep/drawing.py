# SPDX-License-Identifier: Apache-2.0
"""Draws random crossings: each from its number alone, so that any of them can be repeated without the others."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache, lru_cache
from typing import Any, NamedTuple

import numpy as np

from fivebar_bringup.odds.odds import PEAK_LIMIT
from fivebar_bringup.odds.robot_errors import (
    NO_ERRORS,
    RobotErrors,
    Scales,
    drawn_effects,
    drawn_gyro_bias,
    drawn_scales,
    with_sections,
)
from fivebar_bringup.scenario import Scenario
from fivebar_control.laws.registry import find_controller
from fivebar_control.laws.robot_sizes import ROBUST_WEIGHT, size_ratio, torque_ratio
from fivebar_control.model.geometry import workspace_bounds, workspace_margin
from fivebar_control.planning.alternative_courses import TimedCourse
from fivebar_control.planning.postures import WORKING_MODES, place_at
from fivebar_control.trajectory.planner import Plan
from fivebar_control.trajectory.time_laws import QUINTIC
from fivebar_description.known_drives import USUAL_TORQUE_LIMIT
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import load_robot, read_robot
from fivebar_description.strict_yaml import validate
from fivebar_studies.rigs.named import find_rig
from fivebar_studies.rigs.proportion import in_proportion

ROBOT = "dextar"
"""Robot whose crossings are drawn without a rig."""

RATE_HZ = 500

SHORTEST, LONGEST = 0.3, 3.0
"""Durations (s)."""

SPREAD = 0.15
"""Mass, inertia and friction differ from the model's by at most this share."""

ENCODERS = (None, 8192, 20_000, 65_536)
"""Counts per revolution; None: exact sensors on all four joints, and no estimator."""

DELAYS = (0, 1)
"""Samples between a command and its effect."""

VARIED = ""
"""In place of a rig: robots that differ in mass, inertia and friction only, with any of the encoders and delays."""

BASES = "ideal", "encoders"
"""Rigs whose settings the cases without a rig have."""

PLANNED_FOR = "unified"
"""For whose law the planner plans and times a crossing; all controllers make the same motion. It needs neither a
direction across the path nor rests outside of blending zones: what others need besides, their screens ask for."""

XY = tuple[float, float]


@cache
def torque_limit_of(robot: str) -> float:
    """Return the torque limit (Nm) of a robot's drives, by the name of its file."""
    return read_robot(robot).drives.torque_limit or USUAL_TORQUE_LIMIT


@cache
def torque_step_of(robot: str) -> float:
    """Return the steps (Nm) in which the drives of a robot without a rig are commanded, in proportion to its torque."""
    return float(find_rig("encoders").plant["torque_quantum"]) * torque_ratio(read_robot(robot))


def robot_of(rig: str) -> str:
    """Return the robot of a rig, that of the cases without one where `rig` is `VARIED`."""
    return ROBOT if rig == VARIED else find_rig(rig).robot


def tolerance_of(rig: str) -> float:
    """Return the distance (m) from its reference within which a robot of a rig succeeds."""
    return float(find_rig(rig).scenario.get("error_tolerance", PEAK_LIMIT))


def weight_of(rig: str, robot: str = "") -> float:
    """Return the torque weight of unified on a rig, or else on a robot of another torque ((m/s^2 / Nm)^2)."""
    if robot:
        return _own_weight(robot)
    sections = {} if rig == VARIED else find_rig(rig).scenario
    return float(sections.get("unified", {}).get("weight", ROBUST_WEIGHT))


class DrawnScenario(Scenario):
    """A scenario whose motion is planned for `PLANNED_FOR`, whichever controller makes it.

    It reads the robot's file once in a process, not once in a run.
    """

    def five_bar(self) -> FiveBar:
        """Return the robot as the controllers model it."""
        return _robot(self.robot)

    @property
    def min_authority(self) -> float:
        """Least |n . v1| of a crossing that the planner lets pass."""
        return find_controller(PLANNED_FOR).min_authority


class Draw(NamedTuple):
    """A random crossing.

    Attributes:
        number: of the case.
        mode1, mode2: working mode.
        start_x, start_y, end_x, end_y: rest points (m) in different assembly modes.
        duration: of the straight segment between them (s).
        mass_scale, inertia_scale, friction_scale: actual over modelled.
        encoder_counts: per revolution, None for exact sensors.
        delay_samples: of the drives.
        rig: whose robots are drawn from, by name or path, "" for those whose encoders and delay vary.
        seed: of the sweep; with number and rig it determines the robot.
        drawn_duration: what was drawn, where the planner has taken another for the rig's loads (s).
        time_law: how the reference passes along the segment.
        robot: whose crossing it is, by the name of its file; "" for the robot of the rig.
        way: of a motion that the planner leads through another place of the locus: x, y (m) and duration (s) of each
            leg's end, legs parted by semicolons; "" for the straight segment.
    """

    number: int
    mode1: int
    mode2: int
    start_x: float
    start_y: float
    end_x: float
    end_y: float
    duration: float
    mass_scale: float
    inertia_scale: float
    friction_scale: float
    encoder_counts: int | None
    delay_samples: int
    rig: str = VARIED
    seed: int = 1
    drawn_duration: float | None = None
    time_law: str = QUINTIC
    robot: str = ""
    way: str = ""

    def along(self, timed: TimedCourse) -> Draw:
        """Return the case by a course with the same ends, in the given durations of its legs."""
        legs = zip(timed.course.waypoints[1:], timed.durations, strict=True)
        drawn = self.duration if self.drawn_duration is None else self.drawn_duration
        return self._replace(
            duration=timed.duration,
            drawn_duration=None if timed.duration == drawn else drawn,
            time_law=timed.course.time_law,
            way=";".join(f"{x!r} {y!r} {s!r}" for (x, y), s in legs) if len(timed.durations) > 1 else "",
        )

    def legs(self) -> tuple[tuple[XY, ...], tuple[float, ...]]:
        """Return the points (m) through which it goes, and the durations (s) between them."""
        start, end = (self.start_x, self.start_y), (self.end_x, self.end_y)
        if not self.way:
            return (start, end), (self.duration,)
        read = [tuple(float(word) for word in leg.split()) for leg in self.way.split(";")]
        return (start, *((x, y) for x, y, _ in read)), tuple(duration for *_, duration in read)

    @property
    def robot_name(self) -> str:
        """The robot whose crossing it is, by the name of its file."""
        return self.robot or robot_of(self.rig)

    def scenario(self, controller: str) -> DrawnScenario:
        """Return the scenario for a controller; with encoders it has estimator and gains of the rig with encoders.

        Raises:
            InputError: there is no such controller, or the motion of a rig's case is refused, so that it has no robot.
        """
        return _scenario_of(self, controller)

    @property
    def torque_limit(self) -> float:
        """Torque limit of the drives (Nm)."""
        return torque_limit_of(self.robot_name)

    @property
    def size(self) -> float:
        """Size of the robot over that of DexTAR, or what a rig says in its place: what errors are measured by."""
        if self.robot:
            return size_ratio(_robot(self.robot))
        return 1.0 if self.rig == VARIED else tolerance_of(self.rig) / PEAK_LIMIT

    def with_effects(self, controller: str, effects: Mapping[str, Any]) -> DrawnScenario:
        """Return the scenario for a controller and a robot with effects, which are keys of the section `plant`."""
        scales = Scales(self.mass_scale, self.inertia_scale, self.friction_scale)._asdict()
        if self.rig == VARIED:
            content = self._varied(controller, scales)
        else:
            content = self._on_its_rig(controller, scales, effects)
        content |= {
            # a law from elsewhere has a colon in its name, which that of a run takes not
            "name": f"case-{self.number}-{controller.replace(':', '.')}",
            "controller": controller,
            "working_mode": (self.mode1, self.mode2),
            **self.timing(),
        }
        return validate(content, DrawnScenario, f"case {self.number}")

    def timing(self) -> dict[str, Any]:
        """Return the keys of a scenario in which the timings of a case differ."""
        waypoints, durations = self.legs()
        return {"waypoints": waypoints, "segment_duration": durations, "time_law": self.time_law}

    def _varied(self, controller: str, scales: Mapping[str, float]) -> dict[str, Any]:
        """Return the content of a scenario with a robot whose encoders and delay vary."""
        base = find_rig(BASES[self.encoder_counts is not None])
        content = base.content(_given(self.robot_name), controller, {})
        content["plant"] |= {
            **scales,
            "encoder_counts": self.encoder_counts,
            "delay_samples": self.delay_samples,
        }
        return with_own_law(content, self.robot) if self.robot else content

    def _on_its_rig(self, controller: str, scales: Mapping[str, float], effects: Mapping[str, Any]) -> dict[str, Any]:
        """Return the content of a scenario with a robot of the case's rig."""
        rig = find_rig(self.rig)
        # a study may give a robot of a rig without errors scales of its own
        exact = rig.errors == NO_ERRORS and not effects and set(scales.values()) == {1.0}
        content = rig.content(_given(rig.robot), controller, None if exact else {**scales, **effects})
        if rig.errors.gyro_bias > 0.0 and content["ekf"]["gyro"]:
            content["imu"]["gyro_bias"] = drawn_gyro_bias(rig.errors, self.seed, self.number)
        return content


def draw(seed: int, number: int, rig: str = VARIED, name: str = "") -> Draw:
    """Return a case of a sweep.

    Working mode, encoders and delay are equally likely; the start is uniform over where both legs reach, the end over
    that part of it which is in the other assembly mode; the duration is uniform on a logarithmic scale. A rig has its
    own robots; the motion is the same on all that are of the same make.

    Args:
        seed, number: of the sweep and the case.
        rig: whose robots are drawn.
        name: of the file of the robot, "" for that of the rig.
    """
    random = np.random.default_rng((seed, number))
    mode1, mode2 = WORKING_MODES[random.integers(len(WORKING_MODES))]
    robot = _robot(name or robot_of(rig))
    start = _reachable(robot, random)
    assembly = place_at(robot, (mode1, mode2), *start).assembly
    end = _reachable(robot, random)
    while place_at(robot, (mode1, mode2), *end).assembly == assembly:
        end = _reachable(robot, random)
    mass, inertia, friction = random.uniform(1.0 - SPREAD, 1.0 + SPREAD, 3).tolist()
    case = Draw(
        number,
        mode1,
        mode2,
        *start,
        *end,
        math.exp(random.uniform(math.log(SHORTEST), math.log(LONGEST))),
        mass,
        inertia,
        friction,
        ENCODERS[random.integers(len(ENCODERS))],
        DELAYS[random.integers(len(DELAYS))],
        seed=seed,
        robot=name,
    )
    return case if rig == VARIED else on_robot(case, rig)


def on_robot(case: Draw, name: str) -> Draw:
    """Return a case with a robot of a rig, by name or path."""
    rig = find_rig(name)
    scales = drawn_scales(rig.errors, case.seed, case.number)
    return case._replace(
        **{name: rig.plant.get(name, drawn) for name, drawn in scales._asdict().items()},
        encoder_counts=rig.plant.get("encoder_counts"),
        delay_samples=rig.plant.get("delay_samples", 0),
        rig=name,
    )


@lru_cache(maxsize=16)
def plan_of(case: Draw) -> Plan:
    """Return the plan of a case, the same for all controllers.

    Raises:
        InputError: the planner refuses the motion.
    """
    # the effects of its robot follow from the motion, not the motion from them
    return _timed(case, PLANNED_FOR).plan()


@lru_cache(maxsize=16)
def _scenario_of(case: Draw, controller: str) -> DrawnScenario:
    """Return a case's scenario, for which its screen, its run and its row ask one after the other."""
    scenario, errors = _timed(case, controller), _errors_of(case)
    if errors == NO_ERRORS:
        return scenario
    drawn = drawn_effects(errors, case.seed, case.number, plan_of(case).crossings[0].time)
    # what all robots of the rig have in common is not drawn
    common = find_rig(case.rig).plant
    effects = {"seed": common.get("seed", drawn.pop("seed"))}
    for name, keys in drawn.items():
        effects[name] = {key: value for key, value in keys.items() if key not in common.get(name, {})}
    return scenario.model_copy(update={"plant": with_sections(scenario.plant, effects)})


def _timed(case: Draw, controller: str) -> DrawnScenario:
    """Return the scenario of a case, with the effects of its robot as if it crossed at once."""
    untimed = case._replace(duration=1.0, drawn_duration=None, time_law=QUINTIC, way="")
    return _as_drawn(untimed, controller).model_copy(update=case.timing())


@lru_cache(maxsize=16)
def _as_drawn(case: Draw, controller: str) -> DrawnScenario:
    """Return the same of all timings of a case, checked."""
    errors = _errors_of(case)
    effects = {} if errors == NO_ERRORS else drawn_effects(errors, case.seed, case.number, 0.0)
    return case.with_effects(controller, effects)


def _errors_of(case: Draw) -> RobotErrors:
    """Return the bounds of the errors that a case's robot has."""
    return NO_ERRORS if case.rig == VARIED else find_rig(case.rig).errors


def with_own_law(content: dict[str, Any], robot: str) -> dict[str, Any]:
    """Return the content of a scenario on a rig of DexTAR's for another robot, with the weight of its own torque."""
    changed = in_proportion(content, robot)
    return {**changed, "unified": {**changed["unified"], "weight": _own_weight(robot)}}


@cache
def _own_weight(robot: str) -> float:
    """Return the torque weight of unified on a robot."""
    return ROBUST_WEIGHT / torque_ratio(read_robot(robot)) ** 2


@cache
def _robot(name: str) -> FiveBar:
    return load_robot(name)


@cache
def _given(robot: str) -> DrawnScenario:
    """Return the common part of all cases of a robot; its waypoints are placeholders."""
    common = {
        "name": "case",
        "robot": robot,
        "rate_hz": RATE_HZ,
        "waypoints": ((0.0, 0.15), (0.0, 0.05)),
        "plant": {"torque_limit": torque_limit_of(robot)},
        "unified": {"weight": ROBUST_WEIGHT},
    }
    return validate(common, DrawnScenario, "sweep")


def _reachable(robot: FiveBar, random: np.random.Generator) -> XY:
    left, right, bottom, top = workspace_bounds(robot)
    while True:
        x, y = random.uniform((left, bottom), (right, top)).tolist()
        if workspace_margin(robot, x, y) > 0.0:
            return x, y
