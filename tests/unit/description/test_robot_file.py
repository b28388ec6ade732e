# SPDX-License-Identifier: Apache-2.0
"""The robot files: the published values, and one clear line for every kind of bad file."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from fivebar_bringup.scenario import Scenario
from fivebar_description.camera import CameraSettings
from fivebar_description.robot_file import load_robot, read_robot, robot_path
from fivebar_description.strict_yaml import InputError, load_yaml, yaml_text

SRC = Path(__file__).parents[3] / "src"
GOOD = robot_path("dextar").read_text(encoding="utf-8")

MOTKIN = robot_path("motkin").read_text(encoding="utf-8")


def replaced(old: str, new: str) -> str:
    assert GOOD.count(old) == 1
    return GOOD.replace(old, new)


def test_dextar_has_the_values_of_section_1_4_1() -> None:
    robot = load_robot("dextar")
    assert (robot.leg1.base_x, robot.leg2.base_x) == (-0.059, 0.059)
    for leg in (robot.leg1, robot.leg2):
        assert (leg.proximal, leg.distal) == (0.09, 0.09)
    assert (robot.leg1.inertia, robot.leg2.inertia, robot.mass) == (0.0133, 0.0142, 0.537)
    assert (robot.leg1.coulomb, robot.leg2.coulomb) == (0.345, 0.430)
    assert (robot.leg1.offset, robot.leg2.offset) == (0.0855, 0.0)


def test_the_second_robot_has_no_equal_links() -> None:
    robot = load_robot("unequal")
    assert robot.leg1[:3] == (-0.07, 0.085, 0.11)
    assert robot.leg2[:3] == (0.07, 0.1, 0.095)
    assert robot.leg1.inertia != robot.leg2.inertia


def test_a_path_reads_the_same_as_a_name(tmp_path: Path) -> None:
    path = tmp_path / "copy.yaml"
    path.write_text(GOOD, encoding="utf-8")
    assert load_robot(str(path)) == load_robot("dextar")


def test_links_add_up_to_grouped_parameters() -> None:
    """Two points with the link's mass and centre of mass, and what its inertia has beyond theirs."""
    leg1, leg2, mass = load_robot("motkin")[:3]
    assert mass == pytest.approx(8.37e-3 * 0.487 + 9.69e-3 * 0.557, rel=1e-14)
    assert leg1.inertia == pytest.approx(1.354e-5 + 0.0422 * 0.00341**2 + 8.37e-3 * 0.513 * 0.0036, rel=1e-14)
    assert leg1.residual == pytest.approx(1.316e-5 - 8.37e-3 * 0.0487 * 0.0513, rel=1e-14)
    assert leg2.residual == pytest.approx(1.629e-5 - 9.69e-3 * 0.0557 * 0.0443, rel=1e-14)
    assert load_robot("dextar").leg1.residual == load_robot("dextar").leg2.residual == 0.0


def test_an_end_effector_adds_its_mass_and_turns_with_leg_2(tmp_path: Path) -> None:
    path = tmp_path / "tool.yaml"
    path.write_text(MOTKIN + "end_effector: {mass_kg: 0.02, inertia_kg_m2: 3.0e-6}\n", encoding="utf-8")
    bare, tool = load_robot("motkin"), load_robot(str(path))
    assert tool.mass == pytest.approx(bare.mass + 0.02, rel=1e-14)
    assert tool.leg2.residual == pytest.approx(bare.leg2.residual + 3e-6, rel=1e-14)
    assert tool.leg1 == bare.leg1


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (MOTKIN + "mass_kg: {m: 0.01}\n", "mass_kg: expected either grouped parameters or proximal_links, not both"),
        (MOTKIN.replace("distal_links:", "tolerances: {}\nloads:"), "loads.leg_1: unknown key"),
        (
            re.sub(r"distal_links:(.*\n){3}", "", MOTKIN),
            "distal_links: is missing beside proximal_links",
        ),
        (
            MOTKIN.replace("0.0487", "0.187"),
            "distal_links.leg_1.centre_m: 0.187: expected at most the length of the link, 0.1 m",
        ),
        (GOOD + "end_effector: {mass_kg: 1.0}\n", "end_effector: expected only beside proximal_links and distal_links"),
        (
            GOOD.replace("  zz_21R:", "  zz_22R: -4.0e-3\n  zz_21R:"),
            "inertias_kg_m2.zz_22R: -0.004: no bodies have these parameters: expected less in magnitude for"
            " zz_21R = 0.0142 kg m^2 and this m",
        ),
    ],
)
def test_links_that_do_not_make_a_robot_are_refused(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=re.escape(words)):
        load_robot(str(path))


