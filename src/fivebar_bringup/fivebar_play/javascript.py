# SPDX-License-Identifier: Apache-2.0
"""Translates plain functions of numbers into JavaScript, together with all functions and classes that they need.

The functions are those that numba compiles too: module-level functions of floats, NamedTuples and tuples of them. A
NamedTuple becomes a class, a tuple an array. Names are looked up as Python does, in the globals of the function itself,
so that a function with other names bound (`fivebar_control.compiling.bound`) is translated with these. Whatever is not
known is refused with its file and line: nothing is guessed.
"""

from __future__ import annotations

import ast
import builtins
import inspect
import json
import math
import textwrap
from collections.abc import Callable, Collection, Iterator, Mapping
from types import BuiltinFunctionType, FunctionType
from typing import Any, NoReturn

from fivebar_play.runtime import BUILTINS, CONDITIONS, HELPERS, MATHEMATICS, RESERVED

BINARY: dict[type[ast.operator], str] = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**"}
BINARY_HELPERS: dict[type[ast.operator], str] = {ast.Mod: "$mod", ast.FloorDiv: "$whole"}
COMPARISONS: dict[type[ast.cmpop], str] = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "===", ast.NotEq: "!==", ast.Is: "===",
    ast.IsNot: "!==",
}  # fmt: skip
CLASS_METHODS = {"append": "push"}
"""Methods of Python's lists, and of JavaScript's arrays."""


class Untranslatable(Exception):
    """Raised for code that is not in the part of Python which is translated; says where, and what it is."""


