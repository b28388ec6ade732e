# SPDX-License-Identifier: Apache-2.0
"""Settings declared once: a NamedTuple whose annotations carry description, unit, range and choices.

Everything else derives from the declaration: the section of a scenario file (`Section`), the parameters of a node
(`fivebar_description.ros.parameters.declare`), the tuple of numbers that compiled code takes (`as_numbers`) and the
documentation (`fivebar settings`).
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, Union, cast, get_args, get_origin, get_type_hints

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel, GetCoreSchemaHandler, GetJsonSchemaHandler, Strict, TypeAdapter, ValidationError
from pydantic_core import CoreSchema, core_schema

from fivebar_description.errors import InputError
from fivebar_description.refusals import problems_in
from fivebar_description.suggestion import expected_one_of

S = TypeVar("S", bound=tuple[Any, ...])


@dataclass(frozen=True)
class Setting:
    """The meaning of a setting, as metadata of its annotation; pydantic checks range, choices and `check` by it.

    Attributes:
        description: one sentence on what it does.
        unit: its unit, "" for none.
        at_least, above, at_most, below: its range, the bounds of `above` and `below` left out.
        choices: the allowed words, for strings.
        unlimited: whether a number may be infinite, "no limit"; in a file that is null, in a node's parameters 0.
        tunable: whether it may be changed while a node runs.
        check: returns what else is wrong with a value, None if nothing.
    """

    description: str
    unit: str = ""
    at_least: float | None = None
    above: float | None = None
    at_most: float | None = None
    below: float | None = None
    choices: tuple[str, ...] = ()
    unlimited: bool = False
    tunable: bool = False
    check: Callable[[Any], str | None] | None = None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Return pydantic's schema of a field with this setting: its type, range and checks; a list makes a tuple."""
        kind, optional = _without_none(source)
        narrowed: Any = kind
        if hasattr(kind, "_fields"):
            narrowed = tuple.__class_getitem__(tuple(get_type_hints(kind).values()))
        if get_origin(narrowed) is tuple:
            narrowed = Annotated[narrowed, Strict(False)]
        for constraint, bound in ((Ge, self.at_least), (Gt, self.above), (Le, self.at_most), (Lt, self.below)):
            if bound is not None:
                narrowed = Annotated[narrowed, constraint(bound)]
        schema = core_schema.no_info_after_validator_function(
            partial(self._checked, kind), handler.generate_schema(narrowed)
        )
        if not (optional or self.unlimited):
            return schema
        nullable = core_schema.nullable_schema(schema)
        if not self.unlimited:
            return nullable
        return core_schema.no_info_after_validator_function(
            lambda value: math.inf if value is None else value, nullable
        )

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return the JSON Schema of a field with this setting: with its description, unit and choices too."""
        described = handler(schema)
        # a list of choices beside null belongs to the words alone
        words = next(
            (alternative for alternative in described.get("anyOf", ()) if alternative.get("type") == "string"),
            described,
        )
        if self.choices:
            words["enum"] = list(self.choices)
        described["description"] = f"{self.description} Unit: {self.unit}." if self.unit else self.description
        return described

    def problem(self, value: Any) -> str | None:
        """Return what is wrong with a value beyond its type and range, None if nothing."""
        if self.choices and value not in self.choices:
            return expected_one_of(value, self.choices)
        return self.check(value) if self.check is not None else None

    def outside(self, value: float) -> bool:
        """Return whether a number is out of range."""
        return (
            (self.at_least is not None and not value >= self.at_least)
            or (self.above is not None and not value > self.above)
            or (self.at_most is not None and not value <= self.at_most)
            or (self.below is not None and not value < self.below)
        )

    def range_text(self) -> str:
        """Return the range in words, "" for none."""
        words = [
            f"{word} {bound:.10g}"
            for word, bound in (
                ("at least", self.at_least),
                ("above", self.above),
                ("at most", self.at_most),
                ("below", self.below),
            )
            if bound is not None
        ]
        return ", ".join(words)

    def _checked(self, kind: Any, value: Any) -> Any:
        typed = made_of(kind, value)
        problem = self.problem(typed)
        if problem is not None:
            raise ValueError(problem)
        return typed


REQUIRED = object()
"""In place of the default of a setting that has none."""

NO_LIMIT: dict[Any, Any] = {float: 0.0, int: 0, str: ""}
"""Sentinels, by type, that stand for None, for infinity and, as its one element, for an empty array among a node's
parameters: ROS parameters know no null and no infinity, and an empty array of theirs has no type."""


COUNT_WORDS = {2: "two", 3: "three", 4: "four"}


class Declared(NamedTuple):
    """One declared setting: a field of a NamedTuple, or a key of a file, and the parameter of a node that holds it.

    A parameter has no null, and an array of numbers is flat: `waypoints` is x1, y1, x2, y2, ..., and zero, "" or an
    array with such an element stands for null where a setting may have it.

    Attributes:
        name: of the field; of a key its path in the file, with dots.
        kind: its type, without None where it may be absent.
        optional: whether it may be None, "no limit" or "not there".
        default: its default; `REQUIRED` where there is none.
        setting: description, unit and range.
        shape: whether it is an array, and of what.
    """

    name: str
    kind: Any
    optional: bool
    default: Any
    setting: Setting
    shape: SettingShape

    @property
    def none(self) -> Any:
        """The parameter that stands for an absent setting; None where the setting cannot be absent."""
        if not (self.optional or self.setting.unlimited or self.default == ()):
            return None
        none = NO_LIMIT[self.shape.element]
        return [none] if self.shape.depth else none

    def to_parameter(self, value: Any) -> Any:
        """Return a value, as read, as a parameter of a node: plain numbers and words, flat lists for arrays."""
        if self.none is not None and (value is None or value == () or value == math.inf):
            return self.none
        if not self.shape.depth:
            return self.shape.element(value)
        return [self.shape.element(entry) for entry in _flat(value if isinstance(value, Sequence) else (value,))]

    def to_file(self, value: Any) -> Any:
        """Return a parameter as the value that a file has for it.

        Raises:
            InputError: pairs are incomplete.
        """
        if isinstance(value, Sequence) and not isinstance(value, str):
            value = list(value)
        if self.none is not None and value == self.none:
            return None if self.optional or self.setting.unlimited else []
        if self.shape.depth > 1:
            if len(value) % 2:
                raise InputError(f"{self.name}: {len(value)} numbers: expected pairs")
            return [list(pair) for pair in zip(value[::2], value[1::2], strict=True)]
        return value[0] if self.shape.single and len(value) == 1 else value

    def problem(self, value: Any) -> str | None:
        """Return what is wrong with a parameter whose type is right, None if nothing; pairs are left to their file."""
        numbers = value if isinstance(value, Sequence) else (value,)
        if any(isinstance(number, float) and not math.isfinite(number) for number in numbers):
            return "expected finite numbers"
        try:
            plain = self.to_file(value)
        except InputError as error:
            return str(error).removeprefix(f"{self.name}: ")
        if plain is None or plain == [] or self.shape.depth > 1:
            return None
        if isinstance(plain, list):
            if self.shape.length is not None and len(plain) != self.shape.length:
                return f"expected {COUNT_WORDS.get(self.shape.length, self.shape.length)} numbers"
            plain = tuple(plain)
        elif isinstance(plain, float | int) and self.setting.outside(plain):
            return f"expected {self.setting.range_text()} {self.setting.unit}".rstrip()
        return self.setting.problem(made_of(self.kind, plain))


class SettingShape(NamedTuple):
    """Whether a type is an array, and of what.

    Attributes:
        element: the type of a value, or of the numbers in an array.
        depth: 0 for a value, 1 for an array, 2 for an array of arrays.
        single: whether one number may stand in the place of an array.
        length: of an array, None for any and for what is no array.
    """

    element: Any
    depth: int = 0
    single: bool = False
    length: int | None = None


def shape_of(kind: Any) -> SettingShape:
    """Return the shape of a type; that of alternatives has the element of the first and the depth of the deepest."""
    arguments = get_args(kind)
    if get_origin(kind) is Annotated:
        return shape_of(arguments[0])
    if get_origin(kind) is Literal:
        return SettingShape(type(arguments[0]))
    if get_origin(kind) in (Union, UnionType):
        depths = [shape_of(argument).depth for argument in arguments]
        return SettingShape(shape_of(arguments[0]).element, max(depths), 0 in depths and max(depths) > 0)
    if hasattr(kind, "_fields"):
        arguments = tuple(get_type_hints(kind).values())
    elif get_origin(kind) is not tuple:
        return SettingShape(kind)
    within = shape_of(arguments[0])
    return SettingShape(within.element, within.depth + 1, length=None if ... in arguments else len(arguments))


def _flat(value: Iterable[Any]) -> Iterable[Any]:
    for entry in value:
        if isinstance(entry, Sequence) and not isinstance(entry, str):
            yield from _flat(entry)
        else:
            yield entry


def made_of(kind: Any, value: Any) -> Any:
    """Return a tuple as the NamedTuple that `kind` may be; any other value as it is."""
    return kind(*value) if hasattr(kind, "_fields") else value


def _hints(settings: type[tuple[Any, ...]]) -> dict[str, Any]:
    """Return the annotations of a NamedTuple, in which a lambda sees the names of the module."""
    return get_type_hints(settings, vars(sys.modules[settings.__module__]), include_extras=True)


@cache
def declared(settings: type[tuple[Any, ...]]) -> tuple[Declared, ...]:
    """Return the settings that a NamedTuple declares, without those of its `sections`.

    Raises:
        TypeError: a field carries no `Setting`.
    """
    defaults = cast(Any, settings)._field_defaults
    within = sections(settings)
    declarations = []
    for name, hint in _hints(settings).items():
        if name in within:
            continue
        declaration = declared_as(name, hint, defaults.get(name, REQUIRED))
        if declaration is None:
            raise TypeError(f"{settings.__name__}.{name}: expected Annotated[..., Setting(...)]")
        declarations.append(declaration)
    return tuple(declarations)


@cache
def sections(settings: type[tuple[Any, ...]]) -> dict[str, type[tuple[Any, ...]]]:
    """Return the fields of a NamedTuple that are sections of their own (`Section[...]`): NamedTuples, by name."""
    return {
        name: get_args(hint)[0]
        for name, hint in _hints(settings).items()
        if any(isinstance(annotation, Keys) for annotation in get_args(hint)[1:])
    }


def setting_named(settings: type[tuple[Any, ...]], name: str) -> Declared:
    """Return one setting of a NamedTuple, to be declared elsewhere with the same words, range and default.

    Raises:
        KeyError: it has no such field.
    """
    return {declaration.name: declaration for declaration in declared(settings)}[name]


def declared_as(name: str, hint: Any, default: Any) -> Declared | None:
    """Return the setting that an annotation declares, None where it carries no `Setting`."""
    setting = next((annotation for annotation in get_args(hint)[1:] if isinstance(annotation, Setting)), None)
    if get_origin(hint) is not Annotated or setting is None:
        return None
    kind, optional = _without_none(get_args(hint)[0])
    return Declared(name, kind, optional, default, setting, shape_of(kind))


def _without_none(kind: Any) -> tuple[Any, bool]:
    """Return a type without None, and whether None was one of its alternatives."""
    if get_origin(kind) not in (Union, UnionType) or NoneType not in get_args(kind):
        return kind, False
    (present,) = (alternative for alternative in get_args(kind) if alternative is not NoneType)
    return present, True


def as_numbers(settings: S) -> S:
    """Return settings as compiled code takes them: numbers only, each of the type that it always has.

    Words become their place among the choices, an absent limit becomes infinite, an absent count 0, and an integer that
    stands for a float becomes one.
    """
    values: dict[str, Any] = {name: as_numbers(getattr(settings, name)) for name in sections(type(settings))}
    for declaration in declared(type(settings)):
        value: Any = getattr(settings, declaration.name)
        if declaration.kind is str:
            values[declaration.name] = declaration.setting.choices.index(value)
        elif value is None:
            values[declaration.name] = 0 if declaration.kind is int else math.inf
        elif declaration.kind is float:
            values[declaration.name] = float(value)
        else:
            values[declaration.name] = value
    return type(settings)(**values)


def to_parameters(settings: tuple[Any, ...]) -> dict[str, Any]:
    """Return settings without sections as a node's parameters take them (`GraphNode.declare_settings`)."""
    return {
        declaration.name: declaration.to_parameter(getattr(settings, declaration.name))
        for declaration in declared(type(settings))
    }


