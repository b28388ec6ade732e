# SPDX-License-Identifier: Apache-2.0
"""Files that are followed: by a scenario, by a request at another pace, and by the steps of a program."""

from __future__ import annotations

from pathlib import Path

import pytest

from fivebar_bringup.graph.node_spec import Mode
from fivebar_bringup.motions.likely import plan_likely
from fivebar_bringup.motions.program import plan_program, scenario_of_program
from fivebar_bringup.motions.request import Request
from fivebar_bringup.motions.start import Start
from fivebar_bringup.motions.trajectory import at_another_pace
from fivebar_bringup.recorded.run_directory import RunDirectory, new_run_directory
from fivebar_bringup.runs.admission import load_admitted
from fivebar_bringup.runs.offline import run_offline
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.planning.program import Follow, load_program, read_program, with_files
from fivebar_control.planning.timing import Speed
from fivebar_control.trajectory.path import Path as PlannedPath
from fivebar_control.trajectory.planner import PlanRefused
from fivebar_description.strict_yaml import InputError, validate

TOP, BOTTOM = (0.0, 0.15), (0.0, 0.02)
KEYS = "format: 1\nname: figure\ncontroller: unified\ntrajectory: figure.csv\n"


def write_there_and_back(folder: Path, crossing: float) -> str:
    """Write 101 rows from the top through the locus and back, each way in `crossing` s; return the path."""
    way = PlannedPath.through([TOP, BOTTOM, TOP], [crossing, crossing])
    rows = [f"{t!r},{way.at(t).x!r},{way.at(t).y!r}" for t in (0.02 * crossing * n for n in range(101))]
    path = folder / "figure.csv"
    path.write_text("\n".join(["t,x,y", *rows]) + "\n", encoding="utf-8")
    return str(path)


def request_for(trajectory: str, robot: str = "dextar") -> Request:
    return Request(
        *TOP,
        None,
        None,
        Start(*TOP, (1, -1)),
        "unified",
        robot,
        2.0,
        10.0,
        500,
        Speed.COMFORTABLE,
        trajectory=trajectory,
    )


def test_a_scenario_follows_a_file_beside_it_through_the_locus_and_back(tmp_path: Path) -> None:
    write_there_and_back(tmp_path, 0.6)
    (tmp_path / "figure.yaml").write_text(KEYS, encoding="utf-8")
    scenario = load_admitted(str(tmp_path / "figure.yaml"))
    assert (scenario.waypoints, scenario.durations()) == ((TOP, TOP), (pytest.approx(1.2),))
    directory, summary = run_offline(scenario, tmp_path / "run", lambda done, total: None, with_page=False)
    assert (summary.outcome, summary.assembly_mode_changes) == ("succeeded", 2)
    assert summary.tracking_error_peak_m < 1e-3
    (tmp_path / "figure.csv").unlink()
    # the run is what it was, whatever becomes of the file
    again = RunDirectory(directory.path).read_scenario()
    assert again.plan().crossings == scenario.model_copy(update={"trajectory": again.trajectory}).plan().crossings
    assert len(again.plan().crossings) == 2


@pytest.mark.parametrize(
    ("more", "reason"),
    [
        ("time_law: septic", "time_law: 'septic': a trajectory says itself how it moves"),
        ("blend_radius: 0.01", "blend_radius"),
        ("segment_duration: 1.0", "segment_duration: a trajectory says itself how long it takes"),
        ("waypoints: [[0.0, 0.15], [0.0, 0.1]]", "expected with a trajectory where the platform starts alone"),
        ("waypoints: [[0.0, 0.1]]", "row 2 at time 0: (0.0000, 0.1500) m: expected where the robot rests"),
    ],
)
def test_keys_that_contradict_the_file_are_refused(tmp_path: Path, more: str, reason: str) -> None:
    write_there_and_back(tmp_path, 0.6)
    path = tmp_path / "figure.yaml"
    path.write_text(f"{KEYS}{more}\n", encoding="utf-8")
    with pytest.raises(InputError) as refused:
        load_scenario(str(path))
    assert reason in str(refused.value)