class Translation:
    """JavaScript of some functions, which grows with each that is asked for."""

    def __init__(self, without: Collection[Callable[..., Any]] = ()) -> None:
        """Begin an empty translation; `without` are functions that are never called, and raise if they are."""
        self._without = set(without)
        self._names: dict[Any, str] = {}
        self._taken: set[str] = set()
        self._classes: dict[str, type] = {}
        self._constants: dict[str, str] = {}
        self._functions: dict[str, str] = {}
        self._waiting: list[tuple[str, FunctionType]] = []
        self.attributes: set[str] = set()
        self.helpers: set[str] = set()

    def text(self, exports: Mapping[str, Any]) -> str:
        """Return a JavaScript expression: an object of functions and constants, by their names there.

        Raises:
            Untranslatable: a part of it is not translated.
        """
        exported = [f"{name}: {self.value(value)}" for name, value in exports.items()]
        classes = self._complete()
        unknown = self.attributes - {name for kind in self._classes.values() for name in vars(kind)}
        if unknown:
            raise Untranslatable(f"no class has these attributes: {', '.join(sorted(unknown))}")
        helpers = [f"const {name} = {HELPERS[name]};" for name in sorted(self.helpers)]
        constants = [f"const {name} = {text};" for name, text in self._constants.items()]
        parts = [*helpers, *classes, *constants, *self._functions.values()]
        body = "\n".join(parts)
        return f'(() => {{\n"use strict";\n{body}\nreturn {{ {", ".join(exported)} }};\n}})()'

    def _complete(self) -> list[str]:
        """Translate what waits, and return the texts of the classes; methods may need further functions and classes."""
        while True:
            while self._waiting:
                name, function = self._waiting.pop()
                self._functions[name] = _Body(self, function).function(f"function {name}")
            classes = [self._class(name, kind) for name, kind in [*self._classes.items()]]
            if not self._waiting and len(classes) == len(self._classes):
                return classes

    @property
    def functions(self) -> list[FunctionType]:
        """The functions that have been asked for and those that they need, methods left out."""
        return [name for name in self._names if isinstance(name, FunctionType) and name not in self._without]

    @property
    def classes(self) -> list[str]:
        """The names of the classes that these need."""
        return [*self._classes]

    def reference(self, function: FunctionType) -> str:
        """Return the name of a function, which is translated too."""
        if function not in self._names:
            name = self._named(function, function.__name__)
            if function in self._without:
                self.helpers.add("$raise")
                self._functions[name] = f'function {name}() {{ $raise("not translated: {name}"); }}'
            else:
                self._waiting.append((name, function))
        return self._names[function]

    def class_of(self, kind: type) -> str:
        """Return the name of a NamedTuple class.

        Raises:
            Untranslatable: it is another kind of class.
        """
        if kind not in self._names:
            if not (issubclass(kind, tuple) and hasattr(kind, "_fields")):
                raise Untranslatable(f"{kind.__module__}.{kind.__qualname__}: expected a NamedTuple")
            self._classes[self._named(kind, kind.__name__)] = kind
        return self._names[kind]

    def value(self, value: Any) -> str:
        """Return an expression for a value: a number, None, a text, a function, or tuples of these.

        Raises:
            Untranslatable: it is none of these.
        """
        if value is None or isinstance(value, bool):
            return {None: "null", True: "true", False: "false"}[value]
        if isinstance(value, int):
            return repr(value)
        if isinstance(value, float):
            if math.isfinite(value):
                return repr(value)
            return "NaN" if math.isnan(value) else "Infinity" if value > 0.0 else "-Infinity"
        if isinstance(value, str):
            return json.dumps(value)
        if isinstance(value, FunctionType):
            return self.reference(value)
        if isinstance(value, type):
            return self.class_of(value)
        if isinstance(value, tuple) and hasattr(value, "_fields"):
            return f"new {self.class_of(type(value))}({', '.join(map(self.value, value))})"
        if isinstance(value, tuple | list):
            return f"[{', '.join(map(self.value, value))}]"
        if isinstance(value, dict):
            return f"{{ {', '.join(f'{json.dumps(str(key))}: {self.value(item)}' for key, item in value.items())} }}"
        raise Untranslatable(f"{value!r}: expected a number, a text, a function or a tuple of these")

    def constant(self, name: str, value: Any) -> str:
        """Return an expression for a constant of a module: a plain number itself, else the name of a constant."""
        if not isinstance(value, tuple):
            return self.value(value)
        text = self.value(value)
        key = (name, text)
        if key not in self._names:
            self._constants[self._named(key, name)] = text
        return self._names[key]

    def _named(self, key: Any, wanted: str) -> str:
        """Return a new name, which no local variable hides: two functions, bound or imported, may have one name."""
        number = 1
        while (name := f"{wanted}${number}") in self._taken:
            number += 1
        self._taken.add(name)
        self._names[key] = name
        return name

    def _class(self, name: str, kind: type) -> str:
        fields: tuple[str, ...] = getattr(kind, "_fields")  # noqa: B009
        defaults: dict[str, Any] = getattr(kind, "_field_defaults")  # noqa: B009
        arguments = [
            f"{_local(field)} = {self.value(defaults[field])}" if field in defaults else _local(field)
            for field in fields
        ]
        kept = " ".join(f"this.{field} = {_local(field)};" for field in fields)
        lines = [
            f"class {name} {{",
            f"constructor({', '.join(arguments)}) {{ {kept} }}",
            f"*[Symbol.iterator]() {{ {' '.join(f'yield this.{field};' for field in fields)} }}",
        ]
        for attribute in sorted(self.attributes - {*fields}):
            member = vars(kind).get(attribute)
            if isinstance(member, property):
                assert isinstance(member.fget, FunctionType)
                lines.append(_Body(self, member.fget).function(f"get {attribute}", method=True))
            elif isinstance(member, FunctionType):
                lines.append(_Body(self, member).function(attribute, method=True))
        return "\n".join([*lines, "}"])


