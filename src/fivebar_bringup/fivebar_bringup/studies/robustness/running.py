"""Raises one effect on one equipment through its sizes, and counts the failures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cache, lru_cache
from typing import Any, NamedTuple

from fivebar_bringup.report.thesis import MIDDLE
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import Sampled, case_of, sampled
from fivebar_bringup.simulation.engine import crossing
from fivebar_bringup.simulation.outcome import FAULT_NAMES, Outcome
from fivebar_bringup.studies.engine.study import StudySettings
from fivebar_bringup.studies.rigs.named import find_rig
from fivebar_bringup.studies.rigs.rig import merged
from fivebar_bringup.studies.robustness.effects import DRAWS, EFFECTS, Condition, Effect, FaultyRobot
from fivebar_bringup.studies.robustness.sensor_effects import ALL_EFFECTS
from fivebar_bringup.studies.sweep.drawing import RATE_HZ, ROBOT, UNIFIED_WEIGHT, torque_limit_of, with_own_law
from fivebar_control.laws.robot_sizes import size_ratio, torque_ratio
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.robot_file import load_robot, read_robot
from fivebar_description.strict_yaml import InputError, validate

LIMIT = 2e-3
"""A run of DexTAR fails that leaves its reference by this distance (m)."""

DURATIONS = (0.5, 1.0, 2.0)
"""s."""

WRONG_MODE, FAR, REFUSED = "wrong assembly mode", "off the reference", "impossible robot"
"""Failures besides the faults' names."""


ENCODERS = "encoders"
"""Rig of the equipment that has no gyroscope."""


class Equipment(NamedTuple):
    """A controller with sensors and settings.

    Attributes:
        name: as in the results.
        controller: its name.
        words: sensors and settings.
        rig: whose sensors, estimator and gains it has, without its robot and its tracking limit.
    """

    name: str
    controller: str
    words: str
    rig: str = ENCODERS

    @property
    def gyro(self) -> bool:
        """Whether it has a gyroscope and declared tolerances."""
        return self.rig != ENCODERS

    @property
    def sections(self) -> dict[str, Any]:
        """Sections of the scenario, that replace others key by key."""
        found = find_rig(self.rig).settings_for(self.controller)
        return {name: keys for name, keys in found.items() if isinstance(keys, Mapping)}


ENCODERS_ALONE = "motor encoders alone, no declared tolerances"
WITH_GYRO = "with gyroscope and declared tolerances, settings of the rig good"
FOR_ELASTIC = "with gyroscope and declared tolerances, gains and estimator as on the rig middling"

ELASTIC = "unified, gyro, elastic"


def equipment_named(name: str) -> Equipment:
    """Return an equipment by its name, `CONTROLLER, encoders` or `CONTROLLER, gyro` of any controller, or `ELASTIC`.

    `good` stands for its settings of estimator and gains; the robots are those of this study.
    """
    controller, _, sensors = name.partition(", ")
    if name == ELASTIC:
        return Equipment(name, controller, FOR_ELASTIC, "middling")
    if sensors == "gyro":
        return Equipment(name, controller, WITH_GYRO, "good")
    return Equipment(name, controller, ENCODERS_ALONE)


def equipment_of(controllers: Sequence[str]) -> list[Equipment]:
    """Return the equipment of controllers."""
    names = []
    for controller in controllers:
        names += [f"{controller}, encoders", f"{controller}, gyro"]
        names += [ELASTIC] if controller == "unified" else []
    return [equipment_named(name) for name in names]


class RobustnessSettings(StudySettings):
    """The settings that determine the results of the study.

    Attributes:
        effects: names of what grows, each alone.
        controllers: each from encoders alone and with a gyroscope, `unified` also as for elastic transmissions.
        draws: of signs, directions and noise, of each size.
        durations: of the crossing (s).
        robot: that makes it, by the name of its file.
    """

    effects: tuple[str, ...] = tuple(EFFECTS)
    controllers: tuple[str, ...] = ("unified", "multi_cartesian", "multi_joint")
    draws: int = DRAWS
    durations: tuple[float, ...] = DURATIONS
    robot: str = ROBOT


