# SPDX-License-Identifier: Apache-2.0
"""The study of robustness: every effect changes the robot and grows, and failures are found where they begin."""

from __future__ import annotations

import math
import shlex
import shutil
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_bringup.simulation.run_metrics import RunMetrics
from fivebar_control.safety.stages import NO_FAULT, TRACKING_LOST
from fivebar_description.files import share_file
from fivebar_description.robot_file import load_robot
from fivebar_sim.effects.mechanism import mechanism_of
from fivebar_studies.assess.assess import ASSESSMENT
from fivebar_studies.benchmark.study import BENCHMARK
from fivebar_studies.engine.study import Study
from fivebar_studies.rigs.named import find_rig
from fivebar_studies.robustness.effects import BURSTS, DRAWS, EFFECTS, LONGEST_BURST, STEPS, Effect, with_keys
from fivebar_studies.robustness.equipment import prepared
from fivebar_studies.robustness.figures import place_of
from fivebar_studies.robustness.robustness import ROBUSTNESS
from fivebar_studies.robustness.running import (
    FAR,
    WRONG_MODE,
    RobustnessRow,
    RobustnessSettings,
    cause_of,
    limit_of,
    middle_crossing,
    runs_of,
)
from fivebar_studies.robustness.sensor_effects import SENSOR_EFFECTS
from fivebar_studies.robustness.tables import Climb, climbs_of, errors_table, failures_without, first_failures
from fivebar_studies.sweep.sweep import SWEEP
from result_pages.catalogue import PAGES
from result_pages.making import ResultFiles

RESULTS = Path(__file__).parents[4] / "docs/results"
SETTINGS = RobustnessSettings()
GYRO = "unified, gyro"
OUTCOME = RunMetrics(*([0] * len(RunMetrics._fields)))._replace(fault=NO_FAULT, mode_changes=1, error_peak=1e-3)


@pytest.mark.parametrize("effect", [*EFFECTS.values(), *SENSOR_EFFECTS.values()], ids=lambda effect: effect.name)
def test_every_size_of_an_effect_is_a_robot_of_its_own(effect: Effect) -> None:
    exact = prepared(GYRO, 1.0)[0]
    assert len(effect.sizes) == STEPS
    assert list(effect.sizes) == sorted(set(effect.sizes), reverse=effect.falls)
    robots = [with_keys(exact, effect.keys(size, 0, 0.5)) for size in effect.sizes]
    assert len({(robot.plant, robot.imu) for robot in (*robots, exact)}) == STEPS + 1
    for robot in (robots[0], robots[-1]):
        for draw in range(DRAWS):
            # does not refuse any of them
            mechanism_of(load_robot("dextar"), with_keys(robot, effect.keys(effect.sizes[-1], draw, 0.5)).plant, 500)


def test_what_is_wrong_with_the_geometry_is_declared_where_it_can_be() -> None:
    robot = with_keys(prepared("unified, encoders", 1.0)[0], EFFECTS["lengths"].keys(0.2, 1, 0.5))
    assert robot.tolerances.length == pytest.approx(2e-4)
    assert robot.plant.links.l_11 == pytest.approx(-2e-4)
    assert robot.plant.links.l_12 == pytest.approx(2e-4)


def test_the_rule_of_failure() -> None:
    assert cause_of(OUTCOME, 1) is None
    assert cause_of(OUTCOME, 2) == WRONG_MODE
    assert cause_of(OUTCOME._replace(error_peak=2e-3), 1) == FAR
    assert cause_of(OUTCOME._replace(error_peak=math.nan), 1) == FAR
    assert cause_of(OUTCOME._replace(fault=TRACKING_LOST, mode_changes=3), 1) == "tracking_lost"


def test_any_robot_is_judged_by_its_size_and_has_settings_in_proportion() -> None:
    settings = RobustnessSettings(effects=("lengths",), controllers=("unified",), durations=(1.0,), robot="motkin")
    assert limit_of("dextar") == 2e-3
    assert limit_of("motkin") == pytest.approx(2e-3 * 8 / 9)
    between = OUTCOME._replace(error_peak=1.9e-3)
    assert (cause_of(between, 1), cause_of(between, 1, limit_of("motkin"))) == (None, FAR)
    scenario = prepared("unified, gyro", 1.0, "motkin")[0]
    assert scenario.plant.torque_limit == 0.186
    of_dextar = prepared("unified, gyro", 1.0)[0]
    # its crossing takes 0.035 Nm where that of DexTAR takes 0.55
    for section, name in (("ekf", "disturbance_rate"), ("loads", "passive"), ("plant", "torque_quantum")):
        own, usual = (getattr(getattr(one, section), name) for one in (scenario, of_dextar))
        assert own == pytest.approx(usual * 0.035 / 0.55)
    assert ROBUSTNESS.command(settings).startswith("fivebar robustness --robot motkin --effects lengths")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--rig", "good", "--effects", "mass"], "--effects: mass: expected none in the study of --rig"),
        (
            ["--sensors", "good", "--seed", "1", "--quick"],
            "--sensors is deprecated: use --rig\nfivebar: --quick: True: expected none in the study of --rig",
        ),
        (["--seed", "3"], "--seed: 3: expected none in the study of --effects"),
    ],
)
def test_a_study_refuses_the_options_of_another(words: list[str], said: str) -> None:
    called = CliRunner().invoke(app, ["robustness", *words])
    assert (called.exit_code, called.stderr) == (2, f"fivebar: {said}\n")


