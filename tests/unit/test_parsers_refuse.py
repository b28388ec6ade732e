"""Every file that is read is either understood or refused in one line; never a traceback, whatever is in it.

FUZZ_EXAMPLES is the number of inputs for each parser, a few by default; see `tests/support/fuzzing.py`.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

import pytest
import yaml
from fuzzing import FUZZED, expect_understood_or_refused, spliced
from hypothesis import given
from hypothesis import strategies as st

from fivebar_bringup.cli.migrate import migrated_file
from fivebar_bringup.live.commands import FIELDS, CommandRefused, read_command
from fivebar_bringup.report.timing import read_timing
from fivebar_bringup.runs.bag import serialize
from fivebar_bringup.runs.bag.reader import read_bag
from fivebar_bringup.runs.bag.recording import BagError
from fivebar_bringup.runs.bag.writer import BagWriter
from fivebar_bringup.runs.injection import read_injection
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenario_format import SCENARIO_RULES
from fivebar_bringup.studies.benchmark.scoring import HEAD as RESULTS_HEAD
from fivebar_bringup.studies.benchmark.scoring import read_results
from fivebar_bringup.studies.calibrate.reading import TouchedFile
from fivebar_bringup.studies.sweep.directory import SweepDirectory
from fivebar_bringup.studies.sweep.rows import HEAD as ROWS_HEAD
from fivebar_control.hardware.board_file import BoardFile
from fivebar_control.hardware.configuration import DriveFile, load_drives
from fivebar_control.hardware.frames import FrameReader
from fivebar_control.vision.calibration import read_calibration
from fivebar_description.file_format import read_versioned
from fivebar_description.interface import JOINT_STATES, JOINTS, RUN_EPOCH
from fivebar_description.parameters import ROBOT_RULES, RobotFile
from fivebar_description.run_plan import epoch_text, read_epoch, read_plan
from fivebar_description.strict_yaml import InputError, StrictModel, read_yaml, validate
from fivebar_sim.boards.configuration import BoardEmulationFile
from fivebar_sim.boards.protocol import (
    COMMAND,
    COMMAND_BODY,
    COMMAND_LENGTH,
    HEAD,
    MAGIC,
    VERSION,
    CommandReader,
    checksum,
)
from fivebar_sim.drives.configuration import EmulationFile

SRC = Path(__file__).parents[2] / "src"
REFUSALS = (InputError, BagError, CommandRefused)

FILES: dict[type[StrictModel], list[Path]] = {
    Scenario: sorted(SRC.glob("fivebar_bringup/config/scenarios/*.yaml")),
    RobotFile: sorted(SRC.glob("fivebar_description/config/*.yaml")),
    DriveFile: sorted(SRC.glob("fivebar_control/config/drives/*.yaml")),
    BoardFile: sorted(SRC.glob("fivebar_control/config/boards/*.yaml")),
    EmulationFile: sorted(SRC.glob("fivebar_sim/config/drives/*.yaml")),
    BoardEmulationFile: sorted(SRC.glob("fivebar_sim/config/boards/*.yaml")),
}

NUMBERS = st.one_of(
    st.integers(-10, 10), st.integers(), st.floats(), st.sampled_from([0.0, -0.0, 1e308, 5e-324, 1e-9, 2.0**63])
)
WORDS = st.one_of(
    st.text(max_size=8), st.sampled_from(["", "dextar", "../dextar", "os:path", "a.b:C", "null", "1e3", "on", "%s"])
)
VALUES = st.recursive(
    st.one_of(st.none(), st.booleans(), NUMBERS, WORDS),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(WORDS, inner, max_size=3)),
    max_leaves=6,
)


@cache
def shipped(path: Path) -> Any:
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def places(content: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the paths of everything inside of a content."""
    inner = content.items() if isinstance(content, dict) else enumerate(content) if isinstance(content, list) else ()
    return [path for key, value in inner for path in ((*at, key), *places(value, (*at, key)))]


@st.composite
def changed(draw: st.DrawFn, model: type[StrictModel]) -> Any:
    """A shipped file with some of it replaced, removed, or with a key too many."""
    content = copy.deepcopy(shipped(draw(st.sampled_from(FILES[model]))))
    for _ in range(draw(st.integers(1, 3))):
        *above, key = draw(st.sampled_from(places(content) or [("name",)]))
        inside = content
        for step in above:
            inside = inside[step]
        kind = draw(st.sampled_from(("replace", "remove", "add")))
        if kind == "add" and isinstance(inside, dict):
            inside[draw(WORDS)] = draw(VALUES)
        elif kind == "remove":
            del inside[key]
        else:
            inside[key] = draw(VALUES)
    return content


