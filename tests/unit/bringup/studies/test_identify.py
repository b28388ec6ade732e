# SPDX-License-Identifier: Apache-2.0
"""A bag of a robot with secret parameters: `fivebar identify` finds them, and its file makes a better controller."""

from __future__ import annotations

import json
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from bag_contents import copied_into
from typer.testing import CliRunner

from fivebar_bringup.bag.recording import FloatArray, Recording
from fivebar_bringup.cli.main import app
from fivebar_bringup.identify.identify import ROBOT_FILE, identify_bag, write_identification
from fivebar_bringup.identify.reading import Source, read_record
from fivebar_bringup.identify.result import IdentificationResult
from fivebar_bringup.pages import style
from fivebar_bringup.recorded.run_directory import RunDirectory, new_run_directory
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation import offline
from fivebar_bringup.simulation.offline import OfflineRun, simulate, write_bag
from fivebar_control.identification.equations import PARAMETERS, Record
from fivebar_control.identification.identification import parameter_values
from fivebar_control.model.kinematics import state_from_joints, state_from_platform
from fivebar_control.model.singularity import inverse_condition
from fivebar_description.interface import Topic
from fivebar_description.robot_file import RobotFile, load_robot
from fivebar_description.strict_yaml import InputError
from fivebar_sim.plant import Plant

LENGTHS = "lengths_m: {a: 0.118, l_11: 0.09, l_12: 0.09, l_21: 0.09, l_22: 0.09}\n"

SECRET = f"""name: secret
{LENGTHS}inertias_kg_m2: {{zz_11R: 0.0103, zz_21R: 0.0171}}
mass_kg: {{m: 0.431}}
friction: {{f_s11: 0.27, f_s21: 0.52, f_off11: -0.04, f_off21: 0.0, width_rad_s: 0.02}}
"""

ASSUMED = f"""name: "assumed: robot"
{LENGTHS}inertias_kg_m2: {{zz_11R: 0.015, zz_21R: 0.012}}
mass_kg: {{m: 0.6}}
friction: {{f_s11: 0.4, f_s21: 0.4, f_off11: 0.0, f_off21: 0.06, width_rad_s: 0.02}}
"""