def test_the_first_failure_counts_though_larger_sizes_succeed() -> None:
    def climb(effect: str, equipment: str, *failed: int) -> Climb:
        counts = (*failed, *([0] * (STEPS - len(failed))))
        return Climb(effect, equipment, 12, counts, tuple({FAR: count} if count else {} for count in counts))

    before, after = "unified, encoders", "unified, gyro"
    table = first_failures(
        [climb("lengths", before, 0, 2, 0, 12), climb("lengths", after), climb("loop", after, *[0] * 11, 1)]
    )
    lengths, loop = (row[table.columns.index(before) :] for row in table.rows)
    sizes = EFFECTS["lengths"].sizes
    assert (lengths[0].value, lengths[0].good) == (sizes[1], False)
    assert (lengths[1].value, lengths[1].good) == (None, True)
    assert loop[0].text == ""
    # a softer loop than any middling robot has
    assert (loop[1].value, loop[1].good) == (EFFECTS["loop"].sizes[-1], True)


def test_a_size_has_its_place_in_the_figure() -> None:
    for effect in (EFFECTS["lengths"], EFFECTS["loop"]):
        assert place_of(effect, effect.sizes[3]) == pytest.approx(3.5)


@pytest.mark.extra
def test_a_law_from_elsewhere_climbs_its_ladder() -> None:
    settings = RobustnessSettings(
        effects=("mass", "gyro_noise"), controllers=("toy_law:LAW",), draws=1, durations=(1.0,)
    )
    assert ROBUSTNESS.cases(settings) == 2 + 3 * STEPS
    rows = [row for number in (0, 1, 2, 13) for row in ROBUSTNESS.run(settings, number)]
    assert {row.equipment for row in rows} == {"toy_law:LAW, encoders", "toy_law:LAW, gyro"}
    assert set(failures_without(rows)) == {"toy_law:LAW, encoders", "toy_law:LAW, gyro"}
    (climb,) = climbs_of(rows)
    assert (climb.effect, climb.equipment, climb.runs, len(climb.failed)) == ("mass", "toy_law:LAW, encoders", 1, 2)


@pytest.mark.extra
def test_a_gyroscope_saves_a_robot_whose_lengths_are_wrong() -> None:
    causes = {
        name: middle_crossing(RobustnessRow(0, "lengths", 0.2, name, 0.5, 0), SETTINGS).cause
        for name in ("unified, encoders", GYRO)
    }
    assert causes["unified, encoders"] and not causes[GYRO]


def test_the_help_names_the_controllers_that_run_by_default() -> None:
    command: Any = get_command(app).get_command(None, "robustness")  # type: ignore[attr-defined]
    (option,) = (one for one in command.params if one.name == "controllers")
    assert f"[default: {','.join(SETTINGS.compared)}, or" in option.help


def test_an_unknown_effect_is_refused() -> None:
    answer = CliRunner().invoke(app, ["robustness", "--effects", "lengths,moon"])
    assert answer.exit_code == 2
    assert "'moon'" in answer.output


def test_the_page_has_every_effect_with_what_robots_have() -> None:
    page = ResultFiles(RESULTS, PAGES).whole()
    for effect in EFFECTS.values():
        good, middling = (effect.shown(size) for size in (effect.good, effect.middling))
        assert f"| {effect.words} | {good} | {middling} |" in page


def of_robots_on(name: str) -> dict[str, float]:
    """What the robots of a rig have of each effect, or have at most, in SI units; nothing of what no rig has."""
    rig = find_rig(name)
    errors, plant, imu = rig.errors, rig.plant, rig.scenario["imu"]
    friction, motors, timing = plant["friction"], plant["motors"], plant["timing"]
    return {
        "lengths": errors.length,
        "bases": errors.length,
        "zeros": errors.zero,
        "mass": errors.mass_and_inertia,
        "inertia": errors.mass_and_inertia,
        "coulomb": errors.coulomb_friction,
        "breakaway": friction["stribeck"] - 1.0,
        "viscous": friction["viscous"],
        "passive": friction["passive"],
        "elasticity": plant["transmission"]["frequency"],
        "backlash": plant["transmission"]["backlash"],
        "loop": plant["platform_joint"]["stiffness"],
        "clearance": plant["platform_joint"]["clearance"],
        "current": motors["current_loop_hz"],
        "constants": errors.torque_constant,
        "ripple": motors["ripple"],
        "cogging": motors["cogging"],
        "tilt": errors.tilt,
        "push": errors.push,
        "lost": errors.lost_commands,
        "late": timing["command_delay"] + timing["command_jitter"],
        "old": timing["reading_age"] + timing["reading_jitter"],
        "gyro_noise": imu["gyro_noise"],
        "gyro_bias": errors.gyro_bias,
    }


