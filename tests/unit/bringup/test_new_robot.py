# SPDX-License-Identifier: Apache-2.0
"""Robot files that are made from answers."""

from __future__ import annotations

import json
import math
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_bringup.cli.robot import check_file, check_text
from fivebar_bringup.robots.new_robot import new_robot
from fivebar_bringup.robots.questions import LENGTHS, OTHERS
from fivebar_control.planning.postures import place_at
from fivebar_description.robot_file import read_robot
from fivebar_studies.rigs.named import find_rig
from fivebar_studies.rigs.rig import OF_ROBOT

QUESTIONS = (*LENGTHS, *OTHERS)

USUAL: dict[str, float] = {}
for _question in QUESTIONS:
    USUAL[_question.key] = _question.default(USUAL)

BELT = {
    "a": "200",
    "l_11": "150",
    "l_12": "180",
    "l_22": "175",
    "platform": "0.25",
    "gear": "6",
    "rotor": "1e-4",
    "torque": "8",
    "speed": "20",
    "frequency": "60",
    "backlash": "1",
    "imu_rate": "100",
    "imu_noise": "0.02",
    "passive_counts": "4096",
    "known_length": "0.2",
    "known_zero": "0.1",
}


def answered(path: Path, lines: str, *options: str) -> tuple[int, str, str]:
    done = CliRunner().invoke(app, ["robot", "new", str(path), *options], input=lines)
    return done.exit_code, done.stdout, done.stderr


def text_of(answers: dict[str, str]) -> str:
    return "".join(f"{answers.get(one.key, '')}\n" for one in QUESTIONS)


