"""Compiles plain scalar functions as they stand, together with everything that they call."""

from __future__ import annotations

import hashlib
import marshal
from collections.abc import Callable, Iterator
from types import CodeType, FunctionType
from typing import Any

import numba

_compiled: dict[FunctionType, Any] = {}


def compiled(function: Callable[..., Any]) -> Any:
    """Return a function compiled by numba, as are all plain functions that it calls, wherever they are defined.

    A copy of the function sees compiled functions under the names of plain ones; the original stays what it is. So
    one source serves both worlds, as long as it keeps to what numba can compile.

    Raises:
        TypeError: the function is not a plain module-level function.
    """
    plain = _plain(function)
    if plain not in _compiled:
        _compiled[plain] = _machine_code(_rebound(plain), keep=False)
    return _compiled[plain]


def compiled_and_kept(function: Callable[..., Any], **bound: Callable[..., Any]) -> Any:
    """Return the same, with its machine code kept on disk between processes.

    `bound` are functions that take the place of the ones which the function knows under these names.

    numba looks at the age of one source file only; the copy's name holds a digest of all code and constants that go
    into it, so that a change of any function down the line is a new name. The code is kept beside the source, or in
    the user's cache directory where the installation cannot be written.
    """
    plain = _with_names(_plain(function), {name: _plain(one) for name, one in bound.items()})
    copy = _rebound(plain)
    copy.__qualname__ = f"{plain.__qualname__}_{digest(plain)}"
    return _machine_code(copy, keep=True)


def digest(function: Callable[..., Any]) -> str:
    """Return a digest of a plain function's code and constants and of those of all functions that it calls."""
    total = hashlib.sha256()
    for part in _ingredients(_plain(function), set()):
        total.update(part)
    return total.hexdigest()[:16]


def _machine_code(function: FunctionType, keep: bool) -> Any:
    """Return a dispatcher of numba.

    Division by zero gives infinity or NaN, as the equations expect; sums keep their order, so that results are those of
    the plain functions; everything is put into one function, which makes the loop a third faster; the interpreter's
    lock is not held, so that threads run side by side.
    """
    return numba.njit(error_model="numpy", fastmath=False, forceinline=True, nogil=True, cache=keep)(function)


def _plain(function: Callable[..., Any]) -> FunctionType:
    if not isinstance(function, FunctionType) or function.__closure__ is not None:
        raise TypeError(f"{function!r}: expected a plain function without a closure")
    return function


def _with_names(function: FunctionType, names: dict[str, FunctionType]) -> FunctionType:
    """Return a copy of a function that sees other functions under some names of its module."""
    copy = FunctionType(function.__code__, {**function.__globals__, **names}, function.__name__)
    copy.__defaults__, copy.__kwdefaults__ = function.__defaults__, function.__kwdefaults__
    copy.__module__, copy.__qualname__ = function.__module__, function.__qualname__
    return copy


def _rebound(function: FunctionType) -> FunctionType:
    callees = {name: compiled(value) for name, value in _globals_of(function) if isinstance(value, FunctionType)}
    return _with_names(function, callees)


def _globals_of(function: FunctionType) -> Iterator[tuple[str, Any]]:
    for name in sorted(_names(function.__code__)):
        if name in function.__globals__:
            yield name, function.__globals__[name]


def _names(code: CodeType) -> set[str]:
    inner = [_names(constant) for constant in code.co_consts if isinstance(constant, CodeType)]
    return set(code.co_names).union(*inner)


def _ingredients(function: FunctionType, seen: set[FunctionType]) -> Iterator[bytes]:
    if function in seen:
        return
    seen.add(function)
    yield marshal.dumps(function.__code__)
    yield repr(function.__defaults__).encode()
    for name, value in _globals_of(function):
        if isinstance(value, FunctionType):
            yield from _ingredients(value, seen)
        elif isinstance(value, type):
            yield f"{name} {getattr(value, '_fields', '')}".encode()
        else:
            yield f"{name} {value!r}".encode()
