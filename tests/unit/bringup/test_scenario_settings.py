# SPDX-License-Identifier: Apache-2.0
"""The sections of a scenario: the same values are allowed in a file and as parameters of a node."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from operator import attrgetter
from pathlib import Path
from typing import Any

import pytest
import yaml

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import read_scenario
from fivebar_control.estimation.camera import CAMERA_GATE
from fivebar_control.estimation.constants import CAMERA_LATENCY, MISFIT_TIME, OFFSET_TIME
from fivebar_control.estimation.settings import EkfSettings
from fivebar_control.laws.gains import UnifiedSettings
from fivebar_control.planning.feasibility import LIKELIEST_WRONG_MODE
from fivebar_control.planning.pacing import LOAD_AIM
from fivebar_control.safety.brake import BRAKE_KAPPA, BRAKE_TIME
from fivebar_control.safety.settings import Area
from fivebar_control.scenario.guard_settings import guard_settings, motor_torque_limit
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_control.scenario.robot_defaults import expected_force
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_control.scenario.stopping import stop_cycles
from fivebar_description.loads import Loads
from fivebar_description.robot_file import read_robot
from fivebar_description.scenario_file import CONSTANTS, KEYS
from fivebar_description.settings import Declared, Keys, declared, keys_of, with_keys
from fivebar_description.settings import sections as settings_sections
from fivebar_description.strict_yaml import InputError, validate
from fivebar_description.tolerances import Tolerances
from fivebar_sim.effects.settings import PlantSettings
from fivebar_sim.scenario import SimulatedRobot

GOOD = {"name": "any", "waypoints": [[0.0, 0.15], [0.0, 0.02]]}


def sections() -> dict[str, tuple[Any, Keys]]:
    """The sections that hold the settings of a component, with the NamedTuple of each."""
    return {
        name: (field.annotation, keys)
        for name, field in Scenario.model_fields.items()
        for keys in field.metadata
        if isinstance(keys, Keys)
    }


def within(path: str, settings: Any, without: Collection[str] = ()) -> Iterator[tuple[str, Declared]]:
    """The settings of a section and of those within it, each with the path of its section."""
    yield from ((path, one) for one in declared(settings) if one.name not in without)
    for name, inner in settings_sections(settings).items():
        yield from within(f"{path}.{name}", inner)


SETTINGS = [one for section, (settings, keys) in sections().items() for one in within(section, settings, keys.without)]


def scenario(**content: Any) -> Scenario:
    return validate({**GOOD, **content}, Scenario, "any.yaml")


def allowed_in_a_file(section: str, name: str, value: Any) -> bool:
    content: Any = {name: value}
    outer, *inner = section.split(".")
    for key in reversed(inner):
        content = {key: content}
    try:
        scenario(**{outer: content})
    except InputError as error:
        assert str(error).startswith(f"any.yaml: {section}.{name}")
        return False
    return True


def probes(one: Declared) -> list[Any]:
    """Values on both sides of each bound, and some that are hardly ever right."""
    if one.kind is str:
        return [*one.setting.choices, "", "no such word"]
    if one.kind is bool:
        return [True, False]
    if one.kind not in (float, int):
        return [[1.0] * length for length in (2, 3, 4, 5)] + [[-0.1, 0.1, 0.0, 0.2], [0.1, -0.1, 0.0, 0.2]]
    bounds = (one.setting.at_least, one.setting.above, one.setting.at_most, one.setting.below)
    numbers = [number for bound in bounds if bound is not None for number in (bound, bound - 1, bound + 1)]
    return [one.kind(number) for number in (*numbers, 0, 1, -1, 3)]


def test_file_and_node_refuse_the_same_values() -> None:
    differing = []
    for section, one in SETTINGS:
        for value in probes(one):
            if value == one.none:
                # in a node's parameters that is null
                continue
            parameter = tuple(value) if isinstance(value, list) else value
            if allowed_in_a_file(section, one.name, value) != (one.problem(parameter) is None):
                differing.append(f"{section}.{one.name}: {value}")
        if allowed_in_a_file(section, one.name, None) != (one.optional or one.setting.unlimited):
            differing.append(f"{section}.{one.name}: null")
    assert len(SETTINGS) > 150
    assert not differing


def test_a_file_refuses_what_is_no_value_at_all() -> None:
    taken = [
        f"{section}.{one.name}: {value}"
        for section, one in SETTINGS
        for value in (math.nan, math.inf, -math.inf, {}, [math.nan])
        if allowed_in_a_file(section, one.name, value)
    ]
    assert not taken


@pytest.mark.parametrize("section", sections())
def test_defaults_come_through_file_and_parameters(section: str) -> None:
    settings, keys = sections()[section]
    written = yaml.safe_load(scenario().to_yaml())
    assert set(written[section]) == set(settings._fields) - set(keys.without)
    assert getattr(validate(written, Scenario, "again"), section) == settings()
    keys = keys_of(Scenario, (section,))
    read = validate(written, Scenario, "again")
    parameters = {key.name: key.to_parameter(attrgetter(key.name)(read)) for key in keys}
    assert not any(value is None or value == [] for value in parameters.values())
    back = {key.name: key.to_file(parameters[key.name]) for key in keys}
    assert getattr(validate(with_keys(written, back), Scenario, "parameters"), section) == settings()


def test_the_tracking_limit_is_no_key_of_the_section_safety() -> None:
    with pytest.raises(InputError, match=r"unknown key \(did you mean tracking_error_limit\?\)$"):
        scenario(safety={"tracking_error_limit": 0.1})
    assert guard_settings(scenario(tracking_error_limit=0.1)).tracking_error_limit == 0.1
    with pytest.raises(InputError, match=r"^any.yaml: tracking_error_limit: 0.0: expected at least"):
        scenario(tracking_error_limit=0.0)


@pytest.mark.parametrize(
    ("safety", "drives", "limit"), [(None, 10.0, 10.0), (3.0, 10.0, 3.0), (30.0, 10.0, 10.0), (3.0, None, 3.0)]
)
def test_the_lesser_torque_limit_holds(safety: float | None, drives: float | None, limit: float) -> None:
    given = scenario(safety={"torque_limit": safety}, plant={"torque_limit": drives})
    assert motor_torque_limit(given) == guard_settings(given).torque_limit == limit


def test_without_any_torque_limit_there_is_none() -> None:
    given = scenario(plant={"torque_limit": None})
    assert motor_torque_limit(given) is None
    assert guard_settings(given).torque_limit == math.inf


def test_a_workspace_is_read_and_written_as_four_numbers() -> None:
    given = scenario(safety={"workspace": [-0.1, 0.1, 0, 0.2]})
    assert given.safety.workspace == Area(-0.1, 0.1, 0.0, 0.2)
    assert yaml.safe_load(given.to_yaml())["safety"]["workspace"] == [-0.1, 0.1, 0.0, 0.2]
    with pytest.raises(InputError, match=r"safety.workspace: \[0.1, -0.1, 0, 0.2\]: expected x_min < x_max"):
        scenario(safety={"workspace": [0.1, -0.1, 0, 0.2]})


@pytest.mark.parametrize("name", ["", "two words", "../up", ".hidden", "a/b"])
def test_a_name_that_is_no_directory_is_refused(name: str) -> None:
    with pytest.raises(InputError, match=r"any.yaml: name: .*: expected a letter or digit"):
        scenario(name=name)


@pytest.mark.parametrize(
    ("rate_hz", "safety", "cycles"),
    [
        (500, {}, 10),
        (1000, {}, 20),
        # not faster than bridge, blender and drives can report one after the other
        (100, {}, 3),
        (500, {"stop_time_ms": 12.0}, 6),
        (500, {"stop_time_ms": 1.0}, 3),
        (500, {"stop_time_ms": 12.0, "stop_cycles": 2}, 2),
    ],
)
def test_how_long_the_last_torque_is_held(rate_hz: int, safety: dict[str, Any], cycles: int) -> None:
    scenario = validate({**GOOD, "rate_hz": rate_hz, "segment_duration": 0.5, "safety": safety}, Scenario, "any")
    assert stop_cycles(scenario) == cycles


BENCH = {"robot": "motkin", "waypoints": [[0.0, 0.12], [0.0, 0.0]], "controller": "unified"}


def test_torques_and_sensors_follow_from_the_robot() -> None:
    bench, dextar = scenario(**BENCH), scenario(controller="unified")
    assert dextar.unified == UnifiedSettings()
    assert dextar.ekf == EkfSettings()
    assert (dextar.estimator, dextar.plant) == ("none", PlantSettings())
    assert bench.unified.weight == pytest.approx(3.0 * (0.55 / 0.035) ** 2)
    assert bench.unified.disturbance_limit == pytest.approx(0.5 * 0.035 / 0.55)
    assert (bench.unified.kp, bench.unified.kd, bench.unified.observer_rate) == (14400.0, 240.0, 90.0)
    assert bench.ekf.disturbance_initial == pytest.approx(0.1 * 0.035 / 0.55)
    assert (bench.estimator, bench.plant.encoder_counts, bench.plant.delay_samples) == ("ekf", 16384, 1)
    assert motor_torque_limit(bench) == 0.186
    assert validate(yaml.safe_load(bench.to_yaml()), Scenario, "again") == bench


def test_the_estimator_expects_the_force_that_the_loads_of_the_robot_come_to(tmp_path: Path) -> None:
    file = read_robot("dextar")
    robot = file.five_bar()
    lasting = robot.mass * 9.80665 * math.sin(0.07) + 0.01 * 4.0 / robot.leg1.distal
    assert expected_force(robot, Loads(tilt=0.07, passive=0.01)) == pytest.approx(lasting, rel=1e-4)
    assert expected_force(robot, Loads(tilt=0.07, passive=0.01, push=2.0)) == 2.0 > lasting
    loads = {"tilt": 0.07, "push": 2.0, "passive": 0.01}
    for tuning, force in (({}, 2.0), ({"force_deviation": 0.5}, 0.5)):
        content = {**file.model_dump(mode="json", exclude_none=True), "loads": loads, "tuning": tuning}
        heavy = tmp_path / "heavy.yaml"
        heavy.write_text(yaml.safe_dump(content), encoding="utf-8")
        derived = EkfSettings(force_deviation=force, disturbance_rate=0.3, force_time=0.4)
        assert scenario(robot=str(heavy)).ekf == derived
        assert scenario(robot=str(heavy), ekf={"force_deviation": 0.0}).ekf == derived._replace(force_deviation=0.0)


@pytest.mark.parametrize("controller", ["mpc", "lqr"])
def test_the_law_that_stands_in_has_the_size_of_the_robot(controller: str) -> None:
    bench, dextar = (tuned_controller(scenario(**{**given, "controller": controller})).nominal for given in (BENCH, {}))
    limit = {} if controller == "lqr" else {"disturbance_limit": 0.5 * 0.035 / 0.55}
    sized = {"fallback_kp": 14400.0, "fallback_kd": 240.0, "fallback_weight": 3.0 * (0.55 / 0.035) ** 2, **limit}
    assert {name: getattr(bench.settings, name) for name in sized} == pytest.approx(sized)
    default = dextar.law.settings()
    assert {name: getattr(dextar.settings, name) for name in sized} == {name: getattr(default, name) for name in sized}
    weighted = scenario(**{**BENCH, "controller": controller}, law={"fallback_weight": 5.0})
    given = tuned_controller(weighted).nominal.settings
    assert (given.fallback_weight, given.fallback_kp) == (5.0, 14400.0)


def test_what_a_scenario_says_comes_before_what_the_robot_does() -> None:
    given = scenario(**BENCH, estimator="none", unified={"weight": 5.0}, plant={"torque_limit": 0.1})
    assert (given.unified.weight, given.unified.kp, given.plant.torque_limit) == (5.0, 14400.0, 0.1)
    assert (given.estimator, given.plant.encoder_counts, given.plant.delay_samples) == ("none", None, 0)
    type_1 = scenario(**BENCH, working_modes=[[1, -1], [1, -1]])
    assert type_1.estimator == "none"


@pytest.mark.parametrize("robot", ["nothing", 3])
def test_an_unknown_robot_is_named_where_it_is_read(robot: Any) -> None:
    with pytest.raises(InputError, match="robot"):
        scenario(robot=robot).five_bar()


def test_each_package_knows_every_key_of_a_scenario() -> None:
    """So that a node refuses a key that no scenario has, and none that another package reads."""
    assert set(KEYS) == set(Scenario.model_fields) == set(ControlScenario.model_fields)
    assert set(SimulatedRobot.model_fields) < set(KEYS)


def test_tolerances_and_loads_are_those_of_the_robot_unless_others_are_given(tmp_path: Path) -> None:
    assert (scenario().known_within(), scenario().to_bear()) == (Tolerances(), Loads())
    content = read_robot("dextar").model_dump(mode="json", exclude_none=True)
    path = tmp_path / "mine.yaml"
    path.write_text(
        yaml.safe_dump({**content, "tolerances": {"length": 2e-4, "zero": 1e-3}, "loads": {"push": 2.0}}),
        encoding="utf-8",
    )
    own = scenario(robot=str(path))
    assert (own.known_within(), own.to_bear()) == (Tolerances(length=2e-4, zero=1e-3), Loads(push=2.0))
    given = scenario(robot=str(path), tolerances={"base": 1e-4}, loads={"push": 1.0})
    assert (given.known_within(), given.to_bear()) == (Tolerances(base=1e-4), Loads(push=1.0))


def test_a_recorded_scenario_may_have_the_constants_as_keys_and_no_other_values(tmp_path: Path) -> None:
    assert CONSTANTS == {
        "safety": {"brake_time": BRAKE_TIME, "brake_kappa": BRAKE_KAPPA},
        "ekf": {
            "misfit_time": MISFIT_TIME,
            "offset_time": OFFSET_TIME,
            "camera_gate": CAMERA_GATE,
            "camera_latency": CAMERA_LATENCY,
        },
        "risk": {"load_aim": LOAD_AIM, "wrong_mode": LIKELIEST_WRONG_MODE},
    }
    file = tmp_path / "recorded.yaml"
    file.write_text(yaml.safe_dump({**GOOD, "ekf": CONSTANTS["ekf"]}), encoding="utf-8")
    assert read_scenario(str(file)) == scenario()
    file.write_text(yaml.safe_dump({**GOOD, "ekf": {"misfit_time": 0.01}}), encoding="utf-8")
    with pytest.raises(InputError, match=r"ekf\.misfit_time: 0\.01: is no setting, but always 0\.02: leave it out$"):
        read_scenario(str(file))
