"""Settings declared once: a NamedTuple whose annotations carry description, unit, range and choices.

Everything else derives from the declaration: the section of a scenario file (`Section`), the parameters of a node
(`fivebar_description.ros.parameters.specs_of`), the tuple of numbers that compiled code takes (`as_numbers`) and the
documentation (docs/settings.md).
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from types import NoneType, UnionType
from typing import Annotated, Any, NamedTuple, TypeVar, Union, cast, get_args, get_origin, get_type_hints

from annotated_types import Ge, Gt, Le, Lt
from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, Strict, TypeAdapter, ValidationError
from pydantic_core import CoreSchema, core_schema

from fivebar_description.errors import InputError
from fivebar_description.refusals import problems_in
from fivebar_description.suggestion import expected_one_of

S = TypeVar("S", bound=tuple[Any, ...])


@dataclass(frozen=True)
class Setting:
    """What a setting means, as metadata of its annotation; pydantic checks range, choices and `check` by it.

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
            lambda value: self._checked(made_of(kind, value)), handler.generate_schema(narrowed)
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
        words = next((one for one in described.get("anyOf", ()) if one.get("type") == "string"), described)
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

    def _checked(self, value: Any) -> Any:
        problem = self.problem(value)
        if problem is not None:
            raise ValueError(problem)
        return value


REQUIRED = object()
"""In place of the default of a setting that has none."""

NO_LIMIT: dict[Any, Any] = {float: 0.0, int: 0, str: ""}
"""What stands for None, for infinity and, as its one element, for an empty array among a node's parameters, by type:
ROS parameters know no null and no infinity, and an empty array of theirs has no type."""


COUNT_WORDS = {2: "two", 3: "three", 4: "four"}


class Declared(NamedTuple):
    """One declared setting.

    Attributes:
        name: of the field.
        kind: its type, without None where it may be absent.
        optional: whether it may be None, "no limit" or "not there".
        default: its default; `REQUIRED` where there is none.
        setting: description, unit and range.
    """

    name: str
    kind: Any
    optional: bool
    default: Any
    setting: Setting

    @property
    def element(self) -> Any:
        """The type of the elements of an array, else that of the setting itself."""
        if hasattr(self.kind, "_fields"):
            return next(iter(get_type_hints(self.kind).values()))
        return get_args(self.kind)[0] if get_origin(self.kind) is tuple else self.kind

    @property
    def length(self) -> int | None:
        """Length of an array, None for any and for what is no array."""
        if hasattr(self.kind, "_fields"):
            return len(self.kind._fields)
        elements = get_args(self.kind) if get_origin(self.kind) is tuple else (self.kind, ...)
        return None if ... in elements else len(elements)

    @property
    def none(self) -> Any:
        """What stands for `nothing` among a node's parameters; None where the setting cannot be absent."""
        if not (self.optional or self.setting.unlimited or self.default == ()):
            return None
        return NO_LIMIT[self.kind] if self.kind in NO_LIMIT else (NO_LIMIT[self.element],)

    @property
    def nothing(self) -> Any:
        """The value of an absent setting: None, infinity, or no elements."""
        if self.setting.unlimited:
            return math.inf
        return None if self.optional else ()

    def to_parameter(self, value: Any) -> Any:
        """Return a value as a parameter of a node: plain numbers and words, lists for arrays."""
        if self.none is not None and value == self.nothing:
            value = self.none
        if isinstance(value, tuple):
            return [float(one) if self.element is float else one for one in value]
        return float(value) if self.kind is float else value

    def from_parameter(self, value: Any) -> Any:
        """Return the value that a parameter of a node stands for; an array may come as any sequence."""
        if isinstance(value, Sequence) and not isinstance(value, str):
            value = tuple(value)
        return self.nothing if self.none is not None and value == self.none else made_of(self.kind, value)

    def problem(self, value: Any) -> str | None:
        """Return what is wrong with a parameter of a node whose type is right, None if nothing."""
        if self.none is not None and value == self.none:
            return None
        if isinstance(value, tuple):
            if self.length is not None and len(value) != self.length:
                return f"expected {COUNT_WORDS.get(self.length, self.length)} numbers"
        elif isinstance(value, float | int) and self.setting.outside(value):
            return f"expected {self.setting.range_text()} {self.setting.unit}".rstrip()
        return self.setting.problem(made_of(self.kind, value))


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
    found = []
    for name, hint in _hints(settings).items():
        if name in within:
            continue
        one = declared_as(name, hint, defaults.get(name, REQUIRED))
        if one is None:
            raise TypeError(f"{settings.__name__}.{name}: expected Annotated[..., Setting(...)]")
        found.append(one)
    return tuple(found)


