# SPDX-License-Identifier: Apache-2.0
"""The page of the settings: every setting of a scenario, from the declarations that also check it."""

from __future__ import annotations

import inspect
import json
import math
from collections.abc import Collection
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from fivebar_bringup.scenario import Scenario
from fivebar_control.laws.registry import own_laws
from fivebar_description.scenario_file import KEYS
from fivebar_description.settings import REQUIRED, Declared, Keys, declared, declared_as, sections

INTRODUCTION = """\
# Settings

All settings of a scenario, section by section. A node has the keys that it uses as ROS parameters under the same names,
with dots (`zone.epsilon`), with description, unit and range (`ros2 param describe`). There 0, or an array with the
single element 0, stands for `null`.

This page is printed by `fivebar settings`.
"""

COLUMNS = ("name", "type", "unit", "range", "default", "description")

LAWS = ("mpc", "lqr", "path")
"""Laws whose settings are the section `law`."""

WORDS = {float: "number", int: "integer", bool: "`true` or `false`", str: "text", dict: "keys with values"}


def settings_page() -> str:
    """Return the page as Markdown."""
    hints = get_type_hints(Scenario, include_extras=True)
    top = (declared_as(name, hints[name], _default(name)) for name in KEYS)
    parts = [INTRODUCTION, "## Top level\n", _table([row for row in top if row is not None])]
    for name in KEYS:
        field = Scenario.model_fields[name]
        keys = next((entry for entry in field.metadata if isinstance(entry, Keys)), None)
        if keys is None or field.annotation is None:
            continue
        kind: Any = field.annotation
        parts += _section(name, kind, keys.without)
    laws = own_laws()
    for name in LAWS:
        kind = laws[name].settings
        parts += [f"## Section `law` of `{name}`\n", f"{inspect.getdoc(kind)}\n", _table([*declared(kind)])]
    return "\n".join(parts)


def _section(name: str, kind: Any, without: Collection[str] = (), level: str = "##") -> list[str]:
    """Return a section and those within it; `name` is its path in the file, with dots."""
    rows = [key for key in declared(kind) if key.name not in without]
    parts = [f"{level} `{name}`\n", f"{inspect.getdoc(kind)}\n", _table(rows)]
    for inner, settings in sections(kind).items():
        parts += _section(f"{name}.{inner}", settings, level=f"{level}#")
    return parts


def _default(name: str) -> Any:
    field = Scenario.model_fields[name]
    return REQUIRED if field.is_required() else field.get_default(call_default_factory=True)


def _table(settings: list[Declared]) -> str:
    rows = [COLUMNS, tuple("---" for _ in COLUMNS), *(_row(setting) for setting in settings)]
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def _row(key: Declared) -> tuple[str, ...]:
    cells = (_kind(key), key.setting.unit, key.setting.range_text(), _value(key.default), key.setting.description)
    return (f"`{key.name}`", *(cell.replace("|", r"\|") for cell in cells))


def _kind(key: Declared) -> str:
    words = ", ".join(f"`{choice}`" for choice in key.setting.choices) if key.setting.choices else _type(key.kind)
    return f"{words}, or `null` for none" if key.optional or key.setting.unlimited else words


def _type(kind: Any) -> str:
    """Return a type in words."""
    if get_origin(kind) is Annotated:
        return _type(get_args(kind)[0])
    if get_origin(kind) in (Union, UnionType):
        return " or ".join(_type(member) for member in get_args(kind))
    if get_origin(kind) is Literal:
        return WORDS[type(get_args(kind)[0])]
    if hasattr(kind, "_fields"):
        return f"list of {len(kind._fields)} numbers"
    if get_origin(kind) is not tuple:
        return WORDS[get_origin(kind) or kind]
    element, *others = get_args(kind)
    number = "" if ... in others else f"{len(others) + 1} "
    words = _type(element)
    return f"list of {number}{'lists' + words.removeprefix('list') if words.startswith('list') else words + 's'}"


def _value(default: Any) -> str:
    if default is REQUIRED:
        return "required"
    if isinstance(default, float) and math.isinf(default):
        default = None
    return f"`{json.dumps(default)}`"
