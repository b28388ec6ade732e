"""The release of a scenario's robot that rests near the Type 2 locus."""

from __future__ import annotations

from fivebar_control.planning.release import ReleasePlan, plan_release
from fivebar_control.safety.stages import guard_limits_of
from fivebar_control.scenario.scenario import ControlScenario


def scenario_release(
    scenario: ControlScenario, q11: float, q21: float, platform: tuple[float, float] | None
) -> ReleasePlan:
    """Return how a scenario's robot is released; motor angles (rad) and `platform` as for `plan_release`.

    Raises:
        ReleaseRefused: as `plan_release`.
    """
    return plan_release(
        scenario.five_bar(),
        scenario.known_within(),
        guard_limits_of(scenario.safety_settings(), scenario.rate_hz),
        scenario.elbows_pass(),
        scenario.rate_hz,
        q11,
        q21,
        platform,
    )