def from_parameters(settings: type[S], values: Mapping[str, Any]) -> S:
    """Return settings without sections from a node's parameters, which may be among others."""
    fields = {}
    for declaration in declared(settings):
        value = declaration.to_file(values[declaration.name])
        if value is None and declaration.setting.unlimited:
            value = math.inf
        fields[declaration.name] = made_of(declaration.kind, tuple(value) if isinstance(value, list) else value)
    return settings(**fields)


def read_settings(content: Mapping[str, Any], settings: type[S], section: str) -> S:
    """Return settings from keys with values of a section.

    Raises:
        InputError: a key is unknown, or a value does not fit.
    """
    keys: Any = Annotated[settings, Keys()]
    reader: TypeAdapter[S] = TypeAdapter(keys)
    try:
        return reader.validate_python(dict(content))
    except ValidationError as error:
        raise InputError(problems_in(error, f"{section}.", content, reader.json_schema)) from error


STRICT = core_schema.CoreConfig(strict=True, allow_inf_nan=False)


@dataclass(frozen=True)
class Keys:
    """Makes a section of a file of a NamedTuple's settings: `safety: Annotated[SafetySettings, Keys()]`.

    Attributes:
        without: settings that are no keys of the section and keep their defaults.
        others: whether the section may have further keys, of whoever else reads it; they are left out.
    """

    without: tuple[str, ...] = ()
    others: bool = False

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Return pydantic's schema of the section: a mapping in the file, the NamedTuple once read."""
        fields = {}
        for declaration in declared(source):
            if declaration.name in self.without:
                continue
            schema = handler.generate_schema(
                Annotated[declaration.kind | None if declaration.optional else declaration.kind, declaration.setting]
            )
            if declaration.default is not REQUIRED:
                schema = core_schema.with_default_schema(schema, default=declaration.default)
            fields[declaration.name] = core_schema.typed_dict_field(schema, required=declaration.default is REQUIRED)
        for name, section in sections(source).items():
            inner: Any = Annotated[section, Keys()]
            schema = core_schema.with_default_schema(handler.generate_schema(inner), default=section())
            fields[name] = core_schema.typed_dict_field(schema, required=False)
        keys = core_schema.typed_dict_schema(
            fields, extra_behavior="ignore" if self.others else "forbid", config=STRICT
        )
        plain = partial(plain_keys, without=self.without)
        return core_schema.no_info_before_validator_function(
            partial(_mapping, plain=plain),
            core_schema.no_info_after_validator_function(lambda values: source(**values), keys),
            serialization=core_schema.plain_serializer_function_ser_schema(plain),
        )


