"""docs/theory.md names functions and tests; all of them exist, and every slip has the test that decides it."""

from __future__ import annotations

import ast
import importlib
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "theory.md").read_text(encoding="utf-8")
SLIP_TESTS = "tests/unit/control/slips"

FUNCTIONS = sorted(set(re.findall(r"`(fivebar_\w+(?:\.\w+)+)(?:\(\))?`", TEXT)))
TESTS = sorted(set(re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", TEXT)))
FILES = sorted(set(re.findall(r"`(tests/[\w/]+\.py)`", TEXT)))
SLIPS = re.findall(r"^\| (S\d+) \|(.*)\|$", TEXT, flags=re.MULTILINE)


@cache
def names_of_tests(path: Path) -> frozenset[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return frozenset(
        node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    )


def resolve(name: str) -> object:
    """Import the longest part of a dotted name that is a module, and look the rest up in it."""
    parts = name.split(".")
    for length in range(len(parts), 0, -1):
        module = ".".join(parts[:length])
        try:
            found: object = importlib.import_module(module)
        except ModuleNotFoundError as missing:
            if missing.name is None or not module.startswith(missing.name):
                raise
            continue
        for attribute in parts[length:]:
            found = getattr(found, attribute)
        return found
    raise ModuleNotFoundError(name)


def test_there_is_something_to_check() -> None:
    assert len(FUNCTIONS) > 30
    assert len(TESTS) > 60
    assert len(SLIPS) > 30


@pytest.mark.parametrize("name", FUNCTIONS)
def test_named_functions_exist(name: str) -> None:
    resolve(name)


@pytest.mark.parametrize(("file", "test"), TESTS)
def test_named_tests_exist(file: str, test: str) -> None:
    assert test in names_of_tests(ROOT / file)


@pytest.mark.parametrize("file", FILES)
def test_named_test_files_exist(file: str) -> None:
    assert (ROOT / file).is_file()


def test_slips_are_counted_without_a_gap() -> None:
    assert [number for number, _ in SLIPS] == [f"S{index}" for index in range(1, len(SLIPS) + 1)]


@pytest.mark.parametrize(("number", "row"), SLIPS)
def test_every_slip_names_the_test_that_decides_it(number: str, row: str) -> None:
    assert re.search(r"`tests/[\w/]+\.py::test_\w+`", row), number


def test_every_test_of_a_slip_is_named() -> None:
    named = set(TESTS)
    for path in sorted((ROOT / SLIP_TESTS).glob("test_*.py")):
        for test in names_of_tests(path):
            assert (str(path.relative_to(ROOT)), test) in named, test


def test_dollar_signs_come_in_pairs() -> None:
    """An open formula swallows the text after it."""
    for paragraph in re.sub(r"```.*?```", "", TEXT, flags=re.DOTALL).split("\n\n"):
        assert paragraph.count("$$") % 2 == 0, paragraph
        assert paragraph.replace("$$", "").count("$") % 2 == 0, paragraph