BYTES = st.one_of(
    st.just(b"[" * 9999),
    st.binary(max_size=200),
    st.text(max_size=100).map(lambda text: text.encode("utf-8", "replace")),
)
TOKENS = st.one_of(
    st.sampled_from(
        [
            b": ",
            b"- ",
            b"\n",
            b"\t",
            b"&a ",
            b"*a",
            b"<<: ",
            b"!!int ",
            b"!",
            b"%YAML 1.1\n---\n",
            b"|\n",
            b"{",
            b"]",
            b"'",
        ]
    ),
    st.sampled_from(
        [
            b"? ",
            b"#",
            b"2001-02-30",
            b"0x",
            b".inf",
            b"format: 0\n",
            b"1:30",
            b"=",
            b"~",
            b"\xef\xbb\xbf",
            b"\r",
            b"\x00",
        ]
    ),
    st.binary(max_size=4),
)


@pytest.mark.parametrize("model", FILES, ids=lambda model: model.__name__)
def test_a_changed_file(model: type[StrictModel]) -> None:
    @FUZZED
    @given(changed(model))
    def check(content: Any) -> None:
        expect_understood_or_refused(
            lambda: validate(content, model, "file"), REFUSALS, content, f"changed-{model.__name__}"
        )

    check()


def fuzz_files(path: Path, read: Callable[[Path], object], contents: st.SearchStrategy[bytes]) -> None:
    @FUZZED
    @given(contents)
    def check(content: bytes) -> None:
        path.write_bytes(content)
        expect_understood_or_refused(lambda: read(path), REFUSALS, content, path.name)

    check()


def fuzz_texts(
    name: str, read: Callable[[str], object], texts: st.SearchStrategy[str], *refusals: type[Exception]
) -> None:
    @FUZZED
    @given(texts)
    def check(text: str) -> None:
        expect_understood_or_refused(lambda: read(text), refusals or REFUSALS, text, name)

    check()


CAMERA = """\
{image_width: 640, image_height: 480, camera_name: c, distortion_model: plumb_bob,
camera_matrix: {rows: 3, cols: 3, data: [800.0, 0.0, 320.0, 0.0, 800.0, 240.0, 0.0, 0.0, 1.0]},
distortion_coefficients: {rows: 1, cols: 5, data: [0.0, 0.0, 0.0, 0.0, 0.0]},
rectification_matrix: {rows: 1, cols: 1, data: [1.0]}, projection_matrix: {rows: 1, cols: 1, data: [1.0]}}
"""
TOUCHED = "deviation_m: 2.0e-5\npoints:\n  - {time: 0.0, x: 0.0, y: 0.15}\n  - {q11: 1.6, q21: 1.5, x: 0.0, y: 0.12}\n"
YAML_FILES: dict[str, tuple[Callable[[Path], object], bytes]] = {
    "scenario": (
        partial(read_versioned, model=Scenario, rules=SCENARIO_RULES),
        FILES[Scenario][0].read_bytes() + b"adaptive_gain: {enabled: yes}\n",
    ),
    "robot": (partial(read_versioned, model=RobotFile, rules=ROBOT_RULES), FILES[RobotFile][1].read_bytes()),
    "migrated": (
        lambda path: migrated_file(path.read_bytes().decode("utf-8", "replace"), str(path), None),
        FILES[Scenario][1].read_bytes().replace(b"format: 1", b"format: 0"),
    ),
    "drives": (partial(read_yaml, model=DriveFile), FILES[DriveFile][0].read_bytes()),
    "camera": (read_calibration, CAMERA.encode()),
    "touched": (partial(read_yaml, model=TouchedFile), TOUCHED.encode()),
}


@pytest.mark.parametrize("kind", YAML_FILES)
def test_a_spliced_yaml_file(kind: str, tmp_path: Path) -> None:
    read, whole = YAML_FILES[kind]
    fuzz_files(tmp_path / f"{kind}.yaml", read, spliced(whole, TOKENS))


def test_bytes_instead_of_yaml(tmp_path: Path) -> None:
    fuzz_files(tmp_path / "any.yaml", lambda path: read_yaml(path, RobotFile), BYTES.map(b"name: any\n".__add__))


def test_bytes_instead_of_json(tmp_path: Path) -> None:
    fuzz_files(tmp_path / "timing.json", read_timing, BYTES)


def test_the_file_of_a_sweep(tmp_path: Path) -> None:
    whole = b'{"settings": {"seed": 1, "cases": 10, "program": "a", "rig": "ideal", "controllers": ["mpc"]}}'
    directory = SweepDirectory(tmp_path)
    fuzz_files(directory.content, lambda _: directory.read_settings(), spliced(whole, TOKENS))


def test_the_rows_of_a_sweep(tmp_path: Path) -> None:
    directory = SweepDirectory(tmp_path)
    line = ",".join("1" for _ in ROWS_HEAD.split(","))
    fuzz_files(
        directory.rows, lambda _: directory.complete_rows(), spliced(f"{ROWS_HEAD}{line}\n{line}\n".encode(), TOKENS)
    )


