"""The version of a file's format: checked first, and older forms rewritten in place of their text.

A migration edits the text and not the values, so that comments, order and layout of a file stay as they are. What is
migrated for a reader and what `fivebar migrate` writes is therefore the same.
"""

from __future__ import annotations

import functools
import json
import logging
import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple, TypeVar

import yaml

from fivebar_description.settings import Setting
from fivebar_description.strict_yaml import InputError, StrictModel, parse_yaml, read_text, validate

M = TypeVar("M", bound=StrictModel)

KEY = "format"
NEWEST = 1
"""Of scenarios, robot files and programs."""

UNNAMED = 1
"""Of files without the key, which it stays: whatever was shipped before there were numbers is valid in it."""


def _is_newest(number: int) -> str | None:
    return None if number == NEWEST else f"expected {NEWEST}"


Format = Annotated[
    int, Setting("Version of the file's format; docs/reference/stability.md says what it promises.", check=_is_newest)
]
"""The key in a model, which is validated after any migration."""


class Edit(NamedTuple):
    """A part of a text, from `start` up to `end`, that is to be replaced; `what` says so in a few words."""

    start: int
    end: int
    text: str
    what: str


Rule = Callable[[Any], Iterator[Edit]]
"""Finds what must change in the root node of a file."""


class Migrated(NamedTuple):
    """A file in its newest format.

    Attributes:
        text: of the file.
        changes: what was rewritten, in words; without the number of the format.
    """

    text: str
    changes: tuple[str, ...]


def _as_written(content: Any) -> Any:
    return content


def read_versioned(
    path: Path, model: type[M], rules: Sequence[Sequence[Rule]], placed: Callable[[Any], Any] = _as_written
) -> M:
    """Read one file of any known format into `model`; says on the log, once, that an older one was migrated.

    Args:
        path: of the file.
        model: what it has to fit in its newest format.
        rules: for each older format, from 0 on, what leads to the next.
        placed: returns the parsed content with what depends on the place of the file, such as names of other files.

    Raises:
        InputError: the file is missing, not YAML, of an unknown format, or does not fit the model.
    """
    return parse_versioned(read_text(path), str(path), model, rules, placed)


def parse_versioned(
    text: str,
    source: str,
    model: type[M],
    rules: Sequence[Sequence[Rule]],
    placed: Callable[[Any], Any] = _as_written,
) -> M:
    """Read the text of a file as `read_versioned` does; `source` starts every error.

    Raises:
        InputError: it is not YAML, of an unknown format, or does not fit the model.
    """
    content = parse_yaml(text, source)
    named = format_in(content, source)
    number = UNNAMED if named is None else named
    if number < NEWEST:
        migrated = migrate(text, source, number, rules)
        changes = "; ".join(migrated.changes) or "no other change"
        _warn_once(
            f"{source}: format {number} is read as format {NEWEST} ({changes}); fivebar migrate {source} writes it so"
        )
        content = parse_yaml(migrated.text, source)
    try:
        return validate(placed(content), model, source)
    except InputError as error:
        if named is None and _fits_as_oldest(text, source, model, rules):
            raise InputError(f"{error}; format 0 allowed that: fivebar migrate --from 0 {source}") from error
        raise


def format_in(content: object, source: str) -> int | None:
    """Return the format that parsed content names, None if it names none.

    Raises:
        InputError: one that this release does not understand.
    """
    if not isinstance(content, dict) or KEY not in content:
        return None
    number = content[KEY]
    if type(number) is int and 0 <= number <= NEWEST:
        return number
    newer = type(number) is int and number > NEWEST
    raise InputError(
        f"{source}: {KEY}: {number!r}: this release understands formats 0 to {NEWEST}"
        f"{'; a newer release of fivebar reads this file' if newer else ''}"
    )


def migrate(text: str, source: str, number: int, rules: Sequence[Sequence[Rule]]) -> Migrated:
    """Return the text of a file of format `number` in the newest one, with the key that says so.

    Raises:
        InputError: the text is not YAML with keys at its top.
    """
    changes: list[str] = []
    for step in rules[number:]:
        root = _composed(text, source)
        # one edit for one place: a rule that stands first knows more of it
        edits = {edit.start: edit for rule in reversed(step) for edit in rule(root)}
        changes += (edits[start].what for start in sorted(edits))
        text = _edited(text, list(edits.values()))
    root = _composed(text, source)
    return Migrated(_edited(text, [_with_number(root)]), tuple(changes))


def yaml_1_1(root: Any) -> Iterator[Edit]:
    """Plain words that YAML 1.1, in which format 0 was read, takes for another value than YAML 1.2: `on`, `017`."""
    for node in _plain_scalars(root, set()):
        try:
            before, after = yaml.safe_load(node.value), parse_yaml(node.value, "")
        except (yaml.YAMLError, ValueError):
            continue
        if (type(before), before) == (type(after), after) or not isinstance(before, bool | int | float | str):
            continue
        yield replaced(node, before)


def replaced(node: Any, value: bool | float | str) -> Edit:
    """Return the edit that makes a scalar `value`."""
    written, begin = _written(value), node.start_mark
    return Edit(begin.index, node.end_mark.index, written, f"line {begin.line + 1}: {node.value} is now {written}")


def added(section: Any, key: str, value: bool | float | str) -> Edit:
    """Return the edit that gives a section that is not empty one more key, in front of the others."""
    mark, written = section.value[0][0].start_mark, f"{key}: {_written(value)}"
    between = ", " if section.flow_style else "\n" + " " * mark.column
    return Edit(mark.index, mark.index, written + between, f"line {mark.line + 1}: {written} is added")


def _written(value: bool | float | str) -> str:
    return repr(value) if isinstance(value, float) and math.isfinite(value) else json.dumps(value)


def node_at(root: Any, *keys: str) -> Any | None:
    """Return the node below `root` under these keys, None where there is none."""
    for key in keys:
        pairs = root.value if root is not None and root.id == "mapping" else ()
        root = next((value for name, value in pairs if name.value == key), None)
    return root


def _composed(text: str, source: str) -> Any:
    from ruamel.yaml import YAML

    content = parse_yaml(text, source)
    if not isinstance(content, dict) or not content:
        raise InputError(f"{source}: expected keys with values, found {type(content).__name__}")
    return YAML(typ="safe", pure=True).compose(text)


def _edited(text: str, edits: list[Edit]) -> str:
    for edit in sorted(edits, reverse=True):
        text = text[: edit.start] + edit.text + text[edit.end :]
    return text


def _with_number(root: Any) -> Edit:
    named = node_at(root, KEY)
    if named is not None:
        return Edit(named.start_mark.index, named.end_mark.index, str(NEWEST), "")
    return added(root, KEY, NEWEST)


def _plain_scalars(node: Any, seen: set[int]) -> Iterator[Any]:
    """Yield the values below a node that stand without quotes and tags, those that aliases share once."""
    if id(node) in seen:
        return
    seen.add(id(node))
    if node.id == "scalar":
        if node.style is None:
            yield node
        return
    for child in node.value:
        yield from _plain_scalars(child[1] if node.id == "mapping" else child, seen)


def _fits_as_oldest(text: str, source: str, model: type[M], rules: Sequence[Sequence[Rule]]) -> bool:
    try:
        migrated = migrate(text, source, 0, rules)
        validate(parse_yaml(migrated.text, source), model, source)
    except InputError:
        return False
    return bool(migrated.changes)


@functools.cache
def _warn_once(words: str) -> None:
    """Say something once: a run reads its robot again and again."""
    logging.getLogger("fivebar").warning(words)
