# SPDX-License-Identifier: Apache-2.0
"""The rigs of a sweep: their robots are what the page says, the motions are the same, and each can be run again."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_bringup.odds.robot_errors import drawn_effects
from fivebar_bringup.scenario import Scenario
from fivebar_control.laws.lqr import LqrSettings, linearised, lqr_gains
from fivebar_control.model.geometry import workspace_margin
from fivebar_control.model.state import Platform
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_control.trajectory.time_laws import OPTIMAL, QUINTIC
from fivebar_description.robot_file import load_robot, read_robot, robot_path
from fivebar_description.strict_yaml import InputError, validate
from fivebar_sim.effects.encoders import EncoderErrors
from fivebar_sim.effects.links import LinkErrors
from fivebar_sim.effects.settings import PlantSettings, has_effects
from fivebar_studies.compare.cases import COMPARED_RIGS
from fivebar_studies.rigs.named import find_rig, rig_directory, shipped_rigs
from fivebar_studies.rigs.rig import merged
from fivebar_studies.sweep.drawing import VARIED, Draw, draw, on_robot, plan_of
from fivebar_studies.sweep.planning import screened, timed_for_loads
from fivebar_studies.sweep.rows import FEASIBLE, SweepRow
from fivebar_studies.sweep.running import run_and_judge
from fivebar_studies.sweep.statistics import silence_table, within_table

SEED = 11
DOCUMENT = Path(__file__).parents[4] / "docs/sweeps.md"
DEGREE = math.pi / 180.0
OF_DEXTAR = ("ideal", "encoders", "calibrated", "good", "middling", "poor")
OF_THE_BENCH = ("printed", "printed_calibrated", "printed_encoders")


def planned(count: int) -> list[int]:
    """Numbers of cases that the planner accepts."""
    found: list[int] = []
    number = 0
    while len(found) < count:
        try:
            plan_of(draw(SEED, number))
            found.append(number)
        except InputError:
            pass
        number += 1
    return found


@pytest.fixture(scope="module")
def numbers() -> tuple[int, ...]:
    return tuple(planned(40))


@cache
def plants(rig: str, numbers: tuple[int, ...]) -> list[PlantSettings]:
    return [draw(SEED, number, rig).scenario("unified").plant for number in numbers]


def spread(values: list[float]) -> tuple[float, float]:
    return min(values), max(values)


def test_the_rigs_are_those_of_the_page() -> None:
    page = DOCUMENT.read_text(encoding="utf-8")
    assert set(shipped_rigs()) == {*OF_DEXTAR, *OF_THE_BENCH, *COMPARED_RIGS}
    for name in shipped_rigs():
        assert f"`{name}`" in page
        assert find_rig(name).robot == ("motkin" if name in OF_THE_BENCH else "dextar")


def test_a_rig_says_what_it_is_and_how_many_crossings_are_required() -> None:
    required = {name: find_rig(name).required for name in ("ideal", "calibrated", "good", "middling", "printed")}
    assert list(required.values()) == [0.999, 0.999, 0.99, 0.95, 0.999]
    described = find_rig("middling").described
    assert "drawn: mass_and_inertia 0.05, coulomb_friction 0.15, length 0.0002" in described
    assert "transmission.frequency 60" in described and "Left out: eccentric encoders" in described


@pytest.mark.parametrize(
    ("rig", "length", "zero", "tilt", "force", "lost"),
    [
        ("calibrated", 2e-5, 0.01, 2.0, 1.0, 2),
        ("good", 2e-5, 0.01, 2.0, 1.0, 2),
        ("middling", 2e-4, 0.2, 4.0, 2.0, 3),
        ("poor", 3e-4, 0.3, 4.0, 2.0, 3),
    ],
)
def test_robots_spread_over_the_stated_tolerances_and_not_beyond(
    rig: str, length: float, zero: float, tilt: float, force: float, lost: int, numbers: tuple[int, ...]
) -> None:
    robots = plants(rig, numbers)
    for values, bound in (
        ([value for plant in robots for value in plant.links[:6]], length),
        ([value for plant in robots for value in plant.encoders[:2]], zero * DEGREE),
        ([plant.mass_scale - 1.0 for plant in robots], 0.05),
        ([plant.inertia_scale - 1.0 for plant in robots], 0.05),
        ([plant.friction_scale - 1.0 for plant in robots], 0.15),
        ([value for plant in robots for value in plant.motors[:2]], 0.05),
    ):
        least, largest = spread(values)
        assert -bound <= least < -0.7 * bound and 0.7 * bound < largest <= bound
    for values, bound in (
        ([plant.tilt.angle for plant in robots], tilt * DEGREE),
        ([plant.push.force for plant in robots], force),
    ):
        least, largest = spread(values)
        assert 0.0 <= least < 0.3 * bound and 0.7 * bound < largest <= bound
    assert {plant.bus.lost_commands for plant in robots} == {lost}
    assert {(plant.encoder_counts, plant.delay_samples, plant.torque_limit) for plant in robots} == {(20_000, 1, 2.0)}
    assert len({plant.seed for plant in robots}) == len(robots)


@pytest.mark.parametrize(
    ("rig", "frequency", "backlash", "stiffness", "clearance", "passive", "cogging"),
    [
        ("calibrated", 0.0, 0.0, 0.0, 0.0, 0.003, 0.04),
        ("good", 250.0, 0.005, 1e6, 5e-6, 0.003, 0.04),
        ("middling", 60.0, 0.03, 3e5, 2e-5, 0.01, 0.06),
        ("poor", 40.0, 0.1, 1e5, 2e-5, 0.01, 0.06),
    ],
)
def test_robots_have_the_stated_mechanics_and_drives(
    rig: str,
    frequency: float,
    backlash: float,
    stiffness: float,
    clearance: float,
    passive: float,
    cogging: float,
    numbers: tuple[int, ...],
) -> None:
    for plant in plants(rig, numbers)[:5]:
        assert plant.transmission.frequency == frequency
        assert plant.transmission.backlash == pytest.approx(backlash * DEGREE)
        assert (plant.platform_joint.stiffness, plant.platform_joint.clearance) == (stiffness, clearance)
        assert (plant.friction.passive, plant.friction.stribeck, plant.friction.viscous) == (passive, 1.3, 0.01)
        assert (plant.motors.cogging, plant.motors.ripple, plant.motors.current_loop_hz) == (cogging, 0.03, 1000.0)
    shares = [plant.transmission.rotor_share for plant in plants(rig, numbers)]
    assert all(0.5 <= share <= 0.85 for share in shares)


def test_robots_with_a_gyroscope_are_stopped_before_they_leave_5_mm(numbers: tuple[int, ...]) -> None:
    limits = {rig: draw(SEED, numbers[0], rig).scenario("unified").tracking_error_limit for rig in OF_DEXTAR}
    assert {rig for rig, limit in limits.items() if limit < 5e-3} == {"calibrated", "good", "middling", "poor"}


def test_ideal_and_encoders_are_free_of_effects(numbers: tuple[int, ...]) -> None:
    (ideal,) = set(plants("ideal", numbers[:5]))
    assert ideal == PlantSettings(torque_limit=2.0)
    for plant in plants("encoders", numbers[:5]):
        assert not has_effects(plant)
        assert plant.encoder_counts == 20_000 and 0.0 < abs(plant.mass_scale - 1.0) <= 0.15


def test_all_rigs_have_the_same_motions_and_robots_in_proportion(numbers: tuple[int, ...]) -> None:
    motions = {rig: [draw(SEED, number, rig)[:8] for number in numbers] for rig in (VARIED, *OF_DEXTAR)}
    assert all(motion == motions[VARIED] for motion in motions.values())
    good, poor = plants("good", numbers[:3]), plants("poor", numbers[:3])
    for one, other in zip(good, poor, strict=True):
        assert np.array(other.links[:6]) == pytest.approx(15.0 * np.array(one.links[:6]))


def test_the_bench_has_its_own_motions_torques_and_encoders() -> None:
    case = next(one for one in (draw(SEED, number, "printed") for number in range(99)) if _is_planned(one))
    scenario, robot = case.scenario("unified"), read_robot("motkin")
    assert scenario.robot == "motkin" and case[:8] != draw(SEED, case.number)[:8]
    assert workspace_margin(load_robot("motkin"), case.start_x, case.start_y) > 0.0
    assert (scenario.plant.torque_limit, scenario.plant.encoder_counts) == (0.186, 16_384)
    assert scenario.plant.torque_quantum == pytest.approx(0.002 * 0.035 / 0.55)
    assert scenario.safety.joint_speed_limit == robot.drives.joint_speed_limit
    assert max(map(abs, scenario.plant.links[:6])) <= 3e-4 and scenario.plant.motors.cogging == 0.002
    assert scenario.ekf.gyro and not on_robot(case, "printed_encoders").scenario("unified").ekf.gyro
    calibrated = on_robot(case, "printed_calibrated").scenario("unified").plant
    assert calibrated.links.l_11 == pytest.approx(scenario.plant.links.l_11 / 6.0)


def _is_planned(case: Draw) -> bool:
    try:
        plan_of(case)
    except InputError:
        return False
    return True


def test_the_push_meets_the_robot_on_the_locus(numbers: tuple[int, ...]) -> None:
    for number in numbers:
        case = draw(SEED, number, "calibrated")
        push, bus = case.scenario("unified").plant.push, case.scenario("unified").plant.bus
        crossing = plan_of(case).crossings[0].time
        assert push.start <= crossing <= push.start + push.length
        assert bus.lost_from <= crossing <= bus.lost_from + bus.lost_within


def test_a_case_in_another_time_is_what_is_checked_anew_and_keeps_what_its_rig_says(
    numbers: tuple[int, ...], tmp_path: Path
) -> None:
    content = yaml.safe_load((rig_directory() / "calibrated.yaml").read_text(encoding="utf-8"))
    content["scenario"]["plant"] |= {"seed": 7, "push": {"heading": 1.0}}
    own = tmp_path / "own.yaml"
    own.write_text(yaml.safe_dump(content), encoding="utf-8")
    drawn = draw(SEED, numbers[0], str(own))
    for duration, time_law in ((drawn.duration, QUINTIC), (1.3, OPTIMAL)):
        case = drawn._replace(duration=duration, time_law=time_law)
        effects = drawn_effects(find_rig(str(own)).errors, SEED, case.number, plan_of(case).crossings[0].time)
        scenario = case.scenario("multi_cartesian")
        assert scenario == case.with_effects("multi_cartesian", effects)
        assert (scenario.plant.seed, scenario.plant.push.heading) == (7, 1.0)
        assert (scenario.durations(), scenario.time_law) == ((duration,), time_law)


@pytest.mark.extra
def test_a_drawn_robot_is_a_scenario_that_is_run_again(numbers: tuple[int, ...]) -> None:
    case = draw(SEED, numbers[0], "middling")
    scenario = case.scenario("unified")
    written = validate(yaml.safe_load(scenario.to_yaml()), Scenario, "again")
    assert written.plant == scenario.plant != PlantSettings()
    assert run_and_judge(written, written.plan()) == run_and_judge(scenario, plan_of(case))


def test_a_robot_is_drawn_by_seed_number_and_rig_alone(numbers: tuple[int, ...]) -> None:
    number = numbers[0]
    assert draw(SEED, number, "poor").scenario("ctc").plant == draw(SEED, number, "poor").scenario("unified").plant
    one = draw(SEED, number, "poor").scenario("unified").plant
    assert one.links != LinkErrors() and one.encoders != EncoderErrors()


def test_a_crossing_too_slow_for_the_declared_loads_is_made_quicker() -> None:
    slow = draw(91, 9, "middling")
    quick = timed_for_loads(slow)
    assert quick.drawn_duration == slow.duration > 2.0 * quick.duration
    assert quick._replace(duration=slow.duration, drawn_duration=None, time_law=QUINTIC) == slow
    without_loads = draw(91, 9, "encoders")
    assert timed_for_loads(without_loads) == without_loads


@pytest.mark.parametrize(("number", "slower", "factor"), [(3, True, 1.0 / 1.4), (6, False, 1.4)])
def test_a_crossing_is_made_slower_unless_that_takes_the_platform_farther(
    number: int, slower: bool, factor: float
) -> None:
    drawn = draw(75, number, "calibrated")
    timed = timed_for_loads(drawn)
    assert timed.drawn_duration == drawn.duration
    assert (timed.duration == pytest.approx(1.4 * drawn.duration)) is slower
    other = timed._replace(duration=factor * timed.duration)
    verdicts = [screened(other._replace(time_law=law), "unified") for law in (QUINTIC, OPTIMAL)]
    best = min(verdict.expected_distance for verdict in verdicts if verdict.feasible)
    assert screened(timed, "unified").expected_distance < best


@pytest.mark.parametrize(
    ("seed", "number", "rig", "law"),
    [
        # the polynomial asks for too much torque
        (75, 4, "calibrated", OPTIMAL),
        (91, 9, "middling", OPTIMAL),
        (91, 2, "calibrated", QUINTIC),
        # the loads that are not risked would hardly displace it by either
        (91, 1110, "calibrated", QUINTIC),
        (75, 3, "encoders", QUINTIC),
    ],
)
def test_the_time_law_is_the_one_that_keeps_nearer(seed: int, number: int, rig: str, law: str) -> None:
    timed = timed_for_loads(draw(seed, number, rig))
    assert timed.time_law == law == timed.scenario("unified").time_law
    verdicts = {}
    for one in (QUINTIC, OPTIMAL):
        case = timed._replace(time_law=one)
        verdicts[one] = screened(case, "unified")
    if rig != "encoders":
        less = verdicts[OPTIMAL].expected_distance < 0.9 * verdicts[QUINTIC].expected_distance
        assert (law == OPTIMAL) == (less or not verdicts[QUINTIC].feasible)


def test_only_the_blended_controllers_let_the_estimator_find_disturbances_quickly() -> None:
    for rig in ("calibrated", "good", "middling", "poor"):
        case = draw(41, 128, rig)
        rates = {name: case.scenario(name).ekf.disturbance_rate for name in ("unified", "multi_joint")}
        assert rates["unified"] < rates["multi_joint"] == 1.0


@pytest.mark.parametrize("rig", ["calibrated", "good", "middling", "poor", "printed"])
@pytest.mark.parametrize("controller", ["mpc", "lqr"])
def test_what_stands_in_for_mpc_and_lqr_has_the_gains_that_the_rig_bears(rig: str, controller: str) -> None:
    case = draw(75, 4, rig)
    given = find_rig(rig).scenario["unified"]
    used = tuned_controller(case.with_effects(controller, {})).nominal.feedback
    assert (used.kp, used.kd, used.weight) == (given["kp"], given["kd"], given["weight"])


@pytest.mark.extra
def test_the_regulator_is_as_soft_on_poor_transmissions_as_the_gains_of_unified() -> None:
    scenario = draw(75, 4, "poor").with_effects("lqr", {})
    robot, modes = scenario.five_bar(), scenario.working_mode
    # at rest, far from the locus, where the regulator is that of a constant system
    rest = Platform(0.0, 0.15, 0.0, 0.0, 0.0, 0.0)
    stiffness = []
    for settings in (LqrSettings(), tuned_controller(scenario).nominal.settings):
        assert isinstance(settings, LqrSettings)
        gain = lqr_gains(robot, modes, [rest], 0.002, settings)[rest]
        here = linearised(robot, modes, rest, 0.002)
        assert here is not None
        fed_back = here.inputs[2:] / 0.002 @ np.array([gain.row1, gain.row2])
        stiffness.append(np.linalg.eigvals(fed_back[:, :2]).real)
    usual, soft = stiffness
    assert np.all((soft > 200.0) & (soft < 800.0)) and np.all(usual > 8.0 * soft)


def row(**fields: float | None) -> SweepRow:
    case = Draw(0, 1, -1, 0.0, 0.1, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, None, 0)
    return SweepRow(0, "unified", FEASIBLE, "", False, "", *case[1:], crossings=1, mode_changes=1)._replace(**fields)


@pytest.mark.parametrize(
    ("run", "silent"),
    [
        (row(), False),
        (row(left_time=0.5), True),
        (row(left_time=0.5, fault_time=0.54), False),
        (row(left_time=0.5, fault_time=0.56), True),
        (row(left_time=0.5, fault_time=0.2), False),
        (row(mode_changes=3), True),
        (row(mode_changes=3, fault_time=0.2), False),
    ],
)
def test_a_failure_is_silent_without_a_fault_in_time(run: SweepRow, silent: bool) -> None:
    assert run.silent is silent
    (line,) = [line for line in silence_table([run]).rows if line[0].text == "unified" and line[1].text == "feasible"]
    assert line[4].value == int(silent)


@pytest.mark.parametrize(
    ("run", "within"),
    [
        (row(error_peak=1.9e-3), (1, 1)),
        (row(error_peak=2e-3), (0, 1)),
        (row(error_peak=5e-3), (0, 0)),
        (row(error_peak=math.nan), (0, 0)),
        (row(error_peak=1e-3, mode_changes=3), (0, 0)),
        (row(error_peak=1e-3)._replace(fault="tracking_lost"), (0, 0)),
    ],
)
def test_what_stays_within_2_and_5_mm_has_no_fault_and_the_planned_mode(run: SweepRow, within: tuple[int, int]) -> None:
    lines = [line for line in within_table([run]).rows if line[0].text == "unified"]
    assert [line[1].value for line in lines] == [2e-3, 5e-3]
    assert tuple(line[3].value for line in lines) == within


def test_a_fixed_robot_is_the_same_in_every_case(numbers: tuple[int, ...]) -> None:
    (wrong,) = set(plants("wrong", numbers[:3]))
    assert wrong == PlantSettings(torque_limit=2.0, mass_scale=1.1, inertia_scale=0.9, friction_scale=0.8)
    assert draw(SEED, numbers[0], "wrong").mass_scale == 1.1


def own_rig(folder: Path, **changes: Any) -> Path:
    """A copy of the shipped rig `good`, with some of its keys changed."""
    content = yaml.safe_load((rig_directory() / "good.yaml").read_text(encoding="utf-8"))
    file = folder / "mine.yaml"
    file.write_text(yaml.safe_dump(merged(content, changes)), encoding="utf-8")
    return file


def test_a_rig_of_ones_own_is_drawn_from(tmp_path: Path, numbers: tuple[int, ...]) -> None:
    """Equal random numbers make the same robot, but for what the file says otherwise."""
    softer = {"scenario": {"plant": {"transmission": {"frequency": 100.0}}}}
    own = str(own_rig(tmp_path, robot="other.yaml", errors={"length": 4e-5}, **softer))
    (tmp_path / "other.yaml").write_text(robot_path("dextar").read_text(encoding="utf-8"), encoding="utf-8")
    shipped, mine = (draw(SEED, numbers[0], rig).scenario("unified") for rig in ("good", own))
    assert mine.robot == str(tmp_path / "other.yaml")
    assert np.array(mine.plant.links[:6]) == pytest.approx(2.0 * np.array(shipped.plant.links[:6]))
    assert mine.plant.transmission == shipped.plant.transmission._replace(frequency=100.0)
    assert (mine.ekf, mine.imu, mine.plant.push) == (shipped.ekf, shipped.imu, shipped.plant.push)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"rotor": 1}, ["rotor", "unknown key"]),
        ({"required": 1.5}, ["required", "1.5", "at most 1"]),
        ({"errors": {"lengths": 1e-4}}, ["errors.lengths", "length"]),
        ({"errors": {"zero": -0.1}}, ["errors.zero", "-0.1"]),
        ({"errors": {"rotor_share": [0.8, 0.5]}}, ["errors.rotor_share", "smaller one first"]),
        ({"robot": "dextra"}, ["robot", "'dextra'", "dextar"]),
        ({"scenario": {"waypoints": [[0.0, 0.1]]}}, ["scenario", "waypoints", "expected one of"]),
        ({"scenario": {"ekf": {"gyrro": True}}}, ["scenario", "ekf.gyrro"]),
        ({"scenario": {"plant": {"friction": {"viscous": "much"}}}}, ["scenario", "plant.friction.viscous", "much"]),
        ({"scenario": {"plant": {"torque_limit": 3.0}}}, ["scenario", "plant.torque_limit", "3.0"]),
        ({"scenario": {"plant": []}}, ["scenario", "plant"]),
        ({"scenario": {"ekf": {"camera": True}}}, ["scenario", "ekf.camera", "there is no camera"]),
        ({"blended": {"ekf": {"disturbance_rate": -1.0}}}, ["blended", "ekf.disturbance_rate", "-1.0"]),
        ({"laws": {"mpcc": {}}}, ["laws", "mpcc", "mpc"]),
        ({"laws": {"lqr": {"wait": 1.0}}}, ["laws.lqr", "law.wait"]),
        ({"scenario": {"plant": {"transmission": {"frequency": 0.0}}}}, ["transmission"]),
    ],
)
def test_a_mistake_in_a_rig_is_named(changes: dict[str, Any], named: list[str], tmp_path: Path) -> None:
    file = own_rig(tmp_path, **changes)
    done = CliRunner().invoke(app, ["sweep", "--rig", str(file), "--case", "1"])
    assert done.exit_code == 2
    assert len(done.stderr.splitlines()) == 1
    assert not [words for words in (str(file), *named) if words not in done.stderr], done.stderr


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["sweep", "--rig", "worn"], ["--rig", "'worn'", "calibrated", "encoders", "good", "path to a .yaml file"]),
        (["sweep", "--rig", "gone.yaml"], ["gone.yaml"]),
        (["benchmark", "--rigs", "good,printed"], ["--rig", "'printed'", "motkin", "dextar"]),
    ],
)
def test_an_unknown_rig_is_refused(words: list[str], named: list[str]) -> None:
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 2
    assert not [one for one in named if one not in done.stderr], done.stderr