def test_results_of_the_benchmark() -> None:
    whole = f"{RESULTS_HEAD}0,ideal,mine,,1,0.001,0.5,0.1\n1,ideal,mine,torque_excessive,1,nan,inf,1e3\n".encode()
    texts = spliced(whole, TOKENS).map(lambda content: content.decode("utf-8", "replace"))
    fuzz_texts("results.csv", lambda text: read_results(text, "results.csv"), texts)


def test_bytes_instead_of_a_bag(tmp_path: Path) -> None:
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information: {version: 5}\n", encoding="utf-8")
    fuzz_files(tmp_path / "bag_0.mcap", lambda path: read_bag(path.parent), BYTES.map(b"\x89MCAP0\r\n".__add__))


def read_through(path: Path) -> None:
    """Read a bag and what is in it."""
    bag = read_bag(path.parent)
    bag.field(JOINT_STATES, "position")
    bag.samples(JOINT_STATES, 500)
    bag.joint_names(JOINT_STATES)


@pytest.mark.parametrize("file", ["bag_0.mcap", "metadata.yaml"])
def test_a_damaged_bag(file: str, tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag", [JOINT_STATES, RUN_EPOCH]) as bag:
        bag.write(RUN_EPOCH, 0, serialize.string(epoch_text(1_000_000_000)))
        for number in range(3):
            stamp = 1_000_000_000 + number * 2_000_000
            bag.write(JOINT_STATES, stamp, serialize.joint_state(stamp, JOINTS, (0.1, 0.2, 0.3, 0.4)))
        bag.close({})
    path = tmp_path / "bag" / file
    pieces = TOKENS if file.endswith("yaml") else st.binary(max_size=8)
    fuzz_files(path, read_through, spliced(path.read_bytes(), pieces))


def test_messages_of_a_page() -> None:
    keys = st.sampled_from(["command", "x", "y", "assembly", "torque"])
    values = st.one_of(VALUES, st.sampled_from(sorted(FIELDS)))

    @FUZZED
    @given(st.one_of(st.dictionaries(keys, values).map(json.dumps), st.text(max_size=50), st.binary(max_size=50)))
    def check(message: str | bytes) -> None:
        expect_understood_or_refused(lambda: read_command(message), REFUSALS, message, "page")

    check()


def test_what_nodes_agree_on() -> None:
    texts = st.one_of(
        VALUES.map(json.dumps),
        st.dictionaries(st.sampled_from(["epoch_ns", "digest", "values"]), VALUES).map(json.dumps),
        st.text(max_size=50),
    )
    fuzz_texts("plan", read_plan, texts, ValueError)
    fuzz_texts("epoch", read_epoch, texts, ValueError)


@pytest.mark.parametrize("board", [False, True])
def test_injected_faults(board: bool) -> None:
    words = st.sampled_from(
        ["0.3", "1e3", "nan", "fault", "late", "kill", "drop", "button", "press", "1", "2", "9", "blender", "²", "٣"]
    )
    texts = st.lists(st.one_of(words, st.text(max_size=5)), max_size=5).map(" ".join)
    fuzz_texts("injection", lambda text: read_injection(text, board), texts)


def test_can_frames() -> None:
    """Nothing is refused here: whatever comes from the bus is a frame, of a known kind or malformed."""
    reader = FrameReader(load_drives("dextar_emulated").pair, 127)
    ids = st.one_of(
        st.integers(0, 0x7FF), st.sampled_from([0x81, 0x82, 0x181, 0x182, 0x281, 0x282, 0x581, 0x582, 0x701, 0x702])
    )

    @FUZZED
    @given(ids, st.binary(max_size=8))
    def check(can_id: int, data: bytes) -> None:
        expect_understood_or_refused(lambda: reader.read(can_id, data), (), (can_id, data), "can")

    check()


def test_frames_of_the_board_in_pieces() -> None:
    """Nothing is refused, and it does not matter where a stream of bytes is cut."""
    frame = HEAD.pack(MAGIC, COMMAND, VERSION, COMMAND_LENGTH) + COMMAND_BODY.pack(7, 3, 20, *([0.5] * 10))
    frame += bytes((checksum(frame),))

    @FUZZED
    @given(
        spliced(frame * 3, st.sampled_from([MAGIC, frame[:9], b"\xff" * 4])), st.lists(st.integers(0, 200), max_size=4)
    )
    def check(stream: bytes, cuts: list[int]) -> None:
        def read() -> None:
            reader, commands, start = CommandReader(), [], 0
            for cut in (*sorted(cuts), len(stream)):
                commands += reader.read(stream[start:cut])
                start = max(start, cut)
            whole = CommandReader().read(stream)
            assert [repr(command) for command in commands] == [repr(command) for command in whole]

        expect_understood_or_refused(read, (), (stream, cuts), "board")

    check()
