# SPDX-License-Identifier: Apache-2.0
"""Compiles plain scalar functions without changing them, together with all functions that they call.

Machine code takes a second to load, ten to make the first time, and a single motion is judged in a fifth of a second
without it: functions of whole motions are compiled only where many motions are judged.
"""

from __future__ import annotations

import fcntl
import glob
import hashlib
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any, TypeVar, cast, get_type_hints

from fivebar_control.private_folder import writable_by_others
from fivebar_description.errors import printable
from fivebar_description.stages import COMPILING, stage

F = TypeVar("F", bound=Callable[..., Any])

DIGEST = re.compile(r"[0-9a-f]{16}")

_kept_by_themselves: set[FunctionType] = set()
_compiled: dict[FunctionType, Any] = {}
_callees: dict[FunctionType, Any] = {}

_many_motions = False


def expect_many_motions() -> None:
    """Have this process judge motions by machine code from now on."""
    global _many_motions
    _many_motions = True


def kept_by_itself(function: Callable[..., Any]) -> None:
    """Have the machine code of a function kept on disk by itself, so that all kept functions that call it share it.

    It is worth its files for what takes seconds, as long as its types are the same for all callers.
    """
    _kept_by_themselves.add(_plain(function))


def compiled(function: Callable[..., Any]) -> Any:
    """Return a function compiled by numba, as are all plain functions that it calls, wherever they are defined.

    A copy of the function sees compiled functions under the names of plain ones; the original stays what it is. So
    one source serves both worlds, as long as it keeps to what numba can compile.

    Raises:
        TypeError: the function is not a plain module-level function.
    """
    plain = _plain(function)
    if plain not in _compiled:
        _compiled[plain] = _machine_code(_rebound(plain))
    return _compiled[plain]


def _callee(function: FunctionType) -> Any:
    """Return a function compiled for compiled callers only; wrappers for Python would double the compilation time."""
    if function not in _callees:
        wrappers = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        if function in _kept_by_themselves:
            _callees[function] = _kept_code(function, function.__qualname__, **wrappers)
        else:
            # with numba, which most processes do not load
            from fivebar_control.compiled_parts import PartCompiler

            _callees[function] = _machine_code(_rebound(function), pipeline_class=PartCompiler, **wrappers)
    return _callees[function]


def compiled_and_kept(function: Callable[..., Any], **bound: Callable[..., Any]) -> Any:
    """Return the same, with its machine code kept on disk between processes.

    `bound` are functions that take the place of the ones which the function knows under these names.

    numba looks at the age of one source file only; the copy's name holds a digest of all code and constants that go
    into it, so that a change of any function down the line is a new name. The code is kept beside the source, or in
    the user's cache directory where the installation cannot be written; that of older digests is removed.
    """
    plain = _with_names(_plain(function), {name: _plain(replacement) for name, replacement in bound.items()})
    name = "_".join([plain.__qualname__, *(replacement.__name__ for replacement in bound.values())])
    return _kept_code(plain, name)


_kept = cache(compiled_and_kept)


def as_machine_code(function: F) -> F:
    """Return a module's plain function as machine code, which is kept on disk; itself where few motions are expected.

    The results are the same, but for the last digits where matrix products come from another library.
    """
    return cast(F, _kept(function)) if _many_motions else function


def _kept_code(function: FunctionType, name: str, **options: Any) -> Any:
    """Return a dispatcher that keeps its machine code on disk under a name, and remove that of older digests.

    Loaded machine code is run: where others could have written it, nothing is kept nor loaded.
    """
    copy = _rebound(function)
    copy.__qualname__ = f"{name}_{digest(function)}"
    kept = _machine_code(copy, cache=True, **options)
    folder, module = Path(kept.stats.cache_path), Path(function.__code__.co_filename).stem
    folder.mkdir(parents=True, exist_ok=True)
    open_to_others = writable_by_others(
        folder, folder.glob(f"{glob.escape(f'{module}.{name}')}_*.nb[ci]"), _owners(function)
    )
    if open_to_others is not None:
        _tell_once(open_to_others)
        return _machine_code(copy, **options)
    _remove_outdated(folder, module, name, copy)
    kept.compile = _one_at_a_time(kept.compile, folder / f"{module}.{name}.lock")
    return kept


def _owners(function: FunctionType) -> tuple[int, ...]:
    """Return who owns the source of a function, whose code runs in any case."""
    try:
        return (Path(function.__code__.co_filename).stat().st_uid,)
    except OSError:
        return ()


@cache
def _tell_once(place: Path) -> None:
    words = "others can write to it, so no machine code is kept there, and every start compiles anew"
    advice = "expected a folder of your own, such as NUMBA_CACHE_DIR=~/.cache/fivebar/numba"
    print(f"fivebar: {printable(str(place))}: {words}: {advice}", file=sys.stderr)


def _one_at_a_time(compile_or_load: Callable[[Any], Any], path: Path) -> Callable[[Any], Any]:
    """Return the same for several processes: of those that need the machine code one compiles, the others load it."""

    def locked(signature: Any) -> Any:
        with path.open("w") as lock, stage(COMPILING):
            fcntl.flock(lock, fcntl.LOCK_EX)
            return compile_or_load(signature)

    return locked


def _remove_outdated(folder: Path, module: str, name: str, kept: FunctionType) -> None:
    """Remove the machine code of a function under other digests than that of the kept one.

    A process that was about to load it compiles anew.
    """
    for path in folder.glob(f"{glob.escape(f'{module}.{name}')}_*.nb[ci]"):
        digest_of_file = path.name.removeprefix(f"{module}.{name}_").partition("-")[0]
        if DIGEST.fullmatch(digest_of_file) and not kept.__qualname__.endswith(f"_{digest_of_file}"):
            path.unlink(missing_ok=True)


