"""Settings declared once: a NamedTuple whose annotations carry description, unit, range and choices.

Everything else derives from the declaration: the section of a scenario file (`Section`), the parameters of a node
(`fivebar_description.ros.parameters.specs_of`), the tuple of numbers that compiled code takes (`as_numbers`) and the
documentation (docs/settings.md).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from types import NoneType, UnionType
from typing import Annotated, Any, NamedTuple, TypeVar, Union, cast, get_args, get_origin, get_type_hints

from annotated_types import Ge, Gt, Le, Lt
from pydantic import (
    BeforeValidator,
    ConfigDict,
    GetCoreSchemaHandler,
    PlainSerializer,
    Strict,
    TypeAdapter,
    ValidationError,
)
from pydantic_core import CoreSchema, core_schema

from fivebar_description.strict_yaml import InputError, problems_in

STRICT = ConfigDict(strict=True, allow_inf_nan=False)

S = TypeVar("S", bound=tuple[Any, ...])


@dataclass(frozen=True)
class Setting:
    """What a setting means, as metadata of its annotation; pydantic checks range, choices and `check` by it.

    Attributes:
        description: one sentence on what it does.
        unit: its unit, "" for none.
        at_least, above, at_most, below: its range, the bounds of `above` and `below` left out.
        choices: the allowed words, for strings.
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
    tunable: bool = False
    check: Callable[[Any], str | None] | None = None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Return pydantic's schema of a field with this setting: its type, range and checks; a list makes a tuple."""
        kind, optional = _without_none(source)
        bounds: list[Any] = [
            constraint(bound)
            for constraint, bound in ((Ge, self.at_least), (Gt, self.above), (Le, self.at_most), (Lt, self.below))
            if bound is not None
        ]
        if get_origin(kind) is tuple:
            bounds.append(Strict(False))
        narrowed: Any = kind
        for bound in bounds:
            narrowed = Annotated[narrowed, bound]
        schema = handler.generate_schema(narrowed | None if optional else narrowed)
        return core_schema.no_info_after_validator_function(self._checked, schema)

    def problem(self, value: Any) -> str | None:
        """Return what is wrong with a value beyond its type and range, None if nothing."""
        if self.choices and value not in self.choices:
            return f"expected one of {', '.join(self.choices)}"
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
            f"{word} {bound:g}"
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
        problem = None if value is None else self.problem(value)
        if problem is not None:
            raise ValueError(problem)
        return value


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


REQUIRED = object()


@cache
def declared(settings: type[tuple[Any, ...]]) -> tuple[Declared, ...]:
    """Return the settings that a NamedTuple declares.

    Raises:
        TypeError: a field carries no `Setting`.
    """
    defaults = cast(Any, settings)._field_defaults
    found = []
    for name, hint in get_type_hints(settings, include_extras=True).items():
        setting = next((one for one in get_args(hint)[1:] if isinstance(one, Setting)), None)
        if get_origin(hint) is not Annotated or setting is None:
            raise TypeError(f"{settings.__name__}.{name}: expected Annotated[..., Setting(...)]")
        kind, optional = _without_none(get_args(hint)[0])
        found.append(Declared(name, kind, optional, defaults.get(name, REQUIRED), setting))
    return tuple(found)


def _without_none(kind: Any) -> tuple[Any, bool]:
    """Return a type without None, and whether None was one of its alternatives."""
    if get_origin(kind) not in (Union, UnionType) or NoneType not in get_args(kind):
        return kind, False
    (present,) = (one for one in get_args(kind) if one is not NoneType)
    return present, True


def as_numbers(settings: S) -> S:
    """Return settings as compiled code takes them: numbers only, each of the type that it always has.

    Words become their place among the choices, an absent limit becomes infinite, and an integer that stands for a
    float becomes one.
    """
    values: list[Any] = []
    for one, value in zip(declared(type(settings)), settings, strict=True):
        if one.kind is str:
            values.append(one.setting.choices.index(cast(str, value)))
        elif value is None:
            values.append(math.inf)
        elif one.kind is float:
            values.append(float(cast(float, value)))
        else:
            values.append(value)
    return type(settings)(*values)


ABSENT: dict[Any, Any] = {float: 0.0, int: 0, str: ""}
"""What stands for None in a node's parameters, by type: ROS parameters know no null, and no empty array of a type."""
ABSENT_ARRAY = (0.0,)


def absent(one: Declared) -> Any:
    """Return what stands for None among a node's parameters."""
    return ABSENT.get(one.kind, ABSENT_ARRAY)


def to_parameters(settings: tuple[Any, ...]) -> dict[str, Any]:
    """Return settings as a node's parameters take them: lists for tuples, `absent` for None."""
    values = {
        one.name: absent(one) if value is None else value
        for one, value in zip(declared(type(settings)), settings, strict=True)
    }
    return {name: list(value) if isinstance(value, tuple) else value for name, value in values.items()}


def from_parameters(settings: type[S], values: Mapping[str, Any]) -> S:
    """Return settings from a node's parameters, which may be among others."""
    found = {one.name: values[one.name] for one in declared(settings)}
    for one in declared(settings):
        if one.optional and found[one.name] == absent(one):
            found[one.name] = None
    return settings(**found)


def read_settings(content: Mapping[str, Any], settings: type[S], section: str) -> S:
    """Return settings from keys with values of a section.

    Raises:
        InputError: a key is unknown, or a value does not fit.
    """
    reader: TypeAdapter[S] = TypeAdapter(settings, config=STRICT)
    try:
        return reader.validate_python(dict(content))
    except ValidationError as error:
        raise InputError(problems_in(error, f"{section}.")) from error


def _mapping(content: Any) -> Any:
    if isinstance(content, Mapping) or hasattr(content, "_fields"):
        return content
    raise ValueError(f"expected keys with values, found {type(content).__name__}")


def _plain(settings: Any) -> dict[str, Any]:
    return dict(settings._asdict())


Section = Annotated[S, BeforeValidator(_mapping), PlainSerializer(_plain)]
"""A section of a file that holds the settings of a NamedTuple: `unified: Section[UnifiedSettings]`."""
