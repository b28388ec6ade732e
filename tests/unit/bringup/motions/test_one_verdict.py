# SPDX-License-Identifier: Apache-2.0
"""What a robot file declares decides about its motions in the same way for whoever asks."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import pytest

from fivebar_bringup.motions.likely import plan_likely
from fivebar_bringup.motions.request import Request, within_drives
from fivebar_bringup.motions.start import HOME_MODE, Start
from fivebar_bringup.odds.robot_errors import declared_errors
from fivebar_bringup.odds.trials import SEED, STATED_ROBOTS, declared_odds, trials_of
from fivebar_bringup.runs.admission import load_with_odds
from fivebar_bringup.scenario import Scenario
from fivebar_control.planning.postures import place_at
from fivebar_control.planning.timing import Speed
from fivebar_description.errors import InputError
from fivebar_description.robot_file import read_robot
from fivebar_description.strict_yaml import validate, yaml_text
from fivebar_studies.assess.typical import Typical, request_for
from fivebar_studies.compare.cases import ComparisonCase
from fivebar_studies.rigs.named import find_rig


class Lab(NamedTuple):
    """A robot of a laboratory: links (m), torque (Nm), and whatever else its file declares."""

    base: float
    proximal: float
    distal: float
    mass: float
    torque: float
    declared: dict[str, Any]


GYROSCOPE = {"imu": {"gyro_noise": 0.01, "rate_hz": 100, "latency": 0.004}}
PASSIVE = {"passive_encoder": {"leg": 2, "counts": 4096}}
CALIBRATED = {"tolerances": {"length": 2e-5, "base": 2e-5, "zero": 2e-4}}
ASSEMBLED = {"tolerances": {"length": 3e-4, "base": 3e-4, "zero": 5e-3}}
LOADS = {"loads": {"tilt": 0.02, "push": 0.5, "passive": 0.003}}

LABS = {
    "belts of 1:8": Lab(
        0.2, 0.15, 0.18, 0.35, 8.0, {"transmission": {"frequency": 60.0, "backlash": 6e-4}, **GYROSCOPE}
    ),
    "play of 2 mrad": Lab(
        0.24, 0.17, 0.21, 0.55, 9.0, {"transmission": {"frequency": 80.0, "backlash": 2e-3}, **GYROSCOPE}
    ),
    "harmonic drives": Lab(0.3, 0.2, 0.25, 1.2, 30.0, {"transmission": {"frequency": 45.0}, **ASSEMBLED, **GYROSCOPE}),
    "printed": Lab(0.1, 0.06, 0.1, 0.03, 0.2, {**ASSEMBLED, **LOADS}),
    "printed, calibrated": Lab(0.1, 0.06, 0.1, 0.03, 0.2, CALIBRATED),
    "direct drive": Lab(0.118, 0.09, 0.09, 0.5, 2.0, {**CALIBRATED, **GYROSCOPE}),
    "passive encoder": Lab(0.118, 0.09, 0.09, 0.5, 2.0, {**ASSEMBLED, **PASSIVE}),
    "stiff gears": Lab(
        0.16, 0.12, 0.14, 0.8, 12.0, {"transmission": {"frequency": 250.0, "backlash": 1e-4}, **CALIBRATED}
    ),
    "unequal legs": Lab(0.14, 0.085, 0.11, 0.41, 3.0, {**CALIBRATED, **LOADS}),
    "a metre": Lab(0.6, 0.4, 0.5, 4.0, 120.0, {**ASSEMBLED, **GYROSCOPE}),
}


def file_of(lab: Lab, directory: Path) -> str:
    inertia = 0.02 * lab.torque * lab.proximal
    content = {
        "format": 1,
        "name": "lab",
        "lengths_m": {
            "a": lab.base,
            "l_11": lab.proximal,
            "l_12": lab.distal,
            "l_21": lab.proximal,
            "l_22": lab.distal,
        },
        "inertias_kg_m2": {"zz_11R": inertia, "zz_21R": inertia},
        "mass_kg": {"m": lab.mass},
        "friction": {"f_s11": 0.03 * lab.torque, "f_s21": 0.03 * lab.torque, "f_off11": 0.0, "f_off21": 0.0}
        | {"width_rad_s": 0.02},
        "home_m": [0.0, 1.5 * lab.proximal],
        "drives": {"torque_limit": lab.torque, "joint_speed_limit": 20.0, "encoder_counts": 80_000, "delay_samples": 1},
        **lab.declared,
    }
    path = directory / "lab.yaml"
    path.write_text(yaml_text(content), encoding="utf-8")
    return str(path)


def goal_of(robot: str) -> tuple[float, float]:
    """Return a place on the axis, in the other assembly mode than the rest."""
    file = read_robot(robot)
    height = file.home_m[1]
    rest = place_at(file.five_bar(), HOME_MODE, *file.home_m).assembly
    return next(
        (0.0, share * height)
        for share in (0.5, 0.4, 0.3, 0.2, 0.1, 0.0, -0.1, -0.2)
        if place_at(file.five_bar(), HOME_MODE, 0.0, share * height).assembly == -rest
    )


def asked_by_goto(robot: str) -> Request:
    home, (torque, speed) = read_robot(robot).home_m, within_drives(robot, None, None)
    assembly = "-" if place_at(read_robot(robot).five_bar(), HOME_MODE, *home).assembly > 0 else "+"
    return Request(
        *goal_of(robot),
        assembly=assembly,
        working_mode=None,
        start=Start(*home, HOME_MODE),
        controller="unified",
        robot=robot,
        torque_limit=torque,
        motor_speed=speed,
        rate_hz=500,
        duration=Speed.COMFORTABLE,
    )


def as_judged(scenario: Scenario) -> dict[str, Any]:
    """Return what decides about a scenario's run: without its name, and with what its robot declares written out."""
    content = scenario.model_dump(exclude={"name"})
    content["tolerances"], content["loads"] = scenario.known_within(), scenario.to_bear()
    # drawn from one robot to the next; and the engine renders no pictures
    del content["plant"]["transmission"]["rotor_share"], content["camera"]["pictures"]
    return content


