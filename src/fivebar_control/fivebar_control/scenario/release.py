# SPDX-License-Identifier: Apache-2.0
"""The release of a scenario's robot that rests near the Type 2 locus."""

from __future__ import annotations

from fivebar_control.laws.torque import Torque
from fivebar_control.model.geometry import direct_geometry
from fivebar_control.planning.release import PlannedInSlices, ReleasePlan, ReleaseTask, finished, plan_in_slices
from fivebar_control.planning.release_step import (
    DRIVING,
    ENDINGS,
    PRESSING,
    RELEASED,
    first_memory,
    has_ended,
    release_step,
)
from fivebar_control.safety.stages import guard_limits_of
from fivebar_control.scenario.guard_settings import guard_settings
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import read_robot


def scenario_release(
    scenario: ControlScenario, q11: float, q21: float, platform: tuple[float, float] | None
) -> ReleasePlan:
    """Return how a scenario's robot is released; motor angles (rad) and `platform` as for `plan_in_slices`.

    Raises:
        ReleaseRefused: as `plan_in_slices`.
    """
    return finished(release_in_slices(scenario, q11, q21, platform))


def release_in_slices(
    scenario: ControlScenario, q11: float, q21: float, platform: tuple[float, float] | None
) -> PlannedInSlices:
    """Return the same in slices.

    Raises:
        ReleaseRefused: a slice, as `plan_in_slices`.
    """
    task = ReleaseTask(
        scenario.five_bar(),
        scenario.known_within(),
        guard_limits_of(guard_settings(scenario), scenario.rate_hz),
        read_robot(scenario.robot).elbows_pass,
        scenario.rate_hz,
        scenario.to_bear(),
    )
    return plan_in_slices(task, q11, q21, platform, scenario.gyro or not scenario.estimated)


class RobotRelease:
    """A release that is under way."""

    def __init__(self, robot: FiveBar, plan: ReleasePlan) -> None:
        """Begin a planned release of a robot."""
        self._robot = robot
        self._release = plan.release
        self._memory = first_memory(self._release)

    @property
    def presses(self) -> bool:
        """Whether the motors drive or press the platform away from the locus."""
        return self._memory.phase in (DRIVING, PRESSING)

    @property
    def has_ended(self) -> bool:
        """Whether it has come to one of its ends."""
        return has_ended(self._memory)

    def step(self, q11: float, q21: float, rate: float) -> Torque:
        """Return the torque (Nm) for motor angles (rad) and the distal link's rate (rad/s), NaN where not known."""
        torque, self._memory = release_step(self._release, self._memory, q11, q21, rate)
        return torque

    def result(self, q11: float, q21: float) -> str:
        """Return how it has ended, and where the robot is by its motor angles (rad)."""
        memory = self._memory
        if memory.phase != RELEASED:
            return f"ended: {ENDINGS[memory.phase]}"
        x, y = direct_geometry(self._robot, memory.assembly, q11, q21)
        mode = "+" if memory.assembly > 0 else "-"
        return (
            f"released: in assembly mode {mode}, the platform at ({x:.4f}, {y:.4f}) m by the encoders:"
            " home it there, and begin a new run"
        )