@cache
def sections(settings: type[tuple[Any, ...]]) -> dict[str, type[tuple[Any, ...]]]:
    """Return the fields of a NamedTuple that are sections of their own (`Section[...]`): NamedTuples, by name."""
    return {
        name: get_args(hint)[0]
        for name, hint in _hints(settings).items()
        if any(isinstance(one, Keys) for one in get_args(hint)[1:])
    }


def setting_named(settings: type[tuple[Any, ...]], name: str) -> Declared:
    """Return one setting of a NamedTuple, to be declared elsewhere with the same words, range and default.

    Raises:
        KeyError: it has no such field.
    """
    return {one.name: one for one in declared(settings)}[name]


def declared_as(name: str, hint: Any, default: Any) -> Declared | None:
    """Return the setting that an annotation declares, None where it carries no `Setting`."""
    setting = next((one for one in get_args(hint)[1:] if isinstance(one, Setting)), None)
    if get_origin(hint) is not Annotated or setting is None:
        return None
    kind, optional = _without_none(get_args(hint)[0])
    return Declared(name, kind, optional, default, setting)


def _without_none(kind: Any) -> tuple[Any, bool]:
    """Return a type without None, and whether None was one of its alternatives."""
    if get_origin(kind) not in (Union, UnionType) or NoneType not in get_args(kind):
        return kind, False
    (present,) = (one for one in get_args(kind) if one is not NoneType)
    return present, True


def as_numbers(settings: S) -> S:
    """Return settings as compiled code takes them: numbers only, each of the type that it always has.

    Words become their place among the choices, an absent limit becomes infinite, an absent count 0, and an integer that
    stands for a float becomes one.
    """
    values: dict[str, Any] = {name: as_numbers(getattr(settings, name)) for name in sections(type(settings))}
    for one in declared(type(settings)):
        value: Any = getattr(settings, one.name)
        if one.kind is str:
            values[one.name] = one.setting.choices.index(value)
        elif value is None:
            values[one.name] = 0 if one.kind is int else math.inf
        elif one.kind is float:
            values[one.name] = float(value)
        else:
            values[one.name] = value
    return type(settings)(**values)


def to_parameters(settings: tuple[Any, ...]) -> dict[str, Any]:
    """Return settings without sections as a node's parameters take them, which `specs_of` declares."""
    return {one.name: one.to_parameter(getattr(settings, one.name)) for one in declared(type(settings))}


def from_parameters(settings: type[S], values: Mapping[str, Any]) -> S:
    """Return settings without sections from a node's parameters, which may be among others."""
    return settings(*(one.from_parameter(values[one.name]) for one in declared(settings)))


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
        for one in declared(source):
            if one.name in self.without:
                continue
            schema = handler.generate_schema(Annotated[one.kind | None if one.optional else one.kind, one.setting])
            if one.default is not REQUIRED:
                schema = core_schema.with_default_schema(schema, default=one.default)
            fields[one.name] = core_schema.typed_dict_field(schema, required=one.default is REQUIRED)
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
        one.name: None if (value := getattr(settings, one.name)) == math.inf else value
        for one in declared(type(settings))
        if one.name not in without
    }
    return values | {name: plain_keys(getattr(settings, name)) for name in sections(type(settings))}


Section = Annotated[S, Keys()]
"""A section of a file that holds the settings of a NamedTuple: `unified: Section[UnifiedSettings]`."""
