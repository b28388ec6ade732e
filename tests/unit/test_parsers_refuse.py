# SPDX-License-Identifier: Apache-2.0
"""Every input from outside is either understood or refused in one line; never a traceback, whatever is in it.

A few inputs for each parser, which hypothesis makes up; `make fuzz` tries many more.
"""

from __future__ import annotations

import copy
import functools
import json
import re
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from fuzzing import FUZZED, spliced, understand_or_refuse
from hypothesis import given
from hypothesis import strategies as st
from parsers import FILES, PARSERS, board_frame, shipped

from fivebar_description.outside_text import DEEPEST, LONGEST_TEXT
from fivebar_description.strict_yaml import StrictModel
from fivebar_live.commands import MODELS
from fivebar_motkin_emulation.protocol import MAGIC

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
BYTES = st.one_of(
    st.just(b"[" * 9999),
    st.binary(max_size=200),
    st.text(max_size=100).map(lambda text: text.encode("utf-8", "replace")),
)
# YAML's own characters, and what YAML 1.1 and 1.2 read differently
MARKS = [
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
SCALARS = [
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
NESTED = {"a": functools.reduce(lambda inner, _: [inner], range(DEEPEST), 0)}
"""An object that is nested one time too often."""

TOKENS = st.one_of(st.sampled_from(MARKS), st.sampled_from(SCALARS), st.binary(max_size=4))


def places(content: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the paths of everything inside of a content."""
    inner = content.items() if isinstance(content, dict) else enumerate(content) if isinstance(content, list) else ()
    return [path for key, value in inner for path in ((*at, key), *places(value, (*at, key)))]


@st.composite
def changed(draw: st.DrawFn, model: type[StrictModel]) -> bytes:
    """A shipped file with some of it replaced, removed, or with a key too many, as JSON."""
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
    return json.dumps(content).encode()


def check(name: str, folder: Path, inputs: st.SearchStrategy[bytes]) -> None:
    """Let a parser read inputs."""

    @FUZZED
    @given(inputs)
    def each(content: bytes) -> None:
        understand_or_refuse(PARSERS[name], content, folder)

    each()


@pytest.mark.parametrize("name", PARSERS)
def test_the_inputs_that_others_are_made_of_are_understood(name: str, tmp_path: Path) -> None:
    assert all(understand_or_refuse(PARSERS[name], seed, tmp_path) for seed in PARSERS[name].seeds)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("touched", b"points:\n? - {time: 0.0}\n"),
        ("content-Scenario", b'{"name": "s", "waypoints": [], "working_modes": []}'),
        ("bag-metadata", re.sub(rb"message_count: \d+", b"message_count: ?3", PARSERS["bag-metadata"].seeds[0])),
    ],
)
def test_what_was_neither_understood_nor_refused_once_is_refused(name: str, content: bytes, tmp_path: Path) -> None:
    assert not understand_or_refuse(PARSERS[name], content, tmp_path)


@pytest.mark.parametrize("model", FILES, ids=lambda model: model.__name__)
def test_a_changed_file(model: type[StrictModel], tmp_path: Path) -> None:
    check(f"content-{model.__name__}", tmp_path, changed(model))


@pytest.mark.parametrize(
    "name",
    [
        "scenario",
        "robot",
        "drives",
        "camera",
        "touched",
        "program",
        "sweep-settings",
        "sweep-rows",
        "benchmark-results",
        "bag-metadata",
    ],
)
def test_a_spliced_text(name: str, tmp_path: Path) -> None:
    check(name, tmp_path, spliced(PARSERS[name].seeds[-1], TOKENS))


@pytest.mark.parametrize(
    ("name", "beginning"), [("robot", b"name: any\n"), ("timing", b""), ("bag", b"\x89MCAP0\r\n"), ("program", b"")]
)
def test_bytes_instead_of_a_file(name: str, beginning: bytes, tmp_path: Path) -> None:
    check(name, tmp_path, BYTES.map(beginning.__add__))


def test_a_damaged_bag(tmp_path: Path) -> None:
    check("bag", tmp_path, spliced(PARSERS["bag"].seeds[0], st.binary(max_size=8)))


def test_messages_of_a_page(tmp_path: Path) -> None:
    keys = st.sampled_from(["command", "x", "y", "assembly", "torque"])
    values = st.one_of(VALUES, st.sampled_from(sorted(MODELS)))
    check("page-message", tmp_path, st.one_of(as_json(st.dictionaries(keys, values)), st.binary(max_size=50)))


def as_json(contents: st.SearchStrategy[Any]) -> st.SearchStrategy[bytes]:
    return contents.map(json.dumps).map(str.encode)


@pytest.mark.parametrize("name", ["plan", "epoch", "run-status", "program-status", "goal-status", "goal"])
def test_what_nodes_tell_each_other(name: str, tmp_path: Path) -> None:
    seed = json.loads(PARSERS[name].seeds[0])
    changes = st.dictionaries(st.sampled_from(sorted(seed)), VALUES, max_size=3)
    check(name, tmp_path, st.one_of(as_json(VALUES), as_json(changes.map(lambda given: {**seed, **given})), BYTES))


@pytest.mark.parametrize("name", ["plan", "epoch", "run-status", "program-status", "goal-status", "page-message"])
@pytest.mark.parametrize(
    "text",
    [
        "x",
        "[]",
        "null",
        "[" * 5000,
        '{"values": ' * 5000,
        json.dumps({"sample": 5}),
        json.dumps({"sample": "x", "samples": 1}),
        json.dumps({"state": "off", "sample": True, "samples": 1e400}),
        '{"digest": "", "values": {}, "state": "stopped", "reason": "\\ud800", "epoch_ns": null}',
        json.dumps({"state": "arrived", "more": " " * LONGEST_TEXT, "digest": "", "values": {}, "epoch_ns": None}),
        json.dumps({"state": "arrived", "digest": "", "epoch_ns": None, "values": NESTED}),
    ],
    ids=lambda text: text[:20],
)
def test_texts_beyond_the_limits_are_refused(name: str, text: str, tmp_path: Path) -> None:
    assert not understand_or_refuse(PARSERS[name], text.encode(), tmp_path)


@pytest.mark.parametrize("name", ["injection", "injection-board"])
def test_injected_faults(name: str, tmp_path: Path) -> None:
    words = st.sampled_from(
        ["0.3", "1e3", "nan", "fault", "late", "kill", "drop", "button", "press", "1", "2", "9", "blender", "²", "٣"]
    )
    check(name, tmp_path, st.lists(st.one_of(words, st.text(max_size=5)), max_size=5).map(" ".join).map(str.encode))


def test_can_frames(tmp_path: Path) -> None:
    known = [0x81, 0x82, 0x181, 0x182, 0x281, 0x282, 0x581, 0x582, 0x701, 0x702]
    identifiers = st.one_of(st.integers(0, 0x7FF), st.sampled_from(known)).map(
        partial(int.to_bytes, length=2, byteorder="little")
    )
    check("can-frame", tmp_path, st.builds(bytes.__add__, identifiers, st.binary(max_size=8)))


def test_frames_of_the_board_in_pieces(tmp_path: Path) -> None:
    frame = board_frame()
    streams = spliced(frame * 3, st.sampled_from([MAGIC, frame[:9], b"\xff" * 4]))
    check("board-stream", tmp_path, st.builds(bytes.__add__, st.binary(min_size=4, max_size=4), streams))
