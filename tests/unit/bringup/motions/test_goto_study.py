# SPDX-License-Identifier: Apache-2.0
"""The command `fivebar goto`: plans, refuses, runs, and goes on from an earlier run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from fivebar_bringup.bag import serialize
from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.writer import BagWriter
from fivebar_bringup.cli.main import app
from fivebar_bringup.motions.live import goal_fields
from fivebar_bringup.motions.request import Request, plan_request, scenario_of
from fivebar_bringup.motions.start import Start
from fivebar_bringup.recorded.run_directory import RunDirectory, new_run_directory
from fivebar_bringup.runs.admission import refuse_unfit
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.planning.motion_queue import Goal, read_goal
from fivebar_control.planning.timing import Speed
from fivebar_control.scenario.start import initial_joints
from fivebar_control.trajectory.planner import PlanRefused
from fivebar_description.interface import JOINT_STATES, JOINTS, PAYLOAD
from fivebar_description.robot_file import robot_path


def goto(*arguments: str) -> tuple[int, str, str]:
    done = CliRunner().invoke(app, ["goto", *arguments])
    return done.exit_code, done.stdout, done.stderr


def plan(*arguments: str) -> dict[str, Any]:
    code, out, _ = goto(*arguments, "--plan-only", "--json")
    assert code == 0
    content: dict[str, Any] = json.loads(out)["plan"]
    return content


def test_it_prints_the_plan_before_moving() -> None:
    found = plan("0", "0.02", "--mode", "-")
    assert found["start"] == {"x": 0.0, "y": 0.15, "assembly_mode": "+"}
    assert found["goal"]["assembly_mode"] == "-"
    (crossing,) = found["crossings"]
    assert crossing["y"] == pytest.approx(0.0845, abs=1e-4)
    assert crossing["distal_links"] == "stretched"
    figures = {figure["name"]: figure for figure in found["figures"]}
    assert 0.0 < figures["reference torque"]["value"] <= figures["reference torque"]["limit"] == pytest.approx(1.7)
    code, out, _ = goto("0", "0.02", "--plan-only")
    assert code == 0
    assert "crosses the Type 2 locus at (0.0000, 0.0845) m" in out
    assert "reference torque" in out


@pytest.mark.extra
@pytest.mark.parametrize("elbows_pass", [None, "true", "unknown"])
def test_it_says_where_the_elbows_pass_each_other(elbows_pass: str | None, tmp_path: Path) -> None:
    robot = tmp_path / "robot.yaml"
    key = "" if elbows_pass is None else f"elbows_pass: {elbows_pass}\n"
    robot.write_text(robot_path("dextar").read_text(encoding="utf-8") + key, encoding="utf-8")
    way = ("0.018", "0.017", "--from", "0.063", "-0.051", "--from-mode", "1", "-1", "--robot", str(robot))
    (crossing,) = plan(*way)["crossings"]
    assert (crossing["distal_links"], crossing["elbows_pass"]) == ("folded", elbows_pass == "true" or "unknown")
    told = "distal links folded: the elbows pass each other, and the robot's file does not say whether they can"
    out = " ".join(goto(*way, "--plan-only")[1].split())
    assert (told in out) == (elbows_pass != "true")


def test_a_scenario_whose_elbows_must_not_pass_is_refused(tmp_path: Path) -> None:
    robot = tmp_path / "robot.yaml"
    robot.write_text(robot_path("dextar").read_text(encoding="utf-8") + "elbows_pass: false\n", encoding="utf-8")
    folded = {"name": "folded", "robot": str(robot), "controller": "unified", "working_mode": (1, -1)}
    scenario = Scenario.model_validate(
        {**folded, "waypoints": ((0.063, -0.051), (0.018, 0.017)), "segment_duration": 1.1}
    )
    with pytest.raises(
        PlanRefused, match=r"elbows pass each other \(elbows_pass: false\) is 1 at \(0\.\d+, -0\.\d+\) m"
    ):
        refuse_unfit(scenario)
    refuse_unfit(scenario.model_copy(update={"robot": "dextar"}))


def test_negative_coordinates_are_no_options() -> None:
    found = plan("-0.03", "-0.1", "--from", "0.05", "-0.1", "--from-mode", "-1", "1")
    assert (found["goal"]["x"], found["goal"]["y"]) == (-0.03, -0.1)
    assert (found["start"]["x"], found["working_mode"]) == (0.05, [-1, 1])


@pytest.mark.extra
def test_the_fastest_motion_is_the_quickest_and_uses_the_torque() -> None:
    calm, quick = plan("0", "0.02"), plan("0", "0.02", "--fastest")
    assert quick["duration_s"] < 0.7 * calm["duration_s"]
    assert quick["figures"][0]["value"] == pytest.approx(1.7, rel=0.05)
    slow = plan("0", "0.02", "--fastest", "--torque-limit", "0.6")
    assert slow["duration_s"] > 2.0 * quick["duration_s"]


def test_it_is_judged_by_the_path_where_that_is_asked_for() -> None:
    """In half a second the path law is up to 5 mm early, and not beside its path."""
    asked = ("0", "0.02", "--mode", "-", "--controller", "path", "--duration", "0.5")
    code, _, refusal = goto(*asked, "--plan-only")
    assert (code, "predicted distance from the reference is 0.005 m" in " ".join(refusal.split())) == (2, True)
    figures = {figure["name"]: figure for figure in plan(*asked, "--judge", "path")["figures"]}
    error = figures["predicted distance from the path"]
    assert error["value"] < 1e-4 < error["limit"] == 1e-3
    assert figures["predicted distance from the reference"]["limit"] == load_scenario("middle").tracking_error_limit
    code, _, refusal = goto(*asked, "--judge", "way", "--plan-only")
    assert (code, "--judge: 'way': expected one of timed, path" in refusal) == (2, True)
    code, _, refusal = goto("0", "0.02", "--live", "--judge", "path")
    assert (code, "--judge: expected without --live" in refusal) == (2, True)


def test_without_a_page_summary_and_bag_are_written(tmp_path: Path) -> None:
    code, _, err = goto("0", "0.14", "--no-page", "--out", str(tmp_path / "run"))
    assert code == 0, err
    run = RunDirectory(tmp_path / "run")
    assert json.loads(run.summary.read_text())["outcome"] == "succeeded"
    assert read_bag(run.bag).count(JOINT_STATES) > 0
    assert not run.page.exists()


@pytest.mark.extra
def test_it_goes_round_the_corners_at_via_points_and_is_quicker_than_with_rests() -> None:
    way = ("0", "0.02", "--from", "0.03", "0.12", "--via", "0.03,0.14", "--via", "0.0,0.14")
    rests, rounded = plan(*way), plan(*way, "--blend-radius", "0.01")
    assert rests["waypoints"] == rounded["waypoints"] == [[0.03, 0.12], [0.03, 0.14], [0.0, 0.14], [0.0, 0.02]]
    assert (rests["blend_radius"], rests["time_law"]) == ([0.0, 0.0], "quintic")
    assert (rounded["blend_radius"], rounded["time_law"]) == ([0.01, 0.01], "optimal")
    assert rounded["duration_s"] < 0.85 * rests["duration_s"]
    code, out, _ = goto(*way, "--blend-radius", "0.01", "--blend-radius", "0", "--plan-only")
    assert code == 0
    assert "in 2 segments" in out
    assert (
        "segment 1: (0.0300, 0.1200) m to (0.0300, 0.1400) m to (0.0000, 0.1400) m, corners rounded within 0.01" in out
    )
    assert "segment 2: (0.0000, 0.1400) m to (0.0000, 0.0200) m in" in out


def test_the_scenario_that_runs_it_plans_the_motion_that_was_judged() -> None:
    before = load_scenario("middle").model_copy(update={"blend_radius": 0.02})
    request = Request(
        *(0.03, 0.02, None, None, Start(0.0, 0.15, (1, -1), before), "unified", "dextar", 2.0, 50.0, 500),
        *(Speed.COMFORTABLE, ((0.04, 0.13),)),
    )
    for radius, law in ((0.02, "optimal"), (0.0, "quintic")):
        transfer = plan_request(request._replace(blend_radius=(radius,)))
        scenario = scenario_of(request, transfer)
        assert (scenario.blend_radii(), scenario.time_law) == ((radius,), law)
        planned, judged = scenario.plan().path, transfer.plan.path
        assert planned.duration == judged.duration
        assert all(planned.at(k / 500) == judged.at(k / 500) for k in range(judged.samples(500) + 1))


def test_a_request_to_a_running_graph_has_the_via_points_of_the_command() -> None:
    via, radii = ((0.04, 0.13), (0.03, 0.1)), (0.02, 0.0)
    fields = goal_fields(0.03, 0.02, "-", (1, -1), 1.5, via, radii)
    goal = read_goal(tuple(fields), tuple(fields.values()))
    assert goal == Goal(0.03, 0.02, -1, 1, -1, 1.5, via=via, blend_radius=radii)
    assert goal_fields(0.03, 0.02, None, None, None) == {"x": 0.03, "y": 0.02}


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("0.3", "0.1"), "goal: (0.3000, 0.1000) m is out of reach of leg 1"),
        (("0", "0.12", "--mode", "-"), "assembly mode - needs working mode (-1, +1)"),
        (("0", "0.02", "--mode", "up"), "--mode: 'up': expected + or -"),
        (("0", "0.02", "--working-mode", "-1", "1"), "--working-mode: (-1, +1): the robot rests in working mode (+1,"),
        (("0", "0.02", "--working-mode", "2", "1"), "--working-mode: [2, 1]: expected two signs"),
        (("0", "0.02", "--from-mode", "1", "2"), "fivebar: --from-mode: [1, 2]: expected two signs"),
        (("0", "0.02", "--controller", "ctc"), "--controller: 'ctc': expected one of"),
        (("0", "0.02", "--robot", "nobody"), "robot 'nobody'"),
        (("0", "0.11", "--robot", "motkin", "--from", "0", "0.041"), "homing_contradicted: at (0.0000, 0.0410) m the"),
        (("0", "0.02", "--torque-limit", "0"), "--torque-limit: 0.0: expected a positive number"),
        (("0", "0.02", "--torque-limit", "0.4"), "reference torque is 0.4"),
        (("0", "0.02", "--duration", "9"), "in 9 s time near the Type 2 locus"),
        (("0", "0.02", "--duration", "2", "--fastest"), "--fastest and --duration"),
        (("0", "0.02", "--via", "0.03"), "--via: '0.03': expected two coordinates in m, such as 0.04,0.13"),
        (("0", "0.02", "--blend-radius", "0.01"), "--blend-radius: expected with --via, whose corners are rounded"),
        (
            ("0", "0.02", "--via", "0,0.14", "--blend-radius", "0.0001"),
            "--blend-radius: [0.0001]: expected 0 for",
        ),
        (("0", "0.02", "--via", "0.03,0.14", "--blend-radius", "0.05"), "do not fit on the 0.03162 m between them"),
        (("0", "0.02", "--after", "nowhere"), "nowhere: is not a run directory"),
        (("0", "0.02", "--after", "nowhere", "--from", "0", "0.1"), "--after and --from"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(arguments: tuple[str, ...], expected: str) -> None:
    code, out, err = goto(*arguments)
    assert code == 2
    assert out == ""
    assert expected in err
    assert err.startswith("fivebar: ")
    assert err.count("\n") == 1


@pytest.mark.parametrize(("payloads", "carried"), [((0.3, 0.5), "0.5 kg"), ((0.5, 0.0), "")])
def test_it_goes_on_only_where_the_platform_carries_nothing(
    payloads: tuple[float, ...], carried: str, tmp_path: Path
) -> None:
    scenario = load_scenario("gyro_middle")
    run = new_run_directory(tmp_path / "run", scenario)
    with BagWriter(run.bag, [JOINT_STATES, PAYLOAD]) as bag:
        at_rest = serialize.joint_state(1, JOINTS, initial_joints(scenario), (0.0,) * 4, (0.0,) * 4)
        bag.write(JOINT_STATES, 1, at_rest)
        for moment, payload in enumerate(payloads):
            bag.write(PAYLOAD, 2 + moment, serialize.float64(payload))
        bag.close({})
    code, out, err = goto("0", "0.14", "--after", str(run.path), "--plan-only")
    if not carried:
        assert code == 0
        return
    assert (code, out) == (2, "")
    assert err.startswith(f"fivebar: --after: {run.path}: the platform still carries a payload of {carried}: expected ")
    assert err.count("\n") == 1


@pytest.mark.extra
@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        *(
            (given, f"{given[0]}: expected without --live: the running graph has its own robot")
            for given in (
                ("--from", "0", "0.15"),
                ("--from-mode", "1", "-1"),
                ("--after", "nowhere"),
                ("--seen", "camera"),
                ("--controller", "unified"),
                ("--robot", "dextar"),
                ("--torque-limit", "1"),
                ("--speed-limit", "10"),
                ("--fastest",),
                ("--plan-only",),
                ("--offline",),
                ("--ros",),
                ("--out", "new"),
                ("--no-page",),
            )
        ),
        (("--torque-limit", "0", "--out", "new"), "--torque-limit, --out: expected without --live"),
        (("--timeout", "0"), "--timeout: 0.0: expected a positive number"),
        (("--timeout", "nan"), "--timeout: nan: expected a positive number"),
        (("--timeout", "inf"), "--timeout: inf: expected a positive number"),
        (("--duration", "nan"), "--duration: nan: expected a positive number"),
    ],
)
def test_a_running_graph_is_asked_for_nothing_that_it_would_not_do(
    monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], expected: str
) -> None:
    asked: list[dict[str, float]] = []
    monkeypatch.setattr("fivebar_bringup.motions.live.request_live", lambda fields, *others: asked.append(fields))
    code, out, err = goto("0", "0.02", "--live", *arguments)
    assert (code, out, asked) == (2, "", [])
    assert err.startswith(f"fivebar: {expected}")
    assert err.count("\n") == 1


@pytest.mark.parametrize("option", [("--domain", "7"), ("--namespace", "left"), ("--timeout", "30")])
def test_what_a_running_graph_alone_would_hear_is_refused_without_one(option: tuple[str, str]) -> None:
    code, out, err = goto("0", "0.02", *option, "--plan-only")
    assert (code, out) == (2, "")
    assert err == f"fivebar: {option[0]}: expected with --live: this motion is run on its own\n"


def test_what_goes_with_a_running_graph_reaches_it(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []

    def arrive(*given: Any) -> dict[str, str]:
        asked.append(given)
        return {"state": "arrived"}

    monkeypatch.setattr("fivebar_bringup.motions.live.request_live", arrive)
    code, _, err = goto(
        *("0", "0.02", "--live", "--mode", "-", "--working-mode", "1", "-1", "--duration", "2", "--via", "0,0.1"),
        *("--blend-radius", "0.01", "--domain", "7", "--namespace", "left", "--timeout", "9"),
    )
    assert code == 0, err
    ((fields, domain, timeout, _, namespace),) = asked
    assert fields == goal_fields(0.0, 0.02, "-", (1, -1), 2.0, ((0.0, 0.1),), (0.01,))
    assert (domain, timeout, namespace) == (7, 9.0, "/left")
