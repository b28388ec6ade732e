# SPDX-License-Identifier: Apache-2.0
"""The control cycle of a scenario, for every runner that is not its nodes."""

from __future__ import annotations

from fivebar_control.loop.closed_loop import cycle_settings_of
from fivebar_control.loop.cycle import CycleSettings
from fivebar_control.safety.brake import brake_of
from fivebar_control.safety.stages import guard_limits_of
from fivebar_control.scenario.guard_settings import guard_settings
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_control.scenario.scenario import ControlScenario


def cycle_settings(scenario: ControlScenario) -> CycleSettings:
    """Return the constants of the control cycle."""
    safety, robot, rate_hz = guard_settings(scenario), scenario.five_bar(), scenario.rate_hz
    return cycle_settings_of(
        robot,
        scenario.working_mode,
        rate_hz,
        tuned_controller(scenario),
        scenario.zone.as_rule().lasts(rate_hz),
        guard_limits_of(safety, rate_hz),
        brake_of(safety, robot, rate_hz),
    )
