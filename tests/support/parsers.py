# SPDX-License-Identifier: Apache-2.0
"""Everything that reads input from outside, as functions of bytes, with valid inputs to begin from."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import yaml

from fivebar_bringup.bag import serialize
from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.writer import BagWriter
from fivebar_bringup.calibrate.reading import TouchedFile
from fivebar_bringup.drives.kinds import CANOPEN_DRIVES
from fivebar_bringup.errors import BagError
from fivebar_bringup.recorded.timing import read_timing
from fivebar_bringup.runs.injection import read_injection
from fivebar_bringup.scenario import Scenario
from fivebar_control.hardware.configuration import DriveFile, load_drives
from fivebar_control.hardware.frames import FrameReader
from fivebar_control.planning.motion_queue import read_goal
from fivebar_control.planning.program import Program, read_program
from fivebar_control.trajectory.refusal import PlanRefused
from fivebar_description.interface import JOINT_STATES, JOINTS, RUN_EPOCH
from fivebar_description.joint_sample import MessageError
from fivebar_description.outside_text import read_object
from fivebar_description.robot_file import RobotFile
from fivebar_description.run_plan import epoch_text, read_epoch, read_plan
from fivebar_description.status_texts import read_goal_status, read_program_status, read_run_status
from fivebar_description.strict_yaml import (
    InputError,
    StrictModel,
    parse_versioned,
    read_text,
    read_yaml,
    validate,
)
from fivebar_live.commands import CommandRefused, read_command
from fivebar_motkin.board_file import BoardFile
from fivebar_motkin_emulation.configuration import BoardEmulationFile
from fivebar_motkin_emulation.protocol import (
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
from fivebar_studies.benchmark.scoring import RESULTS, read_results
from fivebar_studies.engine.directory import StudyFiles
from fivebar_studies.sweep.rows import FEASIBLE, ROWS
from fivebar_studies.sweep.sweep import SWEEP
from fivebar_vendor_drives.kinds import MOTKIN_BOARD
from fivebar_vision.camera_file import read_calibration

SRC = Path(__file__).parents[2] / "src"

FILES: dict[type[StrictModel], list[Path]] = {
    Scenario: sorted(SRC.glob("fivebar_description/config/scenarios/*.yaml")),
    RobotFile: sorted(SRC.glob("fivebar_description/config/*.yaml")),
    DriveFile: sorted(SRC.glob("fivebar_control/config/drives/*.yaml")),
    BoardFile: sorted(SRC.glob("fivebar_control/config/boards/*.yaml")),
    EmulationFile: sorted(SRC.glob("fivebar_sim/config/drives/*.yaml")),
    BoardEmulationFile: sorted(SRC.glob("fivebar_sim/config/boards/*.yaml")),
    Program: sorted(SRC.glob("fivebar_bringup/config/programs/*.yaml")),
}


class Parser(NamedTuple):
    """Something that reads input from outside.

    Attributes:
        read: reads bytes, with a folder of its own for files; what it neither understands nor refuses is a defect.
        refusals: the exceptions by which it refuses, each in one line.
        seeds: valid inputs.
        structured: whether an input is a JSON document, which is to be changed as such.
    """

    read: Callable[[bytes, Path], object]
    refusals: tuple[type[Exception], ...]
    seeds: tuple[bytes, ...]
    structured: bool = False


def _in_file(name: str, read: Callable[[Path], object]) -> Callable[[bytes, Path], object]:
    def write_and_read(content: bytes, folder: Path) -> object:
        path = folder / name
        path.write_bytes(content)
        return read(path)

    return write_and_read


def _as_text(read: Callable[[str], object]) -> Callable[[bytes, Path], object]:
    return lambda content, _: read(content.decode("utf-8", "replace"))


def _validated(content: bytes, _: Path, model: type[StrictModel]) -> object:
    try:
        found = json.loads(content)
    except ValueError:
        return None
    return validate(found, model, "file")


@cache
def shipped(path: Path) -> Any:
    """Return the content of a shipped file."""
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def _model_parser(model: type[StrictModel]) -> Parser:
    seeds = tuple(json.dumps(shipped(path)).encode() for path in FILES[model])
    return Parser(partial(_validated, model=model), (InputError,), seeds, structured=True)


CAMERA = """\
{image_width: 640, image_height: 480, camera_name: c, distortion_model: plumb_bob,
camera_matrix: {rows: 3, cols: 3, data: [800.0, 0.0, 320.0, 0.0, 800.0, 240.0, 0.0, 0.0, 1.0]},
distortion_coefficients: {rows: 1, cols: 5, data: [0.0, 0.0, 0.0, 0.0, 0.0]},
rectification_matrix: {rows: 1, cols: 1, data: [1.0]}, projection_matrix: {rows: 1, cols: 1, data: [1.0]}}
"""
TOUCHED = "deviation_m: 2.0e-5\npoints:\n  - {time: 0.0, x: 0.0, y: 0.15}\n  - {q11: 1.6, q21: 1.5, x: 0.0, y: 0.12}\n"
SHORT_SCENARIO = b"format: 1\nname: s\nwaypoints: [[0.0, 0.15], [0.0, 0.02]]\nsegment_duration: 1\n"
SHORT_PROGRAM = b"name: p\nsteps:\n  - move: [0.03, 0.13]\n  - repeat: 2\n    steps: [{set: pin}, {dwell: 0.2}]\n"


def _read_versioned(path: Path, model: type[StrictModel]) -> object:
    return validate(parse_versioned(read_text(path), str(path)), model, str(path))


def _yaml_parser(name: str, read: Callable[[Path], object], *seeds: bytes) -> Parser:
    return Parser(_in_file(f"{name}.yaml", read), (InputError,), seeds)


def _sweep_rows(content: bytes, folder: Path) -> object:
    directory = StudyFiles(SWEEP, folder)
    directory.rows.write_bytes(content)
    return directory.read_rows()


def _sweep_settings(content: bytes, folder: Path) -> object:
    directory = StudyFiles(SWEEP, folder)
    directory.directory.content.write_bytes(content)
    return directory.read_settings()


def _read_through(folder: Path) -> None:
    """Read a bag and what is in it."""
    bag = read_bag(folder)
    bag.field(JOINT_STATES, "position")
    bag.samples(JOINT_STATES, 500)
    bag.joint_names(JOINT_STATES)


def _small_bag() -> Mapping[str, bytes]:
    """Return the files of a bag with a message of the epoch and three of joint states."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "bag"
        with BagWriter(path, [JOINT_STATES, RUN_EPOCH]) as bag:
            bag.write(RUN_EPOCH, 0, serialize.string(epoch_text(1_000_000_000)))
            for number in range(3):
                stamp = 1_000_000_000 + number * 2_000_000
                bag.write(JOINT_STATES, stamp, serialize.joint_state(stamp, JOINTS, (0.1, 0.2, 0.3, 0.4)))
            bag.close({})
        return {file.name: file.read_bytes() for file in path.iterdir()}