OFFSET_TOLERANCE = 0.003
"""Nm, 1 % of the smaller Coulomb friction: an offset may be zero."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("identify")
    (path / "secret.yaml").write_text(SECRET, encoding="utf-8")
    (path / "assumed.yaml").write_text(ASSUMED, encoding="utf-8")
    return path


def simulated(folder: Path, scenario: Scenario) -> OfflineRun:
    """Run the controllers of a scenario on the secret robot, whatever they believe in."""
    secret = load_robot(str(folder / "secret.yaml"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(offline, "Plant", lambda robot, *arguments: Plant(secret, *arguments))
        return simulate(scenario)


def recorded(folder: Path, name: str, scenario: Scenario) -> RunDirectory:
    run = new_run_directory(folder / name, scenario)
    finished = simulated(folder, scenario)
    assert not finished.faults
    write_bag(finished, scenario, run.bag)
    return run


def believing(folder: Path, scenario: str, robot: str) -> Scenario:
    return load_scenario(scenario).model_copy(update={"robot": str(folder / robot)})


@pytest.fixture(scope="module")
def exact(folder: Path) -> RunDirectory:
    return recorded(folder, "exact", believing(folder, "excitation", "assumed.yaml"))


@pytest.fixture(scope="module")
def counted(folder: Path) -> RunDirectory:
    return recorded(folder, "counted", believing(folder, "excitation_encoders", "assumed.yaml"))


def errors(findings: IdentificationResult) -> tuple[float, float]:
    """Largest relative error of inertias, mass and Coulomb friction, and largest error of the offsets (Nm)."""
    true = np.array(parameter_values(load_robot(str(Path(findings.bag).parents[1] / "secret.yaml"))))
    off = np.abs(findings.identification.fit.values[:7] - true)
    return float(np.max(off[:5] / true[:5])), float(np.max(off[5:]))


@pytest.mark.extra
def test_exact_sensors_give_the_parameters_within_one_percent(exact: RunDirectory) -> None:
    findings = identify_bag(exact.path)
    relative, offset = errors(findings)
    assert relative < 0.01
    assert offset < OFFSET_TOLERANCE
    # what it comes to is much less; this is the rounding of its own equations
    assert relative < 2e-4
    assert findings.identification.cutoffs.derivative_hz == 50.0


@pytest.mark.extra
def test_encoders_of_20000_counts_give_them_within_three_percent(counted: RunDirectory) -> None:
    findings = identify_bag(counted.path)
    relative, offset = errors(findings)
    assert relative < 0.03
    assert offset < OFFSET_TOLERANCE
    assert relative < 0.005
    assert findings.encoder() == "20000 counts per revolution"
    assert 10.0 < findings.identification.cutoffs.derivative_hz < 30.0
    assert findings.identification.fit.condition < 5.0


@pytest.mark.extra
def test_scaled_parameters_of_a_scenario_come_back(tmp_path: Path) -> None:
    """All of a kind off by the same factor, as the section `plant` has it; the bag alone, with the robot named."""
    scenario = load_scenario("excitation_encoders")
    plant = scenario.plant._replace(mass_scale=1.3, inertia_scale=0.8, friction_scale=1.5)
    scenario = scenario.model_copy(update={"plant": plant})
    write_bag(simulate(scenario), scenario, tmp_path / "bag")
    found = identify_bag(tmp_path / "bag", "dextar").identification.fit.values[:7]
    true = np.array(parameter_values(load_robot("dextar"))) * [0.8, 0.8, 1.3, 1.5, 1.5, 1.5, 1.5]
    assert found == pytest.approx(true, rel=0.005, abs=1e-3)


@pytest.mark.extra
def test_the_written_file_tracks_better(folder: Path, exact: RunDirectory) -> None:
    """It is read as it was meant, by name in a scenario too, and the controller that believes in it does better."""
    findings = identify_bag(exact.path)
    directory = write_identification(findings, folder / "written")
    robot = load_robot(str(directory.path / ROBOT_FILE))
    assert parameter_values(robot) == pytest.approx(findings.identification.fit.values[:7].tolist(), rel=1e-4, abs=1e-6)
    assert robot.leg1._replace(inertia=0.0, coulomb=0.0, offset=0.0) == load_robot("dextar").leg1._replace(
        inertia=0.0, coulomb=0.0, offset=0.0
    )
    move = {"waypoints": ((0.0, 0.13), (0.09, 0.04)), "segment_duration": 0.4}
    before, after = (
        tracking_error(folder, load_scenario("excitation").model_copy(update={"robot": str(file), **move}))
        for file in (folder / "assumed.yaml", directory.path / ROBOT_FILE)
    )
    assert after < 0.2 * before


def tracking_error(folder: Path, scenario: Scenario) -> float:
    """Root mean square distance (m) of the secret robot's platform from the reference."""
    lengths = scenario.five_bar()
    squares = []
    for sample in simulated(folder, scenario).samples:
        state = state_from_joints(lengths, *sample.measured.position, *sample.measured.velocity)
        squares.append((state.x - sample.reference.x) ** 2 + (state.y - sample.reference.y) ** 2)
    assert len(squares) == 201
    return float(np.sqrt(np.mean(squares)))