class EffectRun(NamedTuple):
    """A run: an equipment on a robot with an effect.

    Attributes:
        effect: name, "" for an exact robot.
        size: in the effect's unit.
        equipment: name.
        duration: of the crossing (s).
        draw: number, from 0.
    """

    effect: str
    size: float
    equipment: str
    duration: float
    draw: int


@lru_cache(maxsize=4)
def steps_of(settings: RobustnessSettings) -> tuple[EffectRun, ...]:
    """Return the runs of the study, first those without an effect."""
    equipment = equipment_of(settings.controllers)
    pairs = [("", 0.0, one.name) for one in equipment]
    pairs += [
        (name, size, one.name)
        for name in settings.effects
        for one in equipment
        if one.gyro or not ALL_EFFECTS[name].needs_gyro
        for size in ALL_EFFECTS[name].sizes
    ]
    conditions = [(duration, draw) for duration in settings.durations for draw in range(settings.draws)]
    return tuple(EffectRun(*pair, *condition) for pair in pairs for condition in conditions)


class RobustnessRow(NamedTuple):
    """A line of robustness.csv: what became of a run.

    Attributes:
        case: number of the run.
        effect: what the robot has, "" for an exact robot.
        size: of the effect, in its unit.
        equipment: controller, sensors and settings.
        duration: of the crossing (s).
        draw: number of signs, directions and noise.
        cause: why it failed, "" for a success.
    """

    case: int
    effect: str
    size: float
    equipment: str
    duration: float
    draw: int
    cause: str


def run_numbered(settings: RobustnessSettings, number: int) -> list[RobustnessRow]:
    """Return the row of a run."""
    step = steps_of(settings)[number]
    effect = ALL_EFFECTS[step.effect] if step.effect else None
    cause = failure_of(step.equipment, effect, step.size, step.duration, step.draw, settings.robot)
    return [RobustnessRow(number, *step, cause or "")]


class Climb(NamedTuple):
    """The results of an equipment as an effect grew.

    Attributes:
        effect, equipment: names.
        runs: at each size.
        failed: runs that failed at each size.
        causes: of each size, how often each cause came, the most frequent first.
    """

    effect: str
    equipment: str
    runs: int
    failed: tuple[int, ...]
    causes: tuple[Mapping[str, int], ...]

    @property
    def first(self) -> int | None:
        """Number of the first size at which a run fails."""
        return first_failure(self.failed)

    @property
    def first_size(self) -> float | None:
        """The first size at which a run fails, None if none does."""
        return None if self.first is None else ALL_EFFECTS[self.effect].sizes[self.first]


def first_failure(failed: Sequence[int]) -> int | None:
    """Return the first step with a failure, None without one."""
    return next((step for step, count in enumerate(failed) if count), None)


def climbs_of(settings: RobustnessSettings, rows: Sequence[RobustnessRow]) -> list[Climb]:
    """Return what became of every pair of effect and equipment."""
    causes: dict[tuple[str, str], dict[float, Counter[str]]] = {}
    for row in rows:
        if row.effect:
            sizes = causes.setdefault((row.effect, row.equipment), {})
            sizes.setdefault(row.size, Counter()).update([row.cause] if row.cause else [])
    runs = settings.draws * len(settings.durations)
    climbs = []
    for pair, sizes in causes.items():
        failed = tuple(found.total() for found in sizes.values())
        climbs.append(Climb(*pair, runs, failed, tuple(dict(found.most_common()) for found in sizes.values())))
    return climbs


def failures_without(rows: Sequence[RobustnessRow]) -> dict[str, int]:
    """Return how many runs of each equipment fail on the exact robot."""
    failed: dict[str, int] = {}
    for row in rows:
        if not row.effect:
            failed[row.equipment] = failed.get(row.equipment, 0) + bool(row.cause)
    return failed


