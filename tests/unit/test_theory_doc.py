# SPDX-License-Identifier: Apache-2.0
"""Theory and its equations name functions and tests; all of them exist, and every slip has the test that decides it."""

from __future__ import annotations

import ast
import csv
import importlib
import re
from functools import cache
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
PAGES = ("theory.md", "bounds.md", "slips.md")
with (ROOT / "docs" / "equations.csv").open(encoding="utf-8", newline="") as file:
    EQUATIONS = [*csv.DictReader(file)]
with (ROOT / "docs" / "slips.csv").open(encoding="utf-8", newline="") as file:
    SLIPS = [*csv.DictReader(file)]
TEXT = "\n\n".join(
    [
        *((ROOT / "docs" / name).read_text(encoding="utf-8") for name in PAGES),
        *(f"`{name}`" for row in EQUATIONS for name in f"{row['function']}, {row['test']}".split(", ")),
        *(f"`{name}`" for row in SLIPS for name in row["test"].split(", ")),
        *(text for row in SLIPS for text in row.values()),
    ]
)
SLIP_TESTS = "tests/unit/control/slips"

FUNCTIONS = sorted(set(re.findall(r"`(fivebar_\w+(?:\.\w+)+)(?:\(\))?`", TEXT)))
STUDIED = sorted(set(re.findall(r"`docs/studies/(\w+)\.py::(\w+)`", TEXT)))
TESTS = sorted(set(re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", TEXT)))
FILES = sorted(set(re.findall(r"`(tests/[\w/]+\.py)`", TEXT)))


@cache
def names_of_tests(path: Path) -> frozenset[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return frozenset(
        node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    )


def resolves(name: str) -> bool:
    """Import the longest part of a dotted name that is a module, and look the rest up in it."""
    parts = name.split(".")
    for length in range(len(parts), 0, -1):
        module = ".".join(parts[:length])
        try:
            found: Any = importlib.import_module(module)
        except ModuleNotFoundError as missing:
            if missing.name is None or not module.startswith(missing.name):
                raise
            continue
        for attribute in parts[length:]:
            found = getattr(found, attribute, None)
        return found is not None
    return False


def test_there_is_something_to_check() -> None:
    assert len(FUNCTIONS) > 30
    assert len(TESTS) > 60
    assert len(SLIPS) > 30


def test_named_functions_exist() -> None:
    assert not [name for name in FUNCTIONS if not resolves(name)]
    assert STUDIED
    assert not [name for name in map(".".join, STUDIED) if not resolves(name)]


def test_named_tests_exist() -> None:
    assert not [file for file in FILES if not (ROOT / file).is_file()]
    assert not [(file, test) for file, test in TESTS if test not in names_of_tests(ROOT / file)]


def test_slips_are_counted_without_a_gap() -> None:
    assert [row["slip"] for row in SLIPS] == [f"S{index}" for index in range(1, len(SLIPS) + 1)]


def test_every_slip_names_the_test_that_decides_it() -> None:
    assert not [row["slip"] for row in SLIPS if not re.match(r"tests/[\w/]+\.py::test_\w+", row["test"])]


def test_every_test_of_a_slip_is_named() -> None:
    there = {
        (str(path.relative_to(ROOT)), test)
        for path in (ROOT / SLIP_TESTS).glob("test_*.py")
        for test in names_of_tests(path)
    }
    assert there
    assert not there - set(TESTS)


def test_dollar_signs_come_in_pairs() -> None:
    """An open formula swallows the text after it."""
    for paragraph in re.sub(r"```.*?```", "", TEXT, flags=re.DOTALL).split("\n\n"):
        assert paragraph.count("$$") % 2 == 0, paragraph
        assert paragraph.replace("$$", "").count("$") % 2 == 0, paragraph