def digest(function: Callable[..., Any]) -> str:
    """Return a digest of a plain function's code and constants and of those of all functions that it calls.

    The classes of their arguments enter it with names and fields: machine code reads fields by their place. So do the
    modules of functions and classes, which it imports when it is loaded.
    It is the same in every process: neither the order of a set nor the way in which the interpreter holds equal
    constants enters it, which both vary from one compilation of a source to the next; nor do file and lines.
    """
    total = hashlib.sha256()
    for part in _ingredients(_plain(function), set()):
        total.update(part)
    return total.hexdigest()[:16]


def _machine_code(function: FunctionType, **options: Any) -> Any:
    """Return a dispatcher of numba with some more of its options.

    Division by zero gives infinity or NaN, as the equations expect; sums keep their order, so that results are those of
    the plain functions; everything is put into one function, which makes the loop a third faster; the interpreter's
    lock is not held, so that threads run side by side.
    """
    # here, because most processes compile nothing
    import numba

    return numba.njit(error_model="numpy", fastmath=False, forceinline=True, nogil=True, **options)(function)


def is_of_compiler(error: Exception) -> bool:
    """Return whether an error is that of a function, or of its arguments, that cannot be compiled."""
    from numba.core import errors

    # older versions raise a NumbaError for what has an error of its own, which is none, in later ones
    of_bytecode = getattr(errors, "UnsupportedBytecodeError", errors.NumbaError)
    return isinstance(error, (errors.NumbaError, of_bytecode, TypeError))


def processor() -> str:
    """Return what the compiler calls the processor of this machine, on which the last digits of results depend."""
    from numba.core import codegen

    name: str = vars(codegen)["ll"].get_host_cpu_name()
    return name


def _plain(function: Callable[..., Any]) -> FunctionType:
    if not isinstance(function, FunctionType) or function.__closure__ is not None:
        raise TypeError(f"{function!r}: expected a plain function without a closure")
    return function


def bound(function: Callable[..., Any], **names: Callable[..., Any]) -> FunctionType:
    """Return a copy of a plain function, not compiled, that sees other functions under some names of its module."""
    return _with_names(_plain(function), names)


def bound_apart(whom: str, function: Callable[..., Any], **names: Callable[..., Any]) -> FunctionType:
    """Return `bound`, named after whose functions it sees: its machine code is kept apart from that of others.

    Kept code names the modules of its arguments' types, and cannot be loaded where one of them is not there.
    """
    copy = bound(function, **names)
    copy.__name__ = copy.__qualname__ = f"{function.__name__}_{whom}"
    return copy


def _with_names(function: FunctionType, names: Mapping[str, Callable[..., Any]]) -> FunctionType:
    """Return a copy of a function that sees other functions under some names of its module."""
    copy = FunctionType(function.__code__, {**function.__globals__, **names}, function.__name__)
    copy.__defaults__, copy.__kwdefaults__ = function.__defaults__, function.__kwdefaults__
    copy.__module__, copy.__qualname__ = function.__module__, function.__qualname__
    return copy


def _rebound(function: FunctionType) -> FunctionType:
    callees = {name: _callee(value) for name, value in _globals_of(function) if isinstance(value, FunctionType)}
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
    defaults = _canonical((function.__defaults__, function.__kwdefaults__))
    # kept code imports the modules of its functions and classes
    yield f"{function.__module__} {_canonical(function.__code__)} {defaults} {_arguments(function)}\n".encode()
    for name, value in _globals_of(function):
        if isinstance(value, FunctionType):
            yield from _ingredients(value, seen)
        else:
            yield f"{name} {_canonical(value)}\n".encode()


@cache
def _arguments(function: FunctionType) -> str:
    try:
        hints = get_type_hints(function)
    except NameError:
        # a class that only type checkers import
        return _canonical(function.__annotations__)
    return ", ".join(f"{name}: {_layout(hint)}" for name, hint in hints.items())


@cache
def _layout(hint: Any) -> str:
    """Return name and fields of a class, and those of the fields' classes."""
    if not hasattr(hint, "_fields"):
        return str(hint)
    fields = ", ".join(f"{name}: {_layout(field_hint)}" for name, field_hint in get_type_hints(hint).items())
    return f"{hint.__module__}.{hint.__qualname__}({fields})"


def _canonical(value: Any) -> str:
    """Return a text that equal constants, classes and code share, whatever process has made them."""
    kind = type(value).__qualname__
    match value:
        case CodeType():
            inputs = value.co_argcount, value.co_posonlyargcount, value.co_kwonlyargcount, value.co_flags
            names = value.co_names, value.co_varnames, value.co_cellvars, value.co_freevars
            return f"code{(value.co_code, value.co_exceptiontable, *inputs, *names)} {_canonical(value.co_consts)}"
        case type():
            fields = getattr(value, "_fields", ()), getattr(value, "_field_defaults", {})
            return f"class {value.__module__}.{value.__qualname__} {_canonical(fields)}"
        case tuple() | list():
            return f"{kind}[{', '.join(map(_canonical, value))}]"
        case set() | frozenset():
            return f"{kind}[{', '.join(sorted(map(_canonical, value)))}]"
        case dict():
            return f"{kind}[{', '.join(f'{_canonical(key)}: {_canonical(entry)}' for key, entry in value.items())}]"
        case _:
            return f"{kind} {value!r}"
