"""Every file that is read is either understood or refused in one line; never a traceback, whatever is in it.

FUZZ_EXAMPLES is the number of inputs for each parser, a few by default.
"""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fivebar_bringup.live.commands import FIELDS, CommandRefused, read_command
from fivebar_bringup.report.timing import read_timing
from fivebar_bringup.runs.bag.reader import read_bag
from fivebar_bringup.runs.bag.recording import BagError
from fivebar_bringup.scenario import Scenario
from fivebar_control.hardware.board_file import BoardFile
from fivebar_control.hardware.configuration import DriveFile
from fivebar_description.parameters import RobotFile
from fivebar_description.strict_yaml import InputError, StrictModel, read_yaml, validate

SRC = Path(__file__).parents[2] / "src"
FUZZED = settings(
    max_examples=int(os.environ.get("FUZZ_EXAMPLES", "15")),
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)

FILES: dict[type[StrictModel], list[Path]] = {
    Scenario: sorted(SRC.glob("fivebar_bringup/config/scenarios/*.yaml")),
    RobotFile: sorted(SRC.glob("fivebar_description/config/*.yaml")),
    DriveFile: sorted(SRC.glob("fivebar_control/config/drives/*.yaml")),
    BoardFile: sorted(SRC.glob("fivebar_control/config/boards/*.yaml")),
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


def expect_understood_or_refused(read: Callable[[], object]) -> None:
    try:
        read()
    except (InputError, BagError, CommandRefused) as refusal:
        assert "\n" not in str(refusal)
        assert str(refusal)


@pytest.mark.parametrize("model", FILES, ids=lambda model: model.__name__)
def test_a_changed_file(model: type[StrictModel]) -> None:
    @FUZZED
    @given(changed(model))
    def check(content: Any) -> None:
        expect_understood_or_refused(lambda: validate(content, model, "file"))

    check()


def fuzz_files(name: str, tmp_path: Path, read: Callable[[Path], object], beginning: bytes = b"") -> None:
    path = tmp_path / name

    @FUZZED
    @given(st.one_of(st.binary(max_size=200), st.text(max_size=100).map(lambda text: text.encode("utf-8", "replace"))))
    def check(content: bytes) -> None:
        path.write_bytes(beginning + content)
        expect_understood_or_refused(lambda: read(path))

    check()


def test_bytes_instead_of_yaml(tmp_path: Path) -> None:
    fuzz_files("robot.yaml", tmp_path, lambda path: read_yaml(path, RobotFile), b"name: any\n")


def test_bytes_instead_of_json(tmp_path: Path) -> None:
    fuzz_files("timing.json", tmp_path, read_timing)


def test_bytes_instead_of_a_bag(tmp_path: Path) -> None:
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information: {version: 5}\n", encoding="utf-8")
    fuzz_files("bag_0.mcap", tmp_path, lambda path: read_bag(path.parent), b"\x89MCAP0\r\n")


def test_messages_of_a_page() -> None:
    keys = st.sampled_from(["command", "x", "y", "assembly", "torque"])
    values = st.one_of(VALUES, st.sampled_from(sorted(FIELDS)))

    @FUZZED
    @given(st.one_of(st.dictionaries(keys, values).map(json.dumps), st.text(max_size=50), st.binary(max_size=50)))
    def check(message: str | bytes) -> None:
        expect_understood_or_refused(lambda: read_command(message))

    check()