def _bag_parser(damaged: str, files: Mapping[str, bytes]) -> Parser:
    def read(content: bytes, folder: Path) -> None:
        for name, whole in files.items():
            (folder / name).write_bytes(content if name == damaged else whole)
        _read_through(folder)

    return Parser(read, (InputError, BagError), (files[damaged],))


@cache
def _drives() -> DriveFile:
    return load_drives("dextar_emulated")


def _can_frame(content: bytes, _: Path) -> object:
    """Nothing is refused here: whatever comes from the bus is a frame, of a known kind or malformed."""
    reader = FrameReader(_drives().pair, 127)
    return reader.read(int.from_bytes(content[:2], "little") & 0x7FF, content[2:10])


def board_frame() -> bytes:
    """Return a valid command to the motor board."""
    frame = HEAD.pack(MAGIC, COMMAND, VERSION, COMMAND_LENGTH) + COMMAND_BODY.pack(7, 3, 20, *([0.5] * 10))
    return frame + bytes((checksum(frame),))


def _board_stream(content: bytes, _: Path) -> None:
    """Nothing is refused, and it does not matter where a stream of bytes, after four that say where, is cut."""
    cuts, stream = content[:4], content[4:]
    reader, commands, start = CommandReader(), [], 0
    for cut in (*sorted(cuts), len(stream)):
        commands += reader.read(stream[start:cut])
        start = max(start, cut)
    whole = CommandReader().read(stream)
    assert [repr(command) for command in commands] == [repr(command) for command in whole]


def _json_parser(read: Callable[[str], object], refusals: tuple[type[Exception], ...], seed: Any) -> Parser:
    return Parser(_as_text(read), refusals, (json.dumps(seed).encode(),))


def _goal(text: str) -> object:
    fields = read_object(text)
    return read_goal(list(fields), [value if isinstance(value, float) else math.nan for value in fields.values()])


_BAG = _small_bag()
_ROW = ",".join(FEASIBLE if column == "status" else "1" for column in ROWS.head.split(","))