def _mapping(content: Any, plain: Callable[[Any], dict[str, Any]]) -> Any:
    if hasattr(content, "_fields"):
        return plain(content)
    if isinstance(content, Mapping):
        return content
    raise ValueError(f"expected keys with values, found {type(content).__name__}")


def plain_keys(settings: tuple[Any, ...], without: Collection[str] = ()) -> dict[str, Any]:
    """Return settings as a section of a file has them: keys with values, no limit as None, sections within."""
    values = {
        declaration.name: None if (value := getattr(settings, declaration.name)) == math.inf else value
        for declaration in declared(type(settings))
        if declaration.name not in without
    }
    return values | {name: plain_keys(getattr(settings, name)) for name in sections(type(settings))}


Section = Annotated[S, Keys()]
"""A section of a file that holds the settings of a NamedTuple: `unified: Section[UnifiedSettings]`."""


def keys_of(model: type[BaseModel], names: Iterable[str]) -> list[Declared]:
    """Return keys of a file.

    Args:
        model: the file's.
        names: of keys, of whole sections, or of keys in sections: `zone`, `ekf.gyro`.
    """
    hints = get_type_hints(model, include_extras=True)
    declarations: dict[str, Declared] = {}
    for name in names:
        top, _, inner = name.partition(".")
        field = model.model_fields[top]
        keys = next((annotation for annotation in field.metadata if isinstance(annotation, Keys)), None)
        if keys is None:
            default = None if field.is_required() else field.get_default(call_default_factory=True)
            declaration = declared_as(top, hints[top], default)
            assert declaration is not None, f"{top}: expected a setting or a section"
            declarations[top] = declaration
            continue
        section: Any = field.annotation
        for key in section_keys(section, f"{top}.", keys.without):
            if not inner or key.name == name or key.name.startswith(f"{name}."):
                declarations[key.name] = key
    return list(declarations.values())


def section_keys(settings: type[tuple[Any, ...]], prefix: str, without: Sequence[str] = ()) -> list[Declared]:
    """Return the keys of a section and of those within it, named with a prefix that ends in a dot."""
    own = [
        declaration._replace(name=prefix + declaration.name)
        for declaration in declared(settings)
        if declaration.name not in without
    ]
    within = [section_keys(section, f"{prefix}{name}.") for name, section in sections(settings).items()]
    return [*own, *(key for keys in within for key in keys)]


def with_keys(content: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return a file's content with other values of keys, by their names with dots."""
    changed = dict(content)
    for name, value in values.items():
        top, _, inner = name.partition(".")
        changed[top] = with_keys(changed.get(top) or {}, {inner: value}) if inner else value
    return changed
