"""Functions of whole motions, as machine code in processes that judge many motions.

Machine code takes a second to load, ten to make the first time, and a single motion is judged in a fifth of a second
without it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, TypeVar, cast

F = TypeVar("F", bound=Callable[..., Any])

_many = False


def expect_many_motions() -> None:
    """Have this process judge motions by machine code from now on."""
    global _many
    _many = True


def as_machine_code(function: F) -> F:
    """Return a module's plain function as machine code, which is kept on disk; itself where few motions are expected.

    The results are the same, but for the last digits where matrix products come from another library.
    """
    return cast(F, _compiled(function)) if _many else function


@cache
def _compiled(function: Callable[..., Any]) -> Any:
    # numba takes half a second to import
    from fivebar_control.compiling import compiled_and_kept

    return compiled_and_kept(function)
