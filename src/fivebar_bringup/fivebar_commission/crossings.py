# SPDX-License-Identifier: Apache-2.0
"""The first crossings: there and back, in durations from slow to fast, with the odds of each."""

from __future__ import annotations

from typing import Any, NamedTuple

from fivebar_bringup.motions.request import Request, plan_request, scenario_of
from fivebar_bringup.motions.start import HOME_MODE, Start
from fivebar_bringup.odds.odds import Odds
from fivebar_bringup.scenario import Scenario
from fivebar_commission.motions import crossing_points, state_at
from fivebar_commission.session import Session
from fivebar_commission.step import GateClosed
from fivebar_control.model.kinematics import assembly_mode
from fivebar_control.planning.timing import Speed
from fivebar_control.scenario.robot_defaults import ELASTIC_NOISE, ELASTIC_PLAY
from fivebar_description.strict_yaml import InputError

FACTORS = (2.0, 1.6, 1.3, 1.0, 0.8, 0.65)
"""Durations relative to the planner's choice, from slow to fast."""

SOFT_ESTIMATOR: dict[str, Any] = {
    "play": ELASTIC_PLAY,
    "acceleration_noise": ELASTIC_NOISE,
    "gyro_noise": ELASTIC_NOISE,
    "misfit_limit": 200.0,
    "disturbance_rate": 0.3,
}
"""Noises of the estimator on transmissions that yield."""

OFF_BY = 0.004
"""Distance (m) from the reference at which a crossing is stopped."""

USED = 3
"""Crossings that are made of those that are likely enough."""


class TriedCrossing(NamedTuple):
    """A crossing there and back, and on how many drawn robots it succeeds."""

    scenario: Scenario
    odds: Odds


def crossing_base(session: Session, name: str, **content: Any) -> Scenario:
    """Return a scenario with the estimator and the limits of a crossing."""
    ekf: dict[str, Any] = dict(SOFT_ESTIMATOR)
    if session.imu is not None:
        ekf |= {"gyro": True, "gyro_clock": 0.001}
    home = session.robot.home_m
    known = {"waypoints": [home, home], "ekf": ekf, "tracking_error_limit": OFF_BY}
    return session.scenario(name, **known | content)


def planned_crossing(session: Session, duration: float | Speed) -> Scenario:
    """Return a crossing from home and back, each way in a duration (s) or as the planner chooses it.

    Raises:
        InputError: there is no feasible motion.
    """
    robot, home = session.five_bar, session.robot.home_m
    way = crossing_points(robot, home)[0]
    base = crossing_base(session, "crossing", waypoints=[home, way.end])
    request = Request(
        x=way.end[0],
        y=way.end[1],
        assembly="+" if assembly_mode(state_at(robot, way.end)) > 0 else "-",
        working_mode=None,
        start=Start(*home, HOME_MODE, base),
        controller=base.controller,
        robot=base.robot,
        torque_limit=session.allowed.torque,
        motor_speed=session.allowed.speed,
        rate_hz=base.rate_hz,
        duration=duration,
    )
    there = scenario_of(request, plan_request(request, judge_loads=False))
    durations = there.durations()
    return there.model_copy(
        update={
            "name": "crossing",
            "waypoints": (*there.waypoints, *there.waypoints[-2::-1]),
            "segment_duration": (*durations, *durations[::-1]),
            "safety": base.safety,
        }
    )


def likely_crossings(session: Session, robots: int) -> tuple[list[TriedCrossing], list[TriedCrossing]]:
    """Return the crossings that are likely enough to succeed, from slow to fast, and those that are not.

    Raises:
        GateClosed: no motion is feasible.
    """
    # here, because the compiled engine takes long to load
    from fivebar_bringup.odds.trials import declared_odds

    try:
        first = planned_crossing(session, Speed.COMFORTABLE)
    except InputError as error:
        raise GateClosed("no_crossing", str(error)) from error
    one_way = sum(first.durations()) / 2.0
    enough, unlikely = list[TriedCrossing](), list[TriedCrossing]()
    with session.shown("  durations") as progress:
        for number, factor in enumerate(FACTORS):
            progress(number, len(FACTORS))
            try:
                scenario = first if factor == 1.0 else planned_crossing(session, round(factor * one_way, 3))
            except InputError:
                continue
            tried = as_found(session, scenario)
            odds = declared_odds(tried, robots)
            (enough if odds.share >= scenario.risk.success else unlikely).append(TriedCrossing(scenario, odds))
    return enough, unlikely


def as_found(session: Session, scenario: Scenario) -> Scenario:
    """Return a scenario on a simulated robot as far as it is known: with the transmissions that were found."""
    plant = scenario.plant
    if session.state.transmissions:
        plant = plant._replace(transmission=plant.transmission._replace(**session.state.transmissions))
    return scenario.model_copy(update={"plant": plant})