PARSERS: Mapping[str, Parser] = {
    **{f"content-{model.__name__}": _model_parser(model) for model in FILES},
    "scenario": _yaml_parser(
        "scenario",
        partial(_read_versioned, model=Scenario),
        SHORT_SCENARIO,
        FILES[Scenario][0].read_bytes() + b"adaptive_gain: {enabled: true}\n",
    ),
    "robot": _yaml_parser("robot", partial(_read_versioned, model=RobotFile), FILES[RobotFile][1].read_bytes()),
    "drives": _yaml_parser("drives", partial(read_yaml, model=DriveFile), FILES[DriveFile][0].read_bytes()),
    "camera": _yaml_parser("camera", read_calibration, CAMERA.encode()),
    "touched": _yaml_parser("touched", partial(read_yaml, model=TouchedFile), TOUCHED.encode()),
    "program": Parser(
        _as_text(partial(read_program, source="program")),
        (InputError,),
        (SHORT_PROGRAM, FILES[Program][0].read_bytes()),
    ),
    "timing": Parser(_in_file("timing.json", read_timing), (InputError,), (b"{}",)),
    "sweep-settings": Parser(
        _sweep_settings,
        (InputError,),
        (b'{"settings": {"seed": 1, "cases": 10, "program": "a", "rig": "ideal", "controllers": ["mpc"]}}',),
    ),
    "sweep-rows": Parser(_sweep_rows, (InputError,), (f"{ROWS.head}0{_ROW[1:]}\n{_ROW}\n".encode(),)),
    "benchmark-results": Parser(
        _as_text(partial(read_results, source="results.csv")),
        (InputError,),
        (f"{RESULTS.head}0,ideal,mine,,1,0.001,0.5,0.1\n1,ideal,mine,torque_excessive,1,nan,inf,1e3\n".encode(),),
    ),
    "bag": _bag_parser("bag_0.mcap", _BAG),
    "bag-metadata": _bag_parser("metadata.yaml", _BAG),
    "page-message": Parser(
        lambda content, _: read_command(content),
        (CommandRefused,),
        (b'{"command": "plan", "x": 0.0, "y": 0.02, "assembly": -1}', b'{"command": "reset"}'),
    ),
    "plan": _json_parser(read_plan, (ValueError,), {"digest": "a", "values": {"rate_hz": 500}}),
    "run-status": _json_parser(
        read_run_status,
        (MessageError,),
        {
            **{"state": "running", "sample": 7, "samples": 50, "overruns": 0, "pid": 4711},
            "latency_ms": {"p50": 0.5, "p99": 1.25, "max": 2.0},
        },
    ),
    "program-status": _json_parser(
        read_program_status,
        (MessageError,),
        {
            **{"state": "running", "program": "p", "step": "2.1", "line": 5, "rounds": [["2", 1]], "done": 2, "of": 4},
            **{"action": {"Move": {"x": 0.0, "y": 0.1}}, "reason": "ended", "pid": 4711},
        },
    ),
    "goal-status": _json_parser(
        read_goal_status,
        (MessageError,),
        {
            **{"state": "moving", "goal": [0.0, None], "id": "a", "first_sample": 7, "last_sample": 90, "reason": "r"},
            **{"waypoints": [[0.0, 0.1], [0.0, 0.2]], "durations_s": [0.5], "time_law": "optimal", "payload_kg": 0.1},
            "blend_radius": [0.01],
        },
    ),
    "goal": _json_parser(_goal, (PlanRefused, MessageError), {"x": 0.0, "y": 0.1, "via1_x": 0.02, "via1_y": 0.11}),
    "epoch": _json_parser(read_epoch, (ValueError,), {"epoch_ns": 1_000_000_000}),
    "injection": Parser(
        _as_text(partial(read_injection, kind=CANOPEN_DRIVES)),
        (InputError,),
        (b"0.3 fault 1", b"1.2 late 2 30", b"0.5 kill blender"),
    ),
    "injection-board": Parser(
        _as_text(partial(read_injection, kind=MOTKIN_BOARD)), (InputError,), (b"0.3 fault 1", b"0.3 button press")
    ),
    "can-frame": Parser(_can_frame, (), (b"\x81\x01\x37\x02\x00\x00\x00\x00", b"\x01\x07\x05")),
    "board-stream": Parser(_board_stream, (), (b"\x09\x20\x40\x60" + 3 * board_frame(),)),
}
"""All parsers of input from outside, by name."""
