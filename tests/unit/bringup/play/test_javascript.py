# SPDX-License-Identifier: Apache-2.0
"""The translation into JavaScript: what it says, and that it refuses whatever it does not know."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import pytest

from fivebar_control.compiling import bound
from fivebar_play.javascript import Translation, Untranslatable


class Pair(NamedTuple):
    """Two numbers."""

    new: float
    other: float = math.inf

    def total(self) -> float:
        """Return their sum."""
        return self.new + self.other


def half(x: float) -> float:
    return 0.5 * x


def third(x: float) -> float:
    return x / 3.0


def summed(pair: Pair, half: float = 2.0) -> float:
    """Return a sum."""
    delete, rest = pair
    for number in range(3):
        rest += number % 2
    return pair.total() if delete <= rest < 1.0 else math.sin(half)


def calls(x: float) -> Pair:
    return Pair(other=half(x), new=1.0)


def test_a_function_is_translated_with_all_that_it_needs() -> None:
    text = Translation().text({"calls": bound(calls, half=third), "summed": summed, "pair": Pair(1.0)})
    assert "return (x / 3.0);" in text
    assert "0.5" not in text
    assert "return new Pair$1(1.0, third$1(x));" in text
    assert "constructor(new, other = Infinity)" not in text
    assert "total() {" in text
    assert "pair: new Pair$1(1.0, Infinity)" in text
    # a word of JavaScript is no name there, and % is Python's
    assert "[delete$, rest] = pair;" in text
    assert "rest = (rest + $mod(number, 2));" in text
    assert "((delete$ <= rest && rest < 1.0) ? pair.total() : Math.sin(half))" in text


def comprehends(x: float) -> list[float]:
    return [x for _ in range(3)]


def replaces(pair: Pair) -> Pair:
    return pair._replace(new=1.0)


def formats(x: float) -> str:
    return f"{x}"


def chooses(x: float, y: float) -> float:
    return x or y


def shifts(x: int) -> int:
    return x >> 2


def slices(pair: Pair) -> tuple[float, ...]:
    return pair[:1]


def sorts(pair: Pair) -> list[float]:
    return sorted(pair)


def loops(x: float) -> float:
    while x > 0.0:
        x -= 1.0
    else:
        x = 1.0
    return x


def tries(x: float) -> float:
    try:
        return 1.0 / x
    except ZeroDivisionError:
        return math.inf


def chained(x: float) -> bool:
    return 0.0 < half(x) < 1.0


def keyed(pair: Pair) -> float:
    return max(pair, key=abs)


def decorated(x: float) -> float:
    return counted(x)


def of_a_module(x: float) -> float:
    return x * math.prod


def closing(x: float) -> Callable[[], float]:
    def inner() -> float:
        return x

    return inner


def misspelt(pair: Pair) -> float:
    return pair.mew  # type: ignore[attr-defined, no-any-return]


counted = pytest.mark.extra


REFUSED = (
    *(comprehends, replaces, formats, chooses, shifts, slices, sorts, loops, tries, chained, keyed, decorated),
    *(of_a_module, closing, closing(1.0), misspelt),
)


@pytest.mark.parametrize("function", REFUSED, ids=lambda one: str(one.__qualname__))
def test_what_is_not_known_is_refused(function: Callable[..., Any]) -> None:
    with pytest.raises(Untranslatable):
        Translation().text({"one": function, "pair": Pair(1.0)})


def test_a_refusal_says_where() -> None:
    with pytest.raises(Untranslatable, match=r"test_javascript\.py:\d+: shifts: the operator RShift is not translated"):
        Translation().text({"one": shifts})


def test_what_is_never_called_raises() -> None:
    text = Translation(without=[shifts]).text({"one": shifts})
    assert 'function shifts$1() { $raise("not translated: shifts$1"); }' in text