@pytest.mark.parametrize("rig", ["good", "middling"])
def test_good_and_middling_robots_have_what_the_rigs_of_that_name_have(rig: str) -> None:
    found = of_robots_on(rig)
    around = {"rise", "height", "distal_mass", "heating", "supply", "vibration", "drag", "cable"}
    assert set(EFFECTS) - set(found) == {"eccentricity", "presliding", "gyro_low_pass", "gyro_lost"} | around
    stated = {name: getattr(EFFECTS[name], rig) * EFFECTS[name].scale for name in found}
    assert stated == pytest.approx(found)


def rows_with_burst(name: str, draws: tuple[int, ...]) -> list[RobustnessRow]:
    """Return what becomes of runs with a gyroscope without a burst, and with each at a few moments."""
    runs = [RobustnessRow(0, "", 0.0, GYRO, 1.0, 0)]
    runs += [RobustnessRow(0, name, size, GYRO, 1.0, draw) for size in BURSTS[name].sizes for draw in draws]
    return [middle_crossing(run, SETTINGS) for run in runs]


def test_bursts_of_lost_commands_are_borne() -> None:
    """As many as the drives hold their torque for by default, before, on and after the locus."""
    rows = rows_with_burst("commands", (0, 62, 125, 187))
    (climb,) = climbs_of(rows)
    assert climb.failed == (0,) * 4
    assert climb.errors[2] is not None and rows[0].error < climb.errors[2] < 1e-3
    cells = dict(zip(errors_table(rows, [climb]).columns, errors_table(rows, [climb]).rows[0], strict=True))
    assert (cells["none"].value, cells["15"].value) == (rows[0].error, climb.errors[-1])


def test_a_burst_that_no_run_bears_has_no_largest_error() -> None:
    runs = [RobustnessRow(0, "commands", size, GYRO, 1.0, 0, error=1e-3) for size in (1.0, 5.0, 10.0)]
    rows = [*runs, runs[0]._replace(size=15.0, cause="tracking_lost")]
    (climb,) = climbs_of(rows)
    assert (climb.errors, climb.failed) == ((1e-3, 1e-3, 1e-3, None), (0, 0, 0, 1))
    shown = dict(zip(errors_table(rows, [climb]).columns, errors_table(rows, [climb]).rows[0], strict=True))
    assert (shown["none"].text, shown["10"].text, shown["15"].text) == ("", "1.00 mm", "")


def test_bursts_of_lost_samples_are_borne() -> None:
    """As many as the estimator predicts over: the torque that is held is known to it, where it should be is not."""
    rows = rows_with_burst("samples", (62, 125, 187))
    (climb,) = climbs_of(rows)
    assert climb.failed == (0,) * 3
    assert climb.errors[-1] is not None and rows[0].error < climb.errors[-1] < 1e-3
    assert BURSTS["samples"].sizes[-1] == LONGEST_BURST - 1


def test_a_burst_begins_at_every_second_sample_of_the_crossing() -> None:
    settings = RobustnessSettings(effects=("commands", "samples"), controllers=("mpc",), durations=(0.5,))
    runs = [run for run in runs_of(settings) if (run.equipment, run.size) == ("mpc, gyro", 1)]
    begins = {name: [2 * run.draw for run in runs if run.effect == name] for name in settings.effects}
    # without sample 0 there is no run
    assert begins == {"commands": [*range(0, 250, 2)], "samples": [*range(2, 250, 2)]}
    assert BURSTS["samples"].keys(5, 3, 0.25)["missing"] == (6, 5)


@pytest.mark.parametrize("study", [ASSESSMENT, BENCHMARK, ROBUSTNESS, SWEEP], ids=lambda study: study.name)
def test_the_command_of_a_study_takes_a_path_with_spaces(study: Study[Any, Any], tmp_path: Path) -> None:
    """As it stands on the page, to be pasted into a shell."""
    path = tmp_path / "my robot.yaml"
    shutil.copy(share_file("fivebar_description", "config", "dextar.yaml"), path)
    words = shlex.split(study.command(study.settings(robot=str(path))))
    assert words[:2] == ["fivebar", study.name] and str(path) in words