def failure_of(
    equipment: str, effect: Effect | None, size: float, duration: float, draw: int, robot: str = ROBOT
) -> str | None:
    """Run a crossing and return why it fails, None if it does not.

    Args:
        equipment: name.
        effect: None for an exact robot.
        size: in the effect's unit.
        duration: of the crossing (s).
        draw: number, from 0.
        robot: by the name of its file.
    """
    given, samples = prepared(equipment, duration, robot)
    plan = given.plan()
    at = Condition(draw, plan.crossings[0].time)
    # the offset of a gyroscope is never zero
    faulty = FaultyRobot(
        given.plant._replace(seed=draw), given.imu._replace(gyro_bias=at.sign * _gyro_bias()), given.tolerances
    )
    if effect is not None:
        faulty = effect.on(faulty, size, at)
    known = faulty.tolerances if equipment_named(equipment).gyro else given.tolerances
    scenario = given.model_copy(update={"plant": faulty.plant, "imu": faulty.imu, "tolerances": known})
    try:
        case = case_of(scenario, stop_at_fault=True)
    except InputError:
        return REFUSED
    return cause_of(crossing(case, samples), len(plan.crossings), limit_of(robot))


def failure_rule(robot: str) -> str:
    """Return the definition of a failure in words."""
    return (
        f"a fault, another assembly mode than planned, or {1e3 * limit_of(robot):.3g} mm and more from the reference at"
        " any time"
    )


def cause_of(outcome: Outcome, crossings: int, limit: float = LIMIT) -> str | None:
    """Return why a run fails, given the planned number of changes of the assembly mode; None if it does not."""
    if outcome.fault != NO_FAULT:
        return FAULT_NAMES[outcome.fault]
    if outcome.mode_changes != crossings:
        return WRONG_MODE
    # a NaN is a failure
    return None if outcome.error_peak < limit else FAR


@cache
def limit_of(robot: str) -> float:
    """Return the distance from the reference (m) at which a run fails: in proportion to the size of the robot."""
    return LIMIT * size_ratio(load_robot(robot))


def _gyro_bias() -> float:
    """Return the bound (rad/s) of the gyroscope's bias on the rigs that have one."""
    return find_rig("good").errors.gyro_bias


def scaled_sections(sections: Mapping[str, Any], robot: str) -> dict[str, Any]:
    """Return sections of a rig of DexTAR's, with torques and forces in proportion to those of another robot."""
    torque = torque_ratio(read_robot(robot))
    force = torque / size_ratio(load_robot(robot))
    scales = {
        "ekf": {"disturbance_rate": torque, "disturbance_initial": torque, "force_deviation": force},
        "loads": {"push": force, "passive": torque},
    }
    return merged(
        sections,
        {
            name: {key: sections[name][key] * scale for key, scale in keys.items() if key in sections[name]}
            for name, keys in scales.items()
            if name in sections
        },
    )


@cache
def prepared(name: str, duration: float, robot: str = ROBOT) -> tuple[Scenario, Sampled]:
    """Return the scenario of an equipment on an exact robot, and its sampled plan.

    The motion of another robot than DexTAR is that of DexTAR in proportion to its size.

    Raises:
        InputError: the planner refuses it.
    """
    equipment, size = equipment_named(name), size_ratio(load_robot(robot))
    waypoints = [(size * x, size * y) for x, y in MIDDLE[:2]]
    common = {
        "name": "robustness",
        "robot": robot,
        "rate_hz": RATE_HZ,
        "waypoints": waypoints,
        "segment_duration": duration,
        "plant": {"torque_limit": torque_limit_of(robot)},
        "unified": {"weight": UNIFIED_WEIGHT},
    }
    content = find_rig(ENCODERS).content(validate(common, Scenario, "robustness"), equipment.controller)
    if robot == ROBOT:
        content = merged(content, equipment.sections)
    else:
        content = with_own_law(merged(content, scaled_sections(equipment.sections, robot)), robot)
    scenario = validate(content, Scenario, "robustness")
    return scenario, sampled(scenario.five_bar(), scenario.plan(), RATE_HZ, scenario.lead_samples)