BAD_FILES = {
    "not YAML": (lambda: "name: [dextar", ["is not valid YAML"]),
    "a list": (lambda: "- 0.09\n", ["expected keys with values, found list"]),
    "empty": (lambda: "", ["expected keys with values, found NoneType"]),
    "duplicate key": (
        lambda: replaced("  l_12: 0.09 ", "  l_11: 0.08\n  l_12: 0.09 "),
        ['duplicate key "l_11"', "line 7"],
    ),
    "duplicate section": (lambda: GOOD + "mass_kg:\n  m: 1.0\n", ['duplicate key "mass_kg"', "line 21"]),
    "key that is a list": (lambda: GOOD + "? [a, b]\n: 1.0\n", ["expected a word as the key"]),
    "unknown key": (lambda: replaced("  m: 0.537", "  m: 0.537\n  mm: 1.0"), ["mass_kg.mm: unknown key"]),
    "unknown section": (lambda: GOOD + "colour: red\n", ["colour: unknown key"]),
    "missing key": (lambda: replaced("  zz_21R: 0.0142", "  # nothing"), ["inertias_kg_m2.zz_21R: is missing"]),
    "missing section": (lambda: replaced("mass_kg:\n  m: 0.537", ""), ["mass_kg: is missing"]),
    "a word for a number": (
        lambda: replaced("m: 0.537", "m: heavy"),
        ["mass_kg.m: 'heavy': expected a number"],
    ),
    "a quoted number": (lambda: replaced("m: 0.537", 'm: "0.537"'), ["mass_kg.m: '0.537': expected a number"]),
    "a boolean": (lambda: replaced("m: 0.537", "m: true"), ["mass_kg.m: True: expected a number"]),
    "a word that YAML 1.1 takes for true": (
        lambda: replaced("m: 0.537", "m: yes"),
        ["mass_kg.m: 'yes': expected a number"],
    ),
    "too deep": (lambda: GOOD + "colour: " + "[" * 5000, ["is nested too deeply"]),
    "a day that no month has": (lambda: GOOD + "colour: 2001-02-30\n", ["is not valid YAML: day is out of range"]),
    "two documents": (lambda: GOOD + "---\nname: other\n", ["but found another document"]),
    "a control character": (lambda: GOOD + "colour: \x01\n", ["is not valid YAML"]),
    "nothing for a number": (lambda: replaced("m: 0.537", "m:"), ["mass_kg.m: None: expected a number"]),
    "a list for a section": (
        lambda: replaced("mass_kg:\n  m: 0.537", "mass_kg: [1.0]"),
        ["mass_kg: [1.0]: expected keys"],
    ),
    "a number for the name": (lambda: replaced("name: dextar", "name: 5"), ["name: 5: expected text"]),
    "an empty name": (lambda: replaced("name: dextar", "name: ''"), ["name: '':", "at least 1 character"]),
    "NaN": (lambda: replaced("l_22: 0.09 ", "l_22: .nan "), ["lengths_m.l_22: nan:", "finite number"]),
    "infinity": (lambda: replaced("a: 0.118", "a: .inf"), ["lengths_m.a: inf:", "finite number"]),
    "negative length": (
        lambda: replaced("l_21: 0.09 ", "l_21: -0.09 "),
        ["lengths_m.l_21: -0.09:", "at least 0.0001"],
    ),
    "zero length": (
        lambda: replaced("l_11: 0.09 ", "l_11: 0.0 "),
        ["lengths_m.l_11: 0.0:", "at least 0.0001"],
    ),
    "a length in millimetres": (
        lambda: replaced("l_12: 0.09 ", "l_12: 90.0 "),
        ["lengths_m.l_12: 90.0:", "expected at most 10"],
    ),
    "an inertia in g cm^2": (
        lambda: replaced("0.0142", "142000.0"),
        ["inertias_kg_m2.zz_21R: 142000.0:", "expected at most 1000"],
    ),
    "negative inertia": (
        lambda: replaced("0.0133", "-0.0133"),
        ["inertias_kg_m2.zz_11R: -0.0133:", "above 0"],
    ),
    "massless platform": (lambda: replaced("m: 0.537", "m: 0.0"), ["mass_kg.m: 0.0:", "expected above 0"]),
    "negative friction": (
        lambda: replaced("f_s21: 0.430", "f_s21: -0.430"),
        ["friction.f_s21: -0.43:", "expected at least 0"],
    ),
    "no smoothing": (
        lambda: replaced("width_rad_s: 0.02", "width_rad_s: 0.0"),
        ["friction.width_rad_s: 0.0:", "expected above 0"],
    ),
    "a number for whether": (lambda: GOOD + "elbows_pass: 1\n", ["elbows_pass: 1: expected true, false or unknown"]),
    "a word for whether": (lambda: GOOD + "elbows_pass: no\n", ["elbows_pass: 'no': expected true, false or unknown"]),
    "two mistakes": (
        lambda: replaced("m: 0.537", "m: heavy") + "colour: red\n",
        ["mass_kg.m: 'heavy'", "colour: unknown key"],
    ),
}