def test_laws_that_follow_no_requests_follow_no_file(tmp_path: Path) -> None:
    content = {"name": "figure", "controller": "multi_cartesian", "trajectory": write_there_and_back(tmp_path, 0.6)}
    with pytest.raises(InputError, match="controller multi_cartesian follows no trajectories: expected unified"):
        validate(content, Scenario, "figure")


def test_a_slow_crossing_is_refused_with_its_row_and_made_at_another_pace(tmp_path: Path) -> None:
    """In 20 s each way it is near the locus for half a second; the path is the same at the pace that is chosen."""
    request = request_for(write_there_and_back(tmp_path, 20.0))
    with pytest.raises(PlanRefused, match=r"time near the Type 2 locus is .* after row \d+") as refused:
        plan_likely(request)
    # where the middle of a way, or of the way back, is passed
    row = int(str(refused.value).split("after row ")[1].split(";")[0])
    assert min(abs(row - 2 - 25), abs(row - 2 - 75)) <= 2
    with at_another_pace(request) as quicker:
        likely = plan_likely(quicker)
        run = new_run_directory(tmp_path / "run", likely.scenario)
        path = likely.motion.plan.path
        assert path.duration < 5.0
        assert len(likely.motion.crossings) == 2
        assert all(abs(path.at(0.01 * n * path.duration).x) < 1e-9 for n in range(101))
    assert not Path(quicker.trajectory).exists()
    assert RunDirectory(run.path).read_scenario().durations() == (path.duration,)


def test_a_program_follows_files_beside_it(tmp_path: Path) -> None:
    write_there_and_back(tmp_path, 0.6)
    text = "name: work\nsteps:\n  - follow: figure.csv\n  - repeat: 2\n    steps:\n      - follow: figure.csv\n"
    path = tmp_path / "work.yaml"
    path.write_text(text, encoding="utf-8")
    loaded = load_program(path)
    file = str(tmp_path / "figure.csv")
    assert [one.action for one in loaded.instructions] == [Follow(file)] * 3
    assert with_files(text, {}, {"figure.csv": "followed_1.csv"}) == text.replace("figure.csv", "followed_1.csv")
    scenario = scenario_of_program(loaded, str(path))
    planned = plan_program(loaded, scenario, str(path))
    assert [step.duration for step in planned.steps] == pytest.approx([1.2] * 3)
    assert planned.steps[0].planned.path().at(0.6)[:2] == pytest.approx(BOTTOM, abs=1e-9)


def test_a_long_file_is_followed_by_the_clock_in_later_steps_too(tmp_path: Path) -> None:
    file = write_there_and_back(tmp_path, 0.6)
    loaded = read_program(f"name: work\nsteps:\n  - follow: {file}\n  - follow: {file}\n", "work.yaml")
    scenario = scenario_of_program(loaded, "work.yaml")
    assert len(plan_program(loaded, scenario, "work.yaml", Mode.REALTIME).steps) == 2


def test_a_step_that_cannot_be_followed_is_refused_with_its_line_and_row(tmp_path: Path) -> None:
    file = write_there_and_back(tmp_path, 20.0)
    loaded = read_program(f"name: work\nsteps:\n  - move: [0.0, 0.14]\n  - follow: {file}\n", "work.yaml")
    scenario = scenario_of_program(loaded, "work.yaml")
    with pytest.raises(InputError, match=r"step 2 \(line 4\): .*row 2 at time 0: .* expected where the robot rests"):
        plan_program(loaded, scenario, "work.yaml")
    loaded = read_program(f"name: work\nsteps:\n  - follow: {file}\n", "work.yaml")
    scenario = scenario_of_program(loaded, "work.yaml")
    with pytest.raises(InputError, match=r"step 1 \(line 3\): .*time near the Type 2 locus is .* after row \d+"):
        plan_program(loaded, scenario, "work.yaml")