def test_answers_make_a_robot(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    assert answered(path, text_of(BELT))[0] == 0
    file = read_robot(str(path))
    robot = file.five_bar()
    assert (file.name, robot.leg1.distal, robot.leg2.proximal, robot.leg2.distal) == ("mine", 0.18, 0.15, 0.175)
    # 14 bits on the motor, and a rotor that turns six times as far
    assert file.drives.encoder_counts == 6 * 16384
    assert robot.leg1.inertia == pytest.approx(36e-4 + 0.2 * 0.15**2 / 3.0 + 0.05 * 0.15**2, rel=1e-4)
    assert robot.mass == pytest.approx(0.35)
    assert file.transmission[:2] == (60.0, 0.04) and file.transmission.backlash == 1e-3
    assert file.transmission.rotor_share == pytest.approx(36e-4 / robot.leg1.inertia, abs=1e-3)
    assert file.imu is not None and (file.imu.rate_hz, file.imu.gyro_noise) == (100, 0.02)
    assert file.passive_encoder is not None and file.passive_encoder.counts == 4096
    assert (file.tolerances.length, file.tolerances.zero) == (2e-4, pytest.approx(math.radians(0.1), rel=1e-3))
    home = place_at(robot, (1, -1), *file.home_m)
    assert min(home.kappa, home.serial) > 0.5
    done = CliRunner().invoke(app, ["robot", "check", str(path)])
    assert (done.exit_code, done.stderr) == (0, "") and "mine" in done.stdout
    assert sum(line.lstrip().startswith("#") for line in path.read_text(encoding="utf-8").splitlines()) > 8


def test_empty_lines_are_the_usual_answers_which_are_shown(tmp_path: Path) -> None:
    code, printed, shown = answered(tmp_path / "usual.yaml", "\n" * len(QUESTIONS), "--json")
    assert code == 0 and json.loads(printed)["robot"] == "usual"
    assert "(mm) [118]" in shown and "turn of the motor [16384]" in shown
    file = read_robot(str(tmp_path / "usual.yaml"))
    assert (file.lengths_m.a, file.transmission.frequency, file.imu, file.passive_encoder) == (0.118, 0.0, None, None)


@pytest.mark.parametrize(
    ("key", "wrong", "words"),
    [
        ("platform", "heavy", "'heavy': expected a number"),
        ("platform", "nan", "nan: expected at least 0.0001"),
        ("a", "-3", "-3: expected at least 0.1"),
        ("l_22", "0.001", "0.001: expected at least 0.1, at most 3000"),
        ("tilt", "90", "90: expected at least 0, at most 89"),
        ("counts", "1000.5", "1000.5: expected a whole number"),
        ("backlash", "1e3", "1e3: expected at least 0, at most 100"),
    ],
)
def test_a_wrong_answer_is_refused_in_a_line_and_asked_again(tmp_path: Path, key: str, wrong: str, words: str) -> None:
    answers = BELT | {key: f"{wrong}\n{BELT.get(key, '')}"}
    code, shown, refused = answered(tmp_path / "again.yaml", text_of(answers))
    assert (code, refused.count("\n")) == (0, 1) and words in refused
    question = next(one.words for one in QUESTIONS if one.key == key)
    assert shown.count(question) == 2
    assert read_robot(str(tmp_path / "again.yaml")).lengths_m.a == 0.2


def test_an_encoder_that_does_not_count_is_refused_and_asked_again(tmp_path: Path) -> None:
    code, _, refused = answered(tmp_path / "none.yaml", text_of(BELT | {"gear": "0.1", "counts": "4\n16384"}))
    assert (code, refused.count("\n")) == (0, 1)
    assert "4: with a gear of 0.1 these are 0 counts in a turn of the joint: expected 2 to 1000000000" in refused
    assert read_robot(str(tmp_path / "none.yaml")).drives.encoder_counts == 1638


def test_backlash_of_transmissions_whose_frequency_is_unknown_gets_one_and_says_so(tmp_path: Path) -> None:
    path = tmp_path / "belt.yaml"
    code, _, told = answered(path, text_of(BELT | {"frequency": "0"}))
    assert (code, told) == (0, "fivebar: transmission.frequency: backlash needs one: 300 Hz is assumed\n")
    assert read_robot(str(path)).transmission[:2] == (300.0, 0.04)
    assert "assumed, since backlash needs one" in path.read_text(encoding="utf-8")
    done = CliRunner().invoke(app, ["robot", "check", str(path)])
    assert (done.exit_code, done.stderr) == (0, "")


def test_a_file_with_backlash_alone_is_refused_by_its_own_keys(tmp_path: Path) -> None:
    path = tmp_path / "belt.yaml"
    assert answered(path, text_of(BELT))[0] == 0
    path.write_text(path.read_text(encoding="utf-8").replace("frequency: 60, ", ""), encoding="utf-8")
    for words in (["robot", "check", str(path)], ["assess", str(path)], ["goto", "0", "0.1", "--robot", str(path)]):
        done = CliRunner().invoke(app, words)
        assert done.exit_code == 2
        assert done.stderr == (
            f"fivebar: {path}: transmission.backlash: 1 mrad: backlash needs a transmission frequency: expected"
            " transmission.frequency above 0, say 300 (Hz)\n"
        )


def test_a_home_position_out_of_reach_is_refused_by_its_key(tmp_path: Path) -> None:
    path = tmp_path / "far.yaml"
    assert answered(path, text_of(BELT))[0] == 0
    text = path.read_text(encoding="utf-8")
    home = next(line for line in text.splitlines() if line.startswith("home_m:"))
    path.write_text(text.replace(home, "home_m: [0.0, 0.9]"), encoding="utf-8")
    done = CliRunner().invoke(app, ["robot", "check", str(path)])
    assert done.exit_code == 2
    expected = f"fivebar: {path}: home_m: [0, 0.9]: is out of reach: expected where both legs reach\n"
    assert done.stderr == expected


def test_an_answer_is_changed_by_going_back(tmp_path: Path) -> None:
    path = tmp_path / "back.yaml"
    # to the two questions before, of which the second keeps its answer
    answers = BELT | {"speed": "<\n<\n2e-4\n\n20"}
    code, shown, refused = answered(path, text_of(answers))
    assert (code, refused) == (0, "")
    file = read_robot(str(path))
    assert (file.drives.torque_limit, file.drives.joint_speed_limit) == (8.0, 20.0)
    assert file.five_bar().leg1.inertia == pytest.approx(72e-4 + 0.2 * 0.15**2 / 3.0 + 0.05 * 0.15**2, rel=1e-4)
    assert "behind the gear (Nm) [8]" in shown and "motor's side (kg m^2) [1e-4]" in shown


@given(st.data())
@settings(max_examples=40)
def test_what_is_asked_and_written_passes_its_own_check(data: st.DataObject) -> None:
    def answer(question: str) -> str:
        one = next(one for one in QUESTIONS if question.startswith(one.words))
        # what is refused for all answers together is asked for again: after a while, the usual answers
        asked.append(one.key)
        if asked.count(one.key) > 3:
            return {"a": "118", **{name: "90" for name in ("l_11", "l_12", "l_21", "l_22")}}.get(
                one.key, f"{one.default(USUAL):.10g}"
            )
        value = data.draw(
            st.one_of(
                st.just(""),
                st.sampled_from((one.at_least, one.at_most)),
                st.floats(one.at_least, one.at_most),
                st.floats(0.0, 1.0).map(lambda share: one.at_least + (one.at_most - one.at_least) * share**9),
            )
        )
        return value if isinstance(value, str) else f"{round(value) if one.whole else value:.10g}"

    asked: list[str] = []
    with TemporaryDirectory() as folder:
        path = Path(folder, "drawn.yaml")
        path.write_text(new_robot("drawn", answer, lambda words: None, partial(check_text, "drawn.yaml")))
        assert check_file(path) == "drawn"


def test_a_name_with_spaces_and_signs_makes_a_robot_whose_command_can_be_pasted(tmp_path: Path) -> None:
    path = tmp_path / 'my "bot" #.yaml'
    code, shown, _ = answered(path, text_of(BELT))
    assert code == 0 and f"fivebar assess '{path}' says" in shown
    done = CliRunner().invoke(app, ["robot", "check", str(path)])
    assert (done.exit_code, done.stderr) == (0, "")
    # a variant of it, as the assessment runs it
    assert find_rig(f"{OF_ROBOT}{path}#push").robot == str(path)


def test_legs_that_never_meet_are_asked_for_again(tmp_path: Path) -> None:
    apart = "900\n100\n100\n100\n100\n"
    code, shown, refused = answered(tmp_path / "met.yaml", apart + text_of(BELT))
    assert (code, refused.count("\n")) == (0, 1) and "expected less than" in refused
    assert shown.count(LENGTHS[0].words) == 2


@pytest.mark.parametrize(
    ("name", "lines", "words"),
    [
        ("short.yaml", "200\n150\n", "no answer"),
        ("none.txt", "", "ends in .yaml"),
        ("nowhere/none.yaml", "", "no such directory"),
        ("there.yaml", "", "--overwrite"),
    ],
)
def test_nothing_is_written_without_all_answers_nor_over_a_file(
    tmp_path: Path, name: str, lines: str, words: str
) -> None:
    (tmp_path / "there.yaml").write_text("kept", encoding="utf-8")
    code, _, refused = answered(tmp_path / name, lines)
    assert (code, refused.count("\n")) == (2, 1) and words in refused
    assert [one.name for one in tmp_path.iterdir()] == ["there.yaml"]
    assert (tmp_path / "there.yaml").read_text(encoding="utf-8") == "kept"


def test_a_file_is_replaced_when_told_so(tmp_path: Path) -> None:
    path = tmp_path / "there.yaml"
    path.write_text("kept", encoding="utf-8")
    assert answered(path, text_of(BELT), "--overwrite")[0] == 0
    assert read_robot(str(path)).name == "there"