class Page(HTMLParser):
    """Collects a page's tags, sources and text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.sources: list[str] = []
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.sources += [value or "" for name, value in attrs if name in ("src", "href")]

    def handle_data(self, data: str) -> None:
        self.text += data


def run(*arguments: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, ["identify", *arguments])
    return result.exit_code, result.stdout, result.stderr


@pytest.mark.extra
def test_the_command_leaves_file_page_figures_and_json(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, counted: RunDirectory
) -> None:
    monkeypatch.setattr(style, "DPI", 30)
    out = tmp_path / "made" / "here"
    status, printed, _ = run(str(counted.bag), "--out", str(out), "--json")
    assert status == 0
    content = json.loads(printed)
    assert content == json.loads((out / "identification.json").read_text(encoding="utf-8"))
    assert list(content["parameters"]) == list(PARAMETERS)
    assert content["robot"] == "assumed: robot"
    assert content["parameters"]["m"]["before"] == 0.6
    assert content["parameters"]["m"]["value"] == pytest.approx(0.431, rel=0.005)
    assert 0.0 < content["parameters"]["m"]["half_width"] < 0.01
    assert sorted(path.name for path in (out / "figures").iterdir()) == ["parameters.png", "torques.png"]
    page = Page((out / "identification.html").read_text(encoding="utf-8"))
    assert len(page.sources) == 2
    assert all(source.startswith("data:image/png;base64,") for source in page.sources)
    assert (out / "identified.yaml").read_text(encoding="utf-8").strip() in page.text
    assert load_robot(str(out / "identified.yaml")).mass == pytest.approx(0.431, rel=0.005)


@pytest.mark.extra
def test_the_command_prints_a_table(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, counted: RunDirectory) -> None:
    monkeypatch.setattr(style, "DPI", 30)
    status, printed, _ = run(str(counted.path), "--robot", "dextar", "--out", str(tmp_path / "out"))
    assert status == 0
    for name in PARAMETERS:
        assert re.search(rf"^ {name} +\S+ +-?\d\.\d+ ± \d\.\d+ +(kg m²|kg|Nm)", printed, re.MULTILINE)
    assert "condition number" in printed
    assert "20000 counts per revolution" in printed


@pytest.mark.extra
def test_a_name_cannot_leave_the_comment_or_the_page(folder: Path, counted: RunDirectory, tmp_path: Path) -> None:
    file = tmp_path / "malice.yaml"
    file.write_text(ASSUMED.replace('"assumed: robot"', '"x\\nmass_kg: 3 <script>&"'), encoding="utf-8")
    findings = identify_bag(counted.path, str(file))
    directory = write_identification(findings, tmp_path / "out")
    assert load_robot(str(directory.path / ROBOT_FILE)).mass == pytest.approx(0.431, rel=0.005)
    assert "<script>" not in directory.page.read_text(encoding="utf-8")


@pytest.mark.extra
def test_a_full_directory_is_refused(counted: RunDirectory, tmp_path: Path) -> None:
    (tmp_path / "kept").write_text("mine", encoding="utf-8")
    status, printed, complaint = run(str(counted.path), "--out", str(tmp_path))
    assert (status, printed) == (2, "")
    assert "is not empty" in complaint
    assert [path.name for path in tmp_path.iterdir()] == ["kept"]


@pytest.mark.parametrize("name", ["excitation", "excitation_encoders"])
def test_the_shipped_motion_stays_in_one_mode_away_from_the_locus(name: str) -> None:
    scenario = load_scenario(name)
    plan, robot = scenario.plan(), scenario.five_bar()
    assert plan.crossings == ()
    kappas, speeds = [], []
    for k in range(plan.path.samples(100) + 1):
        reference = plan.path.at(k / 100)
        state = state_from_platform(robot, (1, -1), *reference[:4])
        kappas.append(inverse_condition(state))
        speeds.append((state.leg1.dq1, state.leg2.dq1))
    assert min(kappas) > 0.2
    fastest, slowest = np.max(speeds, axis=0), np.min(speeds, axis=0)
    assert (fastest > 5.0).all() and (slowest < -5.0).all()
    assert np.max(np.abs(speeds)) < 10.0


@pytest.mark.extra
def test_a_motion_that_does_not_excite_is_refused(folder: Path) -> None:
    """Straight up the axis of symmetry and back, slowly."""
    scenario = believing(folder, "excitation_encoders", "assumed.yaml").model_copy(
        update={"waypoints": ((0.0, 0.12), (0.0, 0.15), (0.0, 0.12)), "segment_duration": 3.0}
    )
    run_directory = recorded(folder, "slow", scenario)
    status, _, complaint = run(str(run_directory.path), "--out", str(folder / "unused"))
    assert status == 2
    assert re.match(r"fivebar: \S+bag: not enough motion: motor 1 turns faster than 0.06 rad/s", complaint)
    assert complaint.count("\n") == 1
    assert not (folder / "unused").exists()


def with_torques_scaled(factor: float, run_directory: RunDirectory, robot: Path | None = None) -> IdentificationResult:
    """Identify the robot of a bag whose torques are a factor times what they were."""

    def scaled(source: Source, start: RobotFile) -> Record:
        record = read_record(source, start)
        return record._replace(torques=factor * record.torques)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fivebar_bringup.identify.identify.read_record", scaled)
        return identify_bag(run_directory.path, None if robot is None else str(robot))


@pytest.mark.extra
@pytest.mark.parametrize("factor", [1e3, 1e-3, 20.0, 9.0, 1.0 / 9.0])
def test_torques_in_another_unit_are_noticed(factor: float, counted: RunDirectory) -> None:
    with pytest.raises(InputError, match=r"times those of robot .*: are the recorded torques in Nm?"):
        with_torques_scaled(factor, counted)


@pytest.mark.parametrize(("factor", "written"), [(2.0, "2"), (0.5, "0.5")])
def test_currents_of_a_known_robot_are_noticed_by_one_factor(
    factor: float, written: str, counted: RunDirectory, folder: Path
) -> None:
    """Motors of 0.5 or 2 Nm/A: what estimates are off by, but never all by the same."""
    with pytest.raises(InputError, match=rf"friction come out all {written} times those of robot secret: are the rec"):
        with_torques_scaled(factor, counted, folder / "secret.yaml")


def test_an_error_of_the_torque_constants_is_no_other_unit(counted: RunDirectory, folder: Path) -> None:
    findings = with_torques_scaled(1.2, counted, folder / "secret.yaml")
    assert {one.name: one.value for one in findings.parameters()}["m"] == pytest.approx(1.2 * 0.431, rel=0.01)


def test_another_robot_is_noticed(counted: RunDirectory, tmp_path: Path) -> None:
    status, _, complaint = run(str(counted.path), "--robot", "unequal", "--out", str(tmp_path / "out"))
    assert status == 2
    assert "legs end" in complaint and "is it the robot of the bag?" in complaint


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["nowhere"], "nowhere: no such directory"),
        (["{folder}"], "holds neither a bag (metadata.yaml) nor a run"),
        (["{bag}", "--robot", "nope"], "robot 'nope': expected one of"),
        (["{lone}"], "--robot: expected the robot's name or file"),
    ],
)
def test_what_cannot_be_read_is_one_line(
    arguments: list[str], expected: str, folder: Path, counted: RunDirectory, tmp_path: Path
) -> None:
    lone = shutil.copytree(counted.bag, tmp_path / "lone")
    places = {"folder": tmp_path, "bag": counted.bag, "lone": lone}
    status, printed, complaint = run(*(argument.format(**places) for argument in arguments))
    assert (status, printed) == (2, "")
    assert complaint.startswith("fivebar: ")
    assert expected in complaint
    assert complaint.count("\n") == 1


@pytest.mark.extra
def test_angles_that_are_wrapped_to_one_turn_identify_alike(
    exact: RunDirectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As by a tool whose cut lies within the motion, so that some angles are of another turn."""
    plain, read = identify_bag(exact.path).identification.fit.values, Recording.field
    jumps = []

    def wrapped(recording: Recording, topic: Topic, name: str) -> FloatArray:
        values = read(recording, topic, name)
        if name != "position":
            return values
        middle = 0.5 * (values.min(axis=0) + values.max(axis=0))
        jumps.append(np.abs(np.diff((values - middle) % (2.0 * np.pi), axis=0)).max())
        return (values - middle) % (2.0 * np.pi) + middle

    monkeypatch.setattr(Recording, "field", wrapped)
    assert identify_bag(exact.path).identification.fit.values == pytest.approx(plain, rel=1e-9, abs=1e-9)
    assert len(jumps) == 2 and min(jumps) > 6.0


@pytest.mark.extra
def test_a_bag_in_a_namespace_is_identified_and_a_wrong_one_is_refused(exact: RunDirectory, tmp_path: Path) -> None:
    copied_into("lab", exact.bag, tmp_path / "bag")
    arguments = ["identify", str(tmp_path / "bag"), "--robot", exact.read_scenario().robot, "--json"]
    done = CliRunner().invoke(app, [*arguments, "--namespace", "lab", "--out", str(tmp_path / "out")])
    assert done.exit_code == 0
    assert json.loads(done.stdout)["parameters"] == identify_bag(exact.path).as_json()["parameters"]
    done = CliRunner().invoke(app, [*arguments, "--namespace", "left"])
    assert (done.exit_code, done.stdout) == (2, "")
    assert "has no robot in the namespace /left: expected /lab by --namespace" in done.stderr