@pytest.mark.parametrize("name", LABS)
def test_a_scenario_of_a_robot_has_by_default_what_studies_make_of_its_file(name: str, tmp_path: Path) -> None:
    robot = file_of(LABS[name], tmp_path)
    rig = find_rig(f"robot:{robot}")
    common = {
        "name": "x",
        "robot": robot,
        "controller": "unified",
        "waypoints": (read_robot(robot).home_m, goal_of(robot)),
    }
    plain = validate(common, Scenario, "plain")
    studied = validate(rig.content(plain, "unified"), Scenario, "studied")
    assert as_judged(plain) == as_judged(studied)
    assert declared_errors(plain) == rig.errors
    compared = ComparisonCase(plain, "unified", 1.0, f"robot:{robot}").scenario()
    assert as_judged(compared) == as_judged(plain)
    # nothing of it is left at what suits an exactly known robot
    assert plain.estimated and plain.plant.motors.ripple > 0.0
    assert plain.ekf.play > 0.0 or not LABS[name].declared.get("transmission")
    assert plain.error_tolerance == pytest.approx(2e-3 * (LABS[name].proximal + LABS[name].distal) / 0.18, abs=1e-6)


@pytest.mark.extra
@pytest.mark.timeout(1800)  # the compilation alone takes minutes on a busy machine
@pytest.mark.parametrize("name", LABS)
def test_goto_assess_odds_and_a_run_say_the_same_of_a_motion(name: str, tmp_path: Path) -> None:
    robot = file_of(LABS[name], tmp_path)
    asked = asked_by_goto(robot)
    assessed = request_for(Typical("across", goal_of(robot), asked.assembly or ""), robot, "unified")
    verdicts = []
    for request in (asked, assessed):
        try:
            verdicts.append(plan_likely(request))
        except InputError as refusal:
            verdicts.append(str(refusal))
    by_goto, by_assess = verdicts
    if isinstance(by_goto, str) or isinstance(by_assess, str):
        assert by_goto == by_assess
        return
    assert as_judged(by_goto.scenario) == as_judged(by_assess.scenario)
    assert by_goto.odds == by_assess.odds == declared_odds(by_goto.scenario)
    # as by `fivebar odds` and by a run of the scenario that goto keeps
    file = tmp_path / "scenario.yaml"
    file.write_text(by_goto.scenario.to_yaml(), encoding="utf-8")
    assert load_with_odds(str(file)).odds == by_goto.odds
    # as by a study of the robot
    rig = find_rig(f"robot:{robot}")
    studied = validate(rig.content(by_goto.scenario, "unified"), Scenario, "studied")
    assert trials_of(studied, rig.errors, SEED, STATED_ROBOTS).odds == by_goto.odds
