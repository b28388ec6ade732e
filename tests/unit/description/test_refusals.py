# SPDX-License-Identifier: Apache-2.0
"""What pydantic refuses is said in plain words: key, value, and what was expected."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import pytest
from pydantic import Field

from fivebar_description.strict_yaml import InputError, StrictModel, validate

Numbers = Annotated[tuple[float, ...], Field(strict=False)]


class Part(StrictModel):
    size: Annotated[float, Field(ge=1.0, lt=2.0)] = 1.0


class Sample(StrictModel):
    number: float = 0.0
    count: Annotated[int, Field(gt=-1)] = 0
    flag: bool = False
    word: Annotated[str, Field(min_length=1, max_length=5, pattern="^[a-z]*$")] = "a"
    either: Annotated[float, Field(ge=0.5)] | Numbers = 1.0
    kind: Literal["a", "b"] = "a"
    parts: Annotated[tuple[Part, ...], Field(strict=False, max_length=2)] = ()
    table: dict[str, Any] = Field(default_factory=dict)
    pair: Annotated[tuple[float, float], Field(strict=False)] = (0.0, 0.0)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"number": "x"}, "number: 'x': expected a number"),
        ({"number": "1,5"}, "number: '1,5': expected a number, with a point in place of the comma"),
        ({"number": float("nan")}, "number: nan: expected a finite number"),
        ({"number": [1.0]}, "number: [1.0]: expected a number"),
        ({"count": 1.5}, "count: 1.5: expected a whole number"),
        ({"count": -1}, "count: -1: expected above -1"),
        ({"count": "3"}, "count: '3': expected a whole number"),
        ({"flag": 1}, "flag: 1: expected true or false"),
        ({"word": 5}, "word: 5: expected text"),
        ({"word": ""}, "word: '': expected at least 1 character"),
        ({"word": "abcdef"}, "word: 'abcdef': expected at most 5 characters"),
        ({"word": "A"}, "word: 'A': expected text that matches ^[a-z]*$"),
        ({"either": "x"}, "either: 'x': expected a number or a list"),
        ({"either": "1,5"}, "either: '1,5': expected a number or a list, with a point in place of the comma"),
        ({"either": 0.1}, "either: 0.1: expected at least 0.5"),
        ({"either": [1.0, "x"]}, "either.1: 'x': expected a number"),
        ({"kind": "c"}, "kind: 'c': expected 'a' or 'b'"),
        ({"parts": [{"size": 2.0}]}, "parts.0.size: 2.0: expected below 2"),
        ({"parts": [{"size": 1.0, "colour": 1}]}, "parts.0.colour: unknown key"),
        ({"parts": [3]}, "parts.0: 3: expected keys with values"),
        ({"parts": [{}, {}, {}]}, "parts: [{}, {}, {}]: expected at most 2 items, found 3"),
        ({"table": 3}, "table: 3: expected keys with values"),
        ({"pair": [1.0]}, "pair.1: is missing"),
        ({"colour": 1}, "colour: unknown key"),
        ({"number": 10**400}, "number: 1"),
    ],
)
def test_a_refusal_is_in_plain_words(content: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as refused:
        validate(content, Sample, "file")
    assert str(refused.value).startswith(f"file: {words}")
    assert "nput should" not in str(refused.value)
    if not words.endswith("1"):
        assert str(refused.value) == f"file: {words}"