@pytest.mark.parametrize("kind", BAD_FILES)
def test_a_bad_file_is_refused_in_one_line_with_file_key_and_value(kind: str, tmp_path: Path) -> None:
    make: Callable[[], str]
    make, expected = BAD_FILES[kind]
    path = tmp_path / "bad.yaml"
    path.write_text(make(), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_robot(str(path))
    text = str(caught.value)
    assert text.startswith(f"{path}: ")
    assert "\n" not in text
    for words in expected:
        assert words in text


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    path = tmp_path / "none.yaml"
    with pytest.raises(InputError) as caught:
        load_robot(str(path))
    assert str(caught.value) == f"{path}: cannot be read: No such file or directory"


def test_a_folder_and_a_binary_file_are_refused(tmp_path: Path) -> None:
    folder = tmp_path / "folder.yaml"
    folder.mkdir()
    with pytest.raises(InputError, match=r"folder\.yaml: is a directory: expected a file"):
        load_robot(str(folder))
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(b"name: \xff\xfe\n")
    with pytest.raises(InputError, match=r"binary\.yaml: is not UTF-8 text"):
        load_robot(str(binary))


def test_an_unknown_robot_is_answered_with_the_known_ones() -> None:
    known = "dextar, motkin, motkin_vertical, unequal, or a path"
    with pytest.raises(InputError, match=f"robot 'dexter': expected one of {known}"):
        load_robot("dexter")


@pytest.mark.parametrize(
    "value",
    [
        "!!python/object/apply:os.mkdir [{made}]",
        "!!python/object/new:os.mkdir [{made}]",
        "!!python/name:os.mkdir",
        "!!python/module:os",
        "!!python/tuple [1, 2]",
        "!<tag:yaml.org,2002:python/object/apply:os.mkdir> [{made}]",
        "!robot {{name: x}}",
    ],
)
def test_yaml_cannot_make_python_objects(tmp_path: Path, value: str) -> None:
    path, made = tmp_path / "unsafe.yaml", tmp_path / "made"
    path.write_text(f"name: {value.format(made=made)}\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"is not valid YAML.*could not determine a constructor"):
        load_robot(str(path))
    assert not made.exists()


@pytest.mark.parametrize("text", ["3.0e2", "3e2", "3E+2", "+3_00", "0x12c", "0o454", "300."])
def test_numbers_of_yaml_1_2_are_numbers(tmp_path: Path, text: str) -> None:
    path = tmp_path / "pushed.yaml"
    path.write_text(f"{GOOD}forces: {{force_x: {text}}}\n", encoding="utf-8")
    assert load_robot(str(path)).force_x == 300.0


@pytest.mark.parametrize("name", ["on", "yes", "off", "No", "1:30"])
def test_words_of_yaml_1_2_are_words(tmp_path: Path, name: str) -> None:
    path = tmp_path / "named.yaml"
    path.write_text(replaced("name: dextar", f"name: {name}"), encoding="utf-8")
    assert read_robot(str(path)).name == name


@pytest.mark.parametrize(
    "word", ["3e4", "1E-5", "0o14", "014", "0x1f", ".5", "5.", "on", "yes", "1:30", "~", "12e", "x"]
)
def test_a_written_word_is_read_as_that_word_by_yaml_1_1_and_1_2(tmp_path: Path, word: str) -> None:
    content = {"word": word, "small": 1e-05, "large": 3e16, "whole": 14}
    path = tmp_path / "written.yaml"
    path.write_text(yaml_text(content), encoding="utf-8")
    assert load_yaml(path) == yaml.safe_load(path.read_text(encoding="utf-8")) == content


def test_shipped_files_mean_the_same_in_yaml_1_1_and_1_2() -> None:
    files = sorted(SRC.glob("*/config/**/*.yaml"))
    assert len(files) > 30
    assert not [
        path for path in files if repr(load_yaml(path)) != repr(yaml.safe_load(path.read_text(encoding="utf-8")))
    ]


def test_a_read_file_cannot_be_changed() -> None:
    file = read_robot("dextar")
    assert file.model_dump(exclude_unset=True) == yaml.safe_load(GOOD)
    with pytest.raises(ValueError, match="frozen"):
        file.mass_kg.m = 1.0


@pytest.mark.parametrize(
    ("section", "on", "height"),
    [("{z: 0.7}", True, 0.7), ("{on: true, z: 0.7}", True, 0.7), ("{on: false, z: 0.7}", False, CameraSettings().z)],
)
def test_a_robot_has_the_camera_that_its_file_declares_unless_it_is_off(
    section: str, on: bool, height: float, tmp_path: Path
) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(f"{GOOD}camera: {section}\n", encoding="utf-8")
    assert (read_robot(str(path)).camera is not None) == on
    scenario = Scenario.model_validate(
        {"name": "seen", "robot": str(path), "waypoints": [[0.0, 0.15], [0.0, 0.02]], "estimator": "ekf"}
    )
    assert (scenario.camera.on, scenario.ekf.camera, scenario.camera.z) == (on, on, height)


def test_a_declared_passive_encoder_says_its_leg(tmp_path: Path) -> None:
    """In a scenario leg 0, the default, is none: such a declaration would not count."""
    path = tmp_path / "robot.yaml"
    path.write_text(f"{GOOD}passive_encoder: {{counts: 65536}}\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"passive_encoder\.leg: is missing: expected 1 or 2, the leg whose passive"):
        read_robot(str(path))
    path.write_text(f"{GOOD}passive_encoder: {{leg: 1, counts: 65536}}\n", encoding="utf-8")
    encoder = read_robot(str(path)).passive_encoder
    assert encoder is not None and encoder.leg == 1