class _Body:
    """One function on its way into JavaScript."""

    def __init__(self, translation: Translation, function: FunctionType) -> None:
        self._all = translation
        self._function = function
        lines, first = inspect.getsourcelines(function)
        self._node = ast.parse(textwrap.dedent("".join(lines))).body[0]
        self._place = f"{inspect.getsourcefile(function)}", first
        code = function.__code__
        self._locals = {*code.co_varnames, *code.co_cellvars}
        if code.co_freevars or not isinstance(self._node, ast.FunctionDef):
            raise Untranslatable(f"{function.__qualname__}: expected a plain function without a closure")

    def function(self, declared: str, method: bool = False) -> str:
        """Return the text of the function after its declaration, such as `function NAME`."""
        node = self._node
        assert isinstance(node, ast.FunctionDef)
        if node.decorator_list and not method:
            self._refuse(node, "a decorator")
        names = [argument.arg for argument in node.args.args]
        if node.args.vararg or node.args.kwarg or node.args.kwonlyargs or node.args.posonlyargs:
            self._refuse(node, "an argument that is neither plain nor has a default")
        defaults = dict(zip(names[::-1], (self._function.__defaults__ or ())[::-1], strict=False))
        arguments = [
            f"{_local(name)} = {self._all.value(defaults[name])}" if name in defaults else _local(name)
            for name in names[1 if method else 0 :]
        ]
        inner = sorted({*self._function.__code__.co_varnames, *self._function.__code__.co_cellvars} - {*names})
        begin = ["const self = this;"] if method else []
        begin += [f"let {', '.join(map(_local, inner))};"] if inner else []
        body = "\n".join([*begin, *self._block(node.body)])
        return f"{declared}({', '.join(arguments)}) {{\n{body}\n}}"

    def _block(self, statements: list[ast.stmt]) -> Iterator[str]:
        for statement in statements:
            yield from self._statement(statement)

    def _braced(self, statements: list[ast.stmt]) -> str:
        return "{\n" + "\n".join(self._block(statements)) + "\n}"

    def _statement(self, node: ast.stmt) -> Iterator[str]:
        match node:
            case ast.Expr(value=ast.Constant(value=str())) | ast.Pass():
                return
            case ast.Expr(value=ast.Call()):
                yield f"{self._expression(node.value)};"
            case ast.Return():
                yield "return null;" if node.value is None else f"return {self._expression(node.value)};"
            case ast.Assign():
                targets = [self._target(target) for target in node.targets]
                if len(targets) > 1 and not all(isinstance(target, ast.Name) for target in node.targets):
                    self._refuse(node, "a tuple that is assigned twice")
                yield f"{' = '.join([*targets, self._expression(node.value)])};"
            case ast.AnnAssign(simple=1):
                if node.value is not None:
                    yield f"{self._target(node.target)} = {self._expression(node.value)};"
            case ast.AugAssign(target=ast.Name()):
                name = self._target(node.target)
                yield f"{name} = {self._binary(node, node.op, name, self._expression(node.value))};"
            case ast.If():
                other = f" else {self._braced(node.orelse)}" if node.orelse else ""
                yield f"if ({self._condition(node.test)}) {self._braced(node.body)}{other}"
            case ast.While(orelse=[]):
                yield f"while ({self._condition(node.test)}) {self._braced(node.body)}"
            case ast.For(orelse=[]):
                yield f"for ({self._target(node.target)} of {self._expression(node.iter)}) {self._braced(node.body)}"
            case ast.Break():
                yield "break;"
            case ast.Continue():
                yield "continue;"
            case ast.Raise(exc=ast.Call(func=ast.Name())):
                assert isinstance(node.exc, ast.Call) and isinstance(node.exc.func, ast.Name)
                self._all.helpers.add("$raise")
                yield f'$raise("{node.exc.func.id}");'
            case _:
                self._refuse(node, type(node).__name__)

    def _target(self, node: ast.expr) -> str:
        match node:
            case ast.Name():
                return _local(node.id)
            case ast.Tuple():
                return f"[{', '.join(map(self._target, node.elts))}]"
        self._refuse(node, f"an assignment to {type(node).__name__}")

    def _expression(self, node: ast.expr) -> str:
        match node:
            case ast.Constant(value=bool() | int() | float() | None | str()):
                return self._all.value(node.value)
            case ast.Name():
                return _local(node.id) if node.id in self._locals else self._global(node)
            case ast.Attribute():
                return self._attribute(node)
            case ast.UnaryOp(op=ast.Not()):
                return f"!({self._condition(node.operand)})"
            case ast.UnaryOp(op=ast.USub() | ast.UAdd()):
                sign = "-" if isinstance(node.op, ast.USub) else "+"
                return f"({sign}{self._expression(node.operand)})"
            case ast.BinOp():
                return self._binary(node, node.op, self._expression(node.left), self._expression(node.right))
            case ast.BoolOp():
                if not self._is_condition(node):
                    self._refuse(node, "`and` or `or` of what is not true or false")
                return self._condition(node)
            case ast.Compare():
                return self._comparison(node)
            case ast.IfExp():
                chosen = f"{self._expression(node.body)} : {self._expression(node.orelse)}"
                return f"({self._condition(node.test)} ? {chosen})"
            case ast.Tuple() | ast.List():
                return f"[{', '.join(map(self._element, node.elts))}]"
            case ast.Subscript(slice=ast.Constant(value=int()) | ast.Name()):
                assert isinstance(node.slice, ast.Constant | ast.Name)
                self._all.helpers.add("$item")
                return f"$item({self._expression(node.value)}, {self._expression(node.slice)})"
            case ast.Lambda():
                return self._lambda(node)
            case ast.Call():
                return self._call(node)
        self._refuse(node, type(node).__name__)

    def _element(self, node: ast.expr) -> str:
        if isinstance(node, ast.Starred):
            return f"...{self._expression(node.value)}"
        return self._expression(node)

    def _binary(self, node: ast.AST, operator: ast.operator, left: str, right: str) -> str:
        if (helper := BINARY_HELPERS.get(type(operator))) is not None:
            self._all.helpers.add(helper)
            return f"{helper}({left}, {right})"
        if type(operator) not in BINARY:
            self._refuse(node, f"the operator {type(operator).__name__}")
        return f"({left} {BINARY[type(operator)]} {right})"

    def _comparison(self, node: ast.Compare) -> str:
        sides = [node.left, *node.comparators]
        # what stands in the middle of a chain is evaluated twice here
        if not all(isinstance(side, ast.Name | ast.Attribute | ast.Constant) for side in sides[1:-1]):
            self._refuse(node, "a chain of comparisons with more than a name in its middle")
        parts = []
        for left, operator, right in zip(sides, node.ops, sides[1:], strict=False):
            # a tuple as it stands, or a constant of a module
            is_tuple = isinstance(right, ast.Tuple) or isinstance(self._resolved(right), tuple)
            if isinstance(operator, ast.In) and is_tuple:
                parts.append(f"{self._expression(right)}.includes({self._expression(left)})")
            elif type(operator) in COMPARISONS:
                parts.append(f"{self._expression(left)} {COMPARISONS[type(operator)]} {self._expression(right)}")
            else:
                self._refuse(node, f"the comparison {type(operator).__name__}")
        return f"({' && '.join(parts)})"

    def _is_condition(self, node: ast.expr) -> bool:
        """Return whether an expression is true or false, by the way it is written."""
        match node:
            case ast.Compare() | ast.UnaryOp(op=ast.Not()) | ast.Constant(value=bool()):
                return True
            case ast.BoolOp():
                return all(map(self._is_condition, node.values))
            case ast.IfExp():
                return self._is_condition(node.body) and self._is_condition(node.orelse)
            case ast.Call():
                called = self._resolved(node.func)
                returned = getattr(called, "__annotations__", {}).get("return")
                return called is isinstance or _known(called) in CONDITIONS or returned in ("bool", bool)
        return False

    def _condition(self, node: ast.expr) -> str:
        if isinstance(node, ast.BoolOp):
            word = " && " if isinstance(node.op, ast.And) else " || "
            return f"({word.join(map(self._condition, node.values))})"
        if self._is_condition(node):
            return self._expression(node)
        self._all.helpers.add("$truth")
        return f"$truth({self._expression(node)})"

    def _lambda(self, node: ast.Lambda) -> str:
        names = [argument.arg for argument in node.args.args]
        before, self._locals = self._locals, self._locals | {*names}
        text = f"(({', '.join(map(_local, names))}) => {self._expression(node.body)})"
        self._locals = before
        return text

    def _resolved(self, node: ast.expr) -> Any:
        """Return what a name or an attribute of `math` stands for, None for what is known at run time only."""
        if isinstance(node, ast.Attribute):
            return getattr(math, node.attr, None) if self._resolved(node.value) is math else None
        if not isinstance(node, ast.Name) or node.id in self._locals:
            return None
        names = self._function.__globals__
        return names[node.id] if node.id in names else getattr(builtins, node.id, None)

    def _global(self, node: ast.Name) -> str:
        names = self._function.__globals__
        if node.id not in names:
            self._refuse(node, f"the name {node.id}")
        value = names[node.id]
        try:
            text = self._all.constant(node.id, value)
        except Untranslatable as error:
            self._refuse(node, str(error))
        return text

    def _attribute(self, node: ast.Attribute) -> str:
        if self._resolved(node.value) is math:
            value = getattr(math, node.attr)
            if not isinstance(value, float):
                self._refuse(node, f"math.{node.attr}")
            return self._all.value(value)
        if self._resolved(node.value) is not None and not isinstance(self._resolved(node.value), tuple):
            self._refuse(node, f"the attribute {node.attr} of what is no NamedTuple")
        self._all.attributes.add(node.attr)
        return f"{self._expression(node.value)}.{node.attr}"

    def _call(self, node: ast.Call) -> str:
        called = self._resolved(node.func)
        if called is isinstance:
            return f"({self._expression(node.args[0])} instanceof {self._expression(node.args[1])})"
        arguments = [self._element(argument) for argument in node.args]
        if isinstance(called, FunctionType | type) and called not in BUILTINS:
            arguments += self._by_keyword(node, called)
            new = "new " if isinstance(called, type) else ""
            return f"{new}{self._expression(node.func)}({', '.join(arguments)})"
        if node.keywords:
            self._refuse(node, "a keyword of a function that is not known")
        known = _known(called)
        if known is not None:
            if called is range and len(arguments) == 1:
                arguments.insert(0, "0")
            if known in HELPERS:
                self._all.helpers.add(known)
            return f"{known}({', '.join(arguments)})"
        if called is not None:
            self._refuse(node, f"a call of {ast.unparse(node.func)}")
        if isinstance(node.func, ast.Attribute) and node.func.attr in CLASS_METHODS:
            return f"{self._expression(node.func.value)}.{CLASS_METHODS[node.func.attr]}({', '.join(arguments)})"
        return f"{self._expression(node.func)}({', '.join(arguments)})"

    def _by_keyword(self, node: ast.Call, called: Any) -> list[str]:
        """Return the arguments that a call gives by keyword, in their places; those left out are `undefined`."""
        keywords = {keyword.arg: keyword.value for keyword in node.keywords}
        if not keywords:
            return []
        names = [*getattr(called, "_fields", inspect.signature(called).parameters)][len(node.args) :]
        if any(isinstance(argument, ast.Starred) for argument in node.args) or not keywords.keys() <= {*names}:
            self._refuse(node, "keywords that are no arguments of what is called")
        while names and names[-1] not in keywords:
            names.pop()
        return [self._expression(keywords[name]) if name in keywords else "undefined" for name in names]

    def _refuse(self, node: ast.AST, what: str) -> NoReturn:
        path, first = self._place
        line = first + getattr(node, "lineno", 1) - 1
        raise Untranslatable(f"{path}:{line}: {self._function.__qualname__}: {what} is not translated")


def _known(called: Any) -> str | None:
    """Return what a function of Python or of `math` is called in JavaScript, None where it is none that is known."""
    if not isinstance(called, BuiltinFunctionType | type):
        return None
    return BUILTINS.get(called) or MATHEMATICS.get(called)


def _local(name: str) -> str:
    return f"{name}$" if name in RESERVED else name
