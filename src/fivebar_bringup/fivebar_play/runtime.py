# SPDX-License-Identifier: Apache-2.0
"""Functions of Python that JavaScript lacks, as JavaScript functions that translated code calls."""

from __future__ import annotations

import math
import re
from typing import Any

HELPERS = {
    # as in Python NaN never is the smaller or the larger one of two, unless it comes first
    "$min": "(...all) => all.reduce((least, one) => (one < least ? one : least))",
    "$max": "(...all) => all.reduce((most, one) => (one > most ? one : most))",
    "$mod": "(a, b) => { const rest = a % b; return rest !== 0 && rest < 0 !== b < 0 ? rest + b : rest; }",
    "$whole": "(a, b) => Math.floor(a / b)",
    "$isinf": "(x) => x === Infinity || x === -Infinity",
    "$copysign": "(size, sign) => (sign < 0 || Object.is(sign, -0) ? -Math.abs(size) : Math.abs(size))",
    # to the even one of two integers that are as near
    "$round": "(x) => { const down = Math.floor(x), rest = x - down;"
    " return rest < 0.5 || (rest === 0.5 && down % 2 === 0) ? down : down + 1; }",
    "$range": "(first, end) => Array.from({ length: Math.max(0, end - first) }, (_, number) => first + number)",
    "$item": "(all, number) => (Array.isArray(all) ? all : [...all])[number]",
    # what is neither true nor false, a number nor None is none of the conditions of the translated functions
    "$truth": "(x) => { if (typeof x === 'boolean') return x; if (typeof x === 'number') return x !== 0;"
    " if (x === null) return false; throw new TypeError(`no condition: ${x}`); }",
    "$raise": "(name) => { throw new Error(name); }",
}
"""Functions by the names under which translated code calls them; `$` is in no name of Python."""

BUILTINS = {abs: "Math.abs", min: "$min", max: "$max", round: "$round", range: "$range"}
"""The functions of Python that translated code may call."""

MATHEMATICS: dict[Any, str] = {
    **{
        getattr(math, name): f"Math.{name}"
        for name in (
            *("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh"),
            *("exp", "expm1", "log", "sqrt", "hypot", "floor", "ceil"),
        )
    },
    math.isnan: "Number.isNaN",
    math.isfinite: "Number.isFinite",
    math.isinf: "$isinf",
    math.copysign: "$copysign",
}
"""The functions of Python's `math` that it may call."""

CONDITIONS = {"Number.isNaN", "Number.isFinite", "$isinf"}
"""Functions that return true or false."""

RESERVED = frozenset(
    re.findall(
        r"\w+",
        "await break case catch class const continue debugger default delete do else enum eval export extends false"
        " finally for function if implements import in instanceof interface let new null package private protected"
        " public return static super switch this throw true try typeof var void while with yield arguments undefined"
        " Math Number",
    )
)
"""Words that JavaScript does not take as the name of a variable."""
