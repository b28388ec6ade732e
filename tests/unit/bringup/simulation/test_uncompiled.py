# SPDX-License-Identifier: Apache-2.0
"""Laws that numba cannot compile are run by the loop of the engine, interpreted, with what the offline runner finds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from engine_agreement import changed, expect_agreement, prepared
from numba import njit
from numba.core.errors import TypingError

from fivebar_bringup.simulation import engine
from fivebar_bringup.simulation.engine import traced_crossing
from fivebar_control.compiling import is_of_compiler

SAYS_NOTHING = "toy_law:UNCOMPILED"
"""A law from elsewhere that numba cannot compile, and that does not say so."""


@pytest.fixture
def refusals(monkeypatch: pytest.MonkeyPatch) -> list[Exception]:
    """What compiled loops raise from now on; no law has been tried before."""
    raised: list[Exception] = []
    compiled_loop = engine._loop

    def watched(*of_robot: Any, **of_laws: Any) -> Any:
        def run(*of_run: Any) -> Any:
            try:
                return compiled_loop(*of_robot, **of_laws)(*of_run)
            except Exception as error:
                raised.append(error)
                raise

        return run

    monkeypatch.setattr(engine, "_loop", watched)
    monkeypatch.setattr(engine, "_refused", set())
    return raised


def refuse(monkeypatch: pytest.MonkeyPatch, refusals: list[Exception], error: Exception) -> None:
    """Have the engine compile nothing, which takes seconds, and raise an error instead."""

    def loop(*_: Any, **of_laws: Any) -> Any:
        refusals.append(error)
        raise error

    monkeypatch.setattr(engine, "_loop", loop)


def expect_interpreted_twice() -> None:
    scenario = changed("middle", {"mass_scale": 1.1}, controller=SAYS_NOTHING, segment_duration=0.25)
    for _ in range(2):
        run, outcome = expect_agreement(scenario)
        assert (outcome.samples, run.faults) == (251, [])


@pytest.mark.extra
def test_a_law_from_elsewhere_that_the_compiler_refuses_is_tried_once_and_interpreted(
    refusals: list[Exception], monkeypatch: pytest.MonkeyPatch
) -> None:
    refuse(monkeypatch, refusals, TypingError("a list of tuples has no largest one"))
    expect_interpreted_twice()
    assert len(refusals) == 1


@pytest.mark.extra
def test_the_compiler_refuses_a_law_that_does_not_say_so(refusals: list[Exception]) -> None:
    expect_interpreted_twice()
    assert [type(error) for error in refusals] == [TypingError]


def importing(number: float) -> float:
    import json

    return float(json.dumps(number))


def sorting(number: float) -> float:
    return max([number], key=str)


@pytest.mark.parametrize("function", [importing, sorting])
def test_the_errors_of_the_compiler_are_known(function: Callable[[float], float]) -> None:
    with pytest.raises(Exception) as refused:
        njit(function)(1.0)
    assert is_of_compiler(refused.value)


@pytest.mark.parametrize(
    ("controller", "error"), [("unified", TypingError("a slip of this package")), (SAYS_NOTHING, MemoryError())]
)
def test_no_other_error_of_the_engine_is_passed_over(
    controller: str, error: Exception, refusals: list[Exception], monkeypatch: pytest.MonkeyPatch
) -> None:
    refuse(monkeypatch, refusals, error)
    with pytest.raises(type(error)):
        traced_crossing(*prepared(changed("middle", controller=controller, segment_duration=0.25)))
    assert refusals == [error]
