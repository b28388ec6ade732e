"""Raises one effect on one equipment through its sizes, and counts the failures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

from fivebar_bringup.report.thesis import MIDDLE
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import Sampled, case_of, sampled
from fivebar_bringup.simulation.engine import crossing
from fivebar_bringup.simulation.outcome import FAULT_NAMES, Outcome
from fivebar_bringup.studies.rigs.rig import find_rig, merged
from fivebar_bringup.studies.robustness.effects import DRAWS, EFFECTS, Condition, Effect, FaultyRobot
from fivebar_bringup.studies.sweep.drawing import RATE_HZ, ROBOT, TORQUE_LIMIT, UNIFIED_WEIGHT
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.strict_yaml import InputError, validate

LIMIT = 2e-3
"""A run fails that leaves its reference by this distance (m)."""

FAILURE_RULE = "a fault, another assembly mode than planned, or 2 mm and more from the reference at any time"
"""The definition of a failure, in words."""

DURATIONS = (0.5, 1.0, 2.0)
"""s."""

WRONG_MODE, FAR, REFUSED = "wrong assembly mode", "2 mm off", "impossible robot"
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

EQUIPMENT = {
    one.name: one
    for one in (
        Equipment("unified, encoders", "unified", ENCODERS_ALONE),
        Equipment("unified, gyro", "unified", WITH_GYRO, "good"),
        Equipment("unified, gyro, elastic", "unified", FOR_ELASTIC, "middling"),
        Equipment("multi_cartesian, encoders", "multi_cartesian", ENCODERS_ALONE),
        Equipment("multi_cartesian, gyro", "multi_cartesian", WITH_GYRO, "good"),
        Equipment("multi_joint, encoders", "multi_joint", ENCODERS_ALONE),
        Equipment("multi_joint, gyro", "multi_joint", WITH_GYRO, "good"),
    )
}
"""By name. `good` stands for its settings of estimator and gains; the robots are those of this study."""


class Ladder(NamedTuple):
    """Work for one process: an effect, an equipment, and how many of the draws and durations."""

    effect: str
    equipment: str
    draws: int = DRAWS
    durations: tuple[float, ...] = DURATIONS


class Climb(NamedTuple):
    """What became of a ladder.

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
        return None if self.first is None else EFFECTS[self.effect].sizes[self.first]


def first_failure(failed: Sequence[int]) -> int | None:
    """Return the first step with a failure, None without one."""
    return next((step for step, count in enumerate(failed) if count), None)


def climbed(ladder: Ladder) -> Climb:
    """Return what becomes of every size of an effect."""
    effect = EFFECTS[ladder.effect]
    found = [_causes(ladder, effect, size) for size in effect.sizes]
    failed = tuple(sum(causes.values()) for causes in found)
    return Climb(ladder.effect, ladder.equipment, ladder.draws * len(ladder.durations), failed, tuple(found))


def failures_without(equipment: str, draws: int, durations: tuple[float, ...]) -> int:
    """Return how many runs of an equipment fail on the exact robot."""
    return sum(_causes(Ladder("", equipment, draws, durations), None, 0.0).values())


def _causes(ladder: Ladder, effect: Effect | None, size: float) -> dict[str, int]:
    counts: dict[str, int] = {}
    for duration in ladder.durations:
        for draw in range(ladder.draws):
            cause = failure_of(ladder.equipment, effect, size, duration, draw)
            if cause is not None:
                counts[cause] = counts.get(cause, 0) + 1
    return dict(sorted(counts.items(), key=lambda item: -item[1]))


def failure_of(equipment: str, effect: Effect | None, size: float, duration: float, draw: int) -> str | None:
    """Run a crossing and return why it fails, None if it does not.

    Args:
        equipment: name.
        effect: None for an exact robot.
        size: in the effect's unit.
        duration: of the crossing (s).
        draw: number, from 0.
    """
    given, samples = prepared(equipment, duration)
    plan = given.plan()
    at = Condition(draw, plan.crossings[0].time)
    # the offset of a gyroscope is never zero
    robot = FaultyRobot(
        given.plant._replace(seed=draw), given.imu._replace(gyro_bias=at.sign * _gyro_bias()), given.tolerances
    )
    if effect is not None:
        robot = effect.on(robot, size, at)
    known = robot.tolerances if EQUIPMENT[equipment].gyro else given.tolerances
    scenario = given.model_copy(update={"plant": robot.plant, "imu": robot.imu, "tolerances": known})
    try:
        case = case_of(scenario, stop_at_fault=True)
    except InputError:
        return REFUSED
    return cause_of(crossing(case, samples), len(plan.crossings))


def cause_of(outcome: Outcome, crossings: int) -> str | None:
    """Return why a run fails, given the planned number of changes of the assembly mode; None if it does not."""
    if outcome.fault != NO_FAULT:
        return FAULT_NAMES[outcome.fault]
    if outcome.mode_changes != crossings:
        return WRONG_MODE
    # a NaN is a failure
    return None if outcome.error_peak < LIMIT else FAR


def _gyro_bias() -> float:
    """Return the bound (rad/s) of the gyroscope's bias on the rigs that have one."""
    return find_rig("good").errors.gyro_bias


@cache
def prepared(name: str, duration: float) -> tuple[Scenario, Sampled]:
    """Return the scenario of an equipment on an exact robot, and its sampled plan."""
    equipment = EQUIPMENT[name]
    start, end, *_ = MIDDLE
    common = {
        "name": "robustness",
        "robot": ROBOT,
        "rate_hz": RATE_HZ,
        "waypoints": (start, end),
        "segment_duration": duration,
        "plant": {"torque_limit": TORQUE_LIMIT},
        "unified": {"weight": UNIFIED_WEIGHT},
    }
    content = find_rig(ENCODERS).content(validate(common, Scenario, "robustness"), equipment.controller)
    scenario = validate(merged(content, equipment.sections), Scenario, "robustness")
    return scenario, sampled(scenario.five_bar(), scenario.plan(), RATE_HZ, scenario.lead_samples)
