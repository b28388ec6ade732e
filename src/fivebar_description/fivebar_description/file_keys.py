"""The keys of a file as parameters of a node: each under its own name, with dots, as plain numbers, words and arrays.

A parameter has no null, and an array of numbers is flat: `waypoints` is x1, y1, x2, y2, ..., and zero, "" or an array
with such an element stands for null where a key may have it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from types import UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin, get_type_hints

from fivebar_description.errors import InputError
from fivebar_description.settings import (
    NO_LIMIT,
    Declared,
    Keys,
    Setting,
    declared,
    declared_as,
    sections,
)
from fivebar_description.strict_yaml import StrictModel


class FileKey(NamedTuple):
    """One key of a file.

    Attributes:
        name: its path in the file, with dots.
        setting: its description, unit and range.
        element: the type of its value, or of the elements of its array.
        array: whether its value is an array of numbers.
        nested: whether that array has pairs.
        number: whether one number may stand in the place of that array.
        none: what stands for null, or for an empty array; None where there is no such value.
        nothing: the value of the file that it stands for.
    """

    name: str
    setting: Setting
    element: type
    array: bool
    nested: bool
    number: bool
    none: Any
    nothing: Any

    def to_parameter(self, value: Any) -> Any:
        """Return a value of the file, as read, as a parameter."""
        if self.none is not None and (value is None or value == () or value == math.inf):
            return self.none
        if not self.array:
            return self.element(value)
        return [self.element(one) for one in _flat(value if isinstance(value, Sequence) else (value,))]

    def to_file(self, value: Any) -> Any:
        """Return a parameter as the value of a file.

        Raises:
            InputError: pairs are incomplete.
        """
        if isinstance(value, Sequence) and not isinstance(value, str):
            value = list(value)
        if self.none is not None and value == self.none:
            return self.nothing
        if self.nested:
            if len(value) % 2:
                raise InputError(f"{self.name}: {len(value)} numbers: expected pairs")
            return [list(pair) for pair in zip(value[::2], value[1::2], strict=True)]
        return value[0] if self.number and len(value) == 1 else value


def keys_of(model: type[StrictModel], names: Iterable[str]) -> list[FileKey]:
    """Return keys of a file.

    Args:
        model: the file's.
        names: of keys, of whole sections, or of keys in sections: `zone`, `ekf.gyro`.
    """
    hints = get_type_hints(model, include_extras=True)
    found: dict[str, FileKey] = {}
    for name in names:
        top, _, inner = name.partition(".")
        field = model.model_fields[top]
        keys = next((one for one in field.metadata if isinstance(one, Keys)), None)
        if keys is None:
            default = None if field.is_required() else field.get_default(call_default_factory=True)
            one = declared_as(top, hints[top], default)
            assert one is not None, f"{top}: expected a setting or a section"
            found[top] = _key(top, one)
            continue
        section: Any = field.annotation
        for key in section_keys(section, f"{top}.", keys.without):
            if not inner or key.name == name or key.name.startswith(f"{name}."):
                found[key.name] = key
    return list(found.values())


def section_keys(settings: type[tuple[Any, ...]], prefix: str, without: Sequence[str] = ()) -> list[FileKey]:
    """Return the keys of a section and of those within it, named with a prefix that ends in a dot."""
    own = [_key(prefix + one.name, one) for one in declared(settings) if one.name not in without]
    within = [section_keys(section, f"{prefix}{name}.") for name, section in sections(settings).items()]
    return [*own, *(key for keys in within for key in keys)]


def value_at(file: Any, name: str) -> Any:
    """Return the value of a key of a file that was read."""
    for part in name.split("."):
        file = getattr(file, part)
    return file


def with_keys(content: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return a file's content with other values of keys, by their names with dots."""
    changed = dict(content)
    for name, value in values.items():
        top, _, inner = name.partition(".")
        changed[top] = with_keys(changed.get(top) or {}, {inner: value}) if inner else value
    return changed


def _key(name: str, one: Declared) -> FileKey:
    element, array, nested = _leaf(one.kind), _is_array(one.kind), _is_nested(one.kind)
    number = array and any(_elements(alternative) is None for alternative in _bare(one.kind))
    none = None
    if one.optional or one.setting.unlimited or one.default == ():
        none = [NO_LIMIT[element]] if array else NO_LIMIT[element]
    nothing: Any = None if one.optional or one.setting.unlimited else []
    return FileKey(name, one.setting, element, array, nested, number, none, nothing)


def _bare(kind: Any) -> tuple[Any, ...]:
    """Return the alternatives of a type without their annotations, None left out."""
    if get_origin(kind) is Annotated:
        return _bare(get_args(kind)[0])
    if get_origin(kind) in (Union, UnionType):
        return tuple(bare for one in get_args(kind) if one is not type(None) for bare in _bare(one))
    return (kind,)


def _elements(kind: Any) -> Any:
    """Return the type of the elements of an array, None for any other type."""
    if hasattr(kind, "_fields"):
        return next(iter(get_type_hints(kind).values()))
    return get_args(kind)[0] if get_origin(kind) is tuple else None


def _leaf(kind: Any) -> type:
    first = _bare(kind)[0]
    element = _elements(first)
    if element is not None:
        return _leaf(element)
    return type(get_args(first)[0]) if get_origin(first) is Literal else first


def _is_array(kind: Any) -> bool:
    return any(_elements(one) is not None for one in _bare(kind))


def _is_nested(kind: Any) -> bool:
    return any(element is not None and _is_array(element) for element in map(_elements, _bare(kind)))


def _flat(value: Iterable[Any]) -> Iterable[Any]:
    for one in value:
        if isinstance(one, Sequence):
            yield from _flat(one)
        else:
            yield one
