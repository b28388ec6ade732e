# SPDX-License-Identifier: Apache-2.0
"""Programs: what a robot does one step after the other, read from YAML and laid out flat.

A program holds moves, rests, output pins, payloads and loops. It is checked as a whole before its first step, and then
laid out as the instructions that are carried out, loops written out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field, model_validator

from fivebar_control.planning.line_of_sight import Point
from fivebar_control.planning.motion_queue import MOST_VIA, via_fields
from fivebar_control.trajectory.planner import LONGEST_SEGMENT
from fivebar_control.trajectory.rounded import BLEND_RADIUS, radii_at
from fivebar_description.files import is_file, placed_beside
from fivebar_description.parameters import MOST_PAYLOAD
from fivebar_description.scenario_file import FILES_NAMED
from fivebar_description.strict_yaml import (
    NEWEST,
    Format,
    InputError,
    StrictModel,
    parse_versioned,
    read_text,
    validate,
    yaml_nodes,
)

MOST_INSTRUCTIONS = 10_000
"""Instructions of a program, loops written out."""

MOST_CHARACTERS = 1_000_000
"""Length of a program's text."""

DEEPEST = 8
"""Loops in loops."""

ACTIONS = ("move", "follow", "dwell", "set", "reset", "pick", "place", "torque", "speed", "repeat")
"""A step has exactly one of these keys."""

OPTIONS = {"mode": "move", "via": "move", "blend_radius": "move", "duration": "move", "steps": "repeat"}
"""Further keys of a step, each with the action that it belongs to."""

ASSEMBLY = {"+": 1, "-": -1}

SAME_PAYLOAD = 1e-9
"""Mass (kg) up to which what is put down may exceed what is carried: sums of decimal fractions."""

PROGRAM_FILES = tuple(("scenario", *keys) for keys in FILES_NAMED)
"""Keys of a program whose values may be names of files: those of its section `scenario`."""

NOTHING: Mapping[str, str] = MappingProxyType({})

Place = Annotated[tuple[float, float], Field(strict=False)]
Share = Annotated[float, Field(gt=0.0, le=1.0)]
Pin = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,39}$")]
Mass = Annotated[float, Field(gt=0.0, le=MOST_PAYLOAD)]


class Step(StrictModel):
    """One step as written: one action, and what belongs to it."""

    move: Place | None = None
    mode: Literal["+", "-"] | None = None
    via: Annotated[tuple[Place, ...], Field(strict=False)] = ()
    blend_radius: Annotated[float | Annotated[tuple[float, ...], Field(strict=False)], BLEND_RADIUS] = 0.0
    duration: Annotated[float, Field(gt=0.0, le=LONGEST_SEGMENT)] | None = None
    follow: Annotated[str, Field(pattern=r"\.csv$")] | None = None
    dwell: Annotated[float, Field(ge=0.0, le=86_400.0)] | None = None
    set_: Annotated[Pin | None, Field(alias="set")] = None
    reset: Pin | None = None
    pick: Mass | None = None
    place: Mass | None = None
    torque: Share | None = None
    speed: Share | None = None
    repeat: Annotated[int, Field(ge=1, le=MOST_INSTRUCTIONS)] | None = None
    steps: Annotated[tuple[Step, ...], Field(strict=False, min_length=1)] | None = None

    @model_validator(mode="before")
    @classmethod
    def _one_action(cls, content: Any) -> Any:
        if not isinstance(content, dict):
            raise ValueError(f"expected a step such as {{dwell: 0.5}}, found {type(content).__name__}")
        actions = [key for key in ACTIONS if key in content]
        if len(actions) != 1:
            raise ValueError(f"expected one of {', '.join(ACTIONS)}, found {', '.join(actions) or 'none of them'}")
        if content[actions[0]] is None:
            raise ValueError(f"{actions[0]}: expected a value")
        for option, action in OPTIONS.items():
            if option in content and action != actions[0]:
                raise ValueError(f"{option}: expected with {action}, not with {actions[0]}")
        if actions[0] == "repeat" and content.get("steps") is None:
            raise ValueError("repeat: expected steps to repeat")
        return content

    @model_validator(mode="after")
    def _rounds_corners_or_rests(self) -> Step:
        radii = self._radii()
        if not self.via:
            if any(radii):
                raise ValueError("blend_radius: expected with via, whose corners are rounded")
            return self
        if len(radii) not in (1, len(self.via)):
            raise ValueError(f"blend_radius: {len(radii)} given: expected one number, or one for each point of via")
        if any(radii) and len(self.via) > MOST_VIA:
            raise ValueError(f"via: {len(self.via)} points with a blend_radius: expected at most {MOST_VIA}")
        if self.duration is not None and not any(radii):
            raise ValueError(
                "duration: expected without via, or with a blend_radius, since each stretch between rests is timed for"
                " itself"
            )
        return self

    def _radii(self) -> tuple[float, ...]:
        return (float(self.blend_radius),) if isinstance(self.blend_radius, float | int) else self.blend_radius

    @property
    def rests(self) -> tuple[Point, ...]:
        """The points of `via` that are moves of their own: all, unless the path rounds a corner."""
        return () if any(self._radii()) else self.via

    @property
    def rounded(self) -> tuple[tuple[Point, ...], tuple[float, ...]]:
        """The points of `via` that belong to the move itself, with a blend radius (m) each."""
        if self.rests:
            return (), ()
        return self.via, radii_at(self._radii(), len(self.via))


class Program(StrictModel):
    """A program file.

    Attributes:
        format: version of the file's format.
        name: of the run, and of its directory.
        scenario: keys of the scenario that it runs in, but those of the motion: robot, controller, estimator, plant...
        start: where the robot rests at the beginning (m); that of its file by default.
        steps: what it does.
    """

    format: Format = NEWEST
    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")]
    scenario: dict[str, Any] = Field(default_factory=dict)
    start: Place | None = None
    steps: Annotated[tuple[Step, ...], Field(strict=False, min_length=1)]


class Move(NamedTuple):
    """Go to (x, y) m, in an assembly mode and a time (s), 0 for as it comes, with shares of the limits.

    Via points (m) have a blend radius (m) each, of which one at least is above 0: what only rests there is a move each.
    """

    x: float
    y: float
    assembly: int = 0
    duration: float = 0.0
    torque: float = 1.0
    speed: float = 1.0
    via: tuple[Point, ...] = ()
    blend_radius: tuple[float, ...] = ()


class Follow(NamedTuple):
    """Go through the rows of a file, by its path."""

    file: str


class Wait(NamedTuple):
    """Rest for some seconds."""

    seconds: float


class SetOutput(NamedTuple):
    """Set or reset an output pin."""

    pin: str
    on: bool


class Carry(NamedTuple):
    """From now on the platform carries a payload (kg) in all."""

    payload: float


Action = Move | Follow | Wait | SetOutput | Carry


class Instruction(NamedTuple):
    """One thing to do, and where it stands.

    Attributes:
        number: of its step, such as 3.2 for the second step of the loop that is step 3.
        line: in the text.
        rounds: of the loops around it, each with its count.
        action: what to do.
    """

    number: str
    line: int
    rounds: tuple[tuple[int, int], ...]
    action: Action

    @property
    def place(self) -> str:
        """Where it stands, for people."""
        rounds = "".join(f", round {at} of {count}" for at, count in self.rounds)
        return f"step {self.number} (line {self.line}{rounds})"


class LoadedProgram(NamedTuple):
    """A checked program: as written, laid out, its text, and the paths of files that it follows by names in that."""

    program: Program
    instructions: tuple[Instruction, ...]
    text: str
    followed: Mapping[str, str] = NOTHING

    @property
    def pins(self) -> tuple[str, ...]:
        """The output pins that it uses."""
        actions = (instruction.action for instruction in self.instructions)
        return tuple(sorted({action.pin for action in actions if isinstance(action, SetOutput)}))


def load_program(path: Path) -> LoadedProgram:
    """Read a program file.

    Raises:
        InputError: the file is missing, not YAML, or no program; one line with file, key, value and expectation.
    """
    return read_program(read_text(path), str(path))


def read_program(text: str, source: str) -> LoadedProgram:
    """Read the text of a program; `source` starts every error.

    Raises:
        InputError: it is not YAML, or no program.
    """
    if len(text) > MOST_CHARACTERS:
        raise InputError(f"{source}: {len(text)} characters: expected at most {MOST_CHARACTERS}")
    # before the content, which may be exponentially larger than the text where it refers to itself
    tree = yaml_nodes(text, source)
    folder = Path(source).parent
    content = placed_beside(folder, parse_versioned(text, source), *PROGRAM_FILES)
    program = validate(_with_followed(content, folder), Program, source)
    lines = _lines(tree)
    count = _count(program.steps, 0, source)
    if count > MOST_INSTRUCTIONS:
        raise InputError(f"{source}: steps: {count} with all rounds: expected at most {MOST_INSTRUCTIONS}")
    names = dict.fromkeys(node.value for node in _followed_in(tree))
    followed = {name: str(folder / name) if is_file(folder / name) else name for name in names}
    return LoadedProgram(program, tuple(_laid_out(program.steps, lines, source)), text, followed)


def _with_followed(content: Any, folder: Path) -> Any:
    """Return the content of a program, or of steps in it, in which names of files to follow are paths."""
    if isinstance(content, list):
        return [_with_followed(part, folder) for part in content]
    if not isinstance(content, Mapping):
        return content
    placed = placed_beside(folder, content, ("follow",))
    return {**placed, "steps": _with_followed(placed["steps"], folder)} if "steps" in placed else placed


def with_files(text: str, names: Mapping[tuple[str, ...], str], followed: Mapping[str, str] = NOTHING) -> str:
    """Return the text of a checked program with other names of the files that it names.

    Args:
        text: of the program.
        names: of those of its scenario, by their keys.
        followed: of those that it follows, by their names in the text.
    """
    replacements = [
        (node.start_mark.index, node.end_mark.index, followed[node.value])
        for node in _followed_in(yaml_nodes(text, "program"))
        if node.value in followed
    ]
    for keys, name in names.items():
        node = yaml_nodes(text, "program")
        for key in ("scenario", *keys):
            node = None if node is None else _value(node, key)
        if node is not None:
            replacements.append((node.start_mark.index, node.end_mark.index, name))
    for start, end, name in sorted(replacements, reverse=True):
        text = text[:start] + name + text[end:]
    return text


def _followed_in(node: Any) -> Iterator[Any]:
    """Yield the nodes of the names of the files that the steps of a mapping follow."""
    steps = _value(node, "steps")
    for step in () if steps is None else steps.value:
        name = _value(step, "follow")
        if name is not None:
            yield name
        yield from _followed_in(step)


class _Numbered(NamedTuple):
    """The line of a step, and those of the steps in it."""

    line: int
    inside: tuple[_Numbered, ...]


def _value(node: Any, key: str) -> Any:
    """Return the node of a key's value in a mapping."""
    return next((value for name, value in node.value if name.value == key), None)


def _lines(node: Any) -> tuple[_Numbered, ...]:
    """Return the lines of the steps of a mapping that is known to be that of a program or a loop."""
    steps = _value(node, "steps")
    return () if steps is None else tuple(_Numbered(step.start_mark.line + 1, _lines(step)) for step in steps.value)


def _count(steps: Sequence[Step], depth: int, source: str) -> int:
    """Return how many instructions some steps make, without making them."""
    if depth > DEEPEST:
        raise InputError(f"{source}: steps: loops in loops {depth} deep: expected at most {DEEPEST}")
    return sum(
        (step.repeat or 0) * _count(step.steps, depth + 1, source) if step.steps else 1 + len(step.rests)
        for step in steps
    )


class _Running(NamedTuple):
    """The state that the steps before have left."""

    torque: float = 1.0
    speed: float = 1.0
    payload: float = 0.0


def _laid_out(steps: Sequence[Step], lines: Sequence[_Numbered], source: str) -> Iterator[Instruction]:
    state = _Running()
    for number, line, rounds, step in _unrolled(steps, lines, "", ()):
        if step.torque is not None or step.speed is not None:
            state = state._replace(torque=step.torque or state.torque, speed=step.speed or state.speed)
            continue
        if step.pick is not None or step.place is not None:
            payload = state.payload + (step.pick or 0.0) - (step.place or 0.0)
            if not -SAME_PAYLOAD <= payload <= MOST_PAYLOAD:
                raise InputError(
                    f"{source}: line {line}: step {number}: {'place' if step.place else 'pick'}:"
                    f" {step.place or step.pick:g} kg with {state.payload:g} kg on the platform: expected a payload of"
                    f" 0 to {MOST_PAYLOAD:g} kg afterwards"
                )
            # what is left of a sum of decimal fractions is nothing
            state = state._replace(payload=payload if payload > SAME_PAYLOAD else 0.0)
        for action in _actions(step, state):
            yield Instruction(number, line, rounds, action)


def _unrolled(
    steps: Sequence[Step], lines: Sequence[_Numbered], prefix: str, rounds: tuple[tuple[int, int], ...]
) -> Iterator[tuple[str, int, tuple[tuple[int, int], ...], Step]]:
    """Yield the steps in the order in which they are carried out, with number, line and rounds."""
    for place, (step, (line, inside)) in enumerate(zip(steps, lines, strict=True), start=1):
        number = f"{prefix}{place}"
        if step.steps is None:
            yield number, line, rounds, step
            continue
        count = step.repeat or 0
        for turn in range(1, count + 1):
            yield from _unrolled(step.steps, inside, f"{number}.", (*rounds, (turn, count)))


def _actions(step: Step, state: _Running) -> Iterator[Action]:
    """Yield what a step does; the assembly mode is that of the end of a path, not of its other points."""
    if step.move is not None:
        assembly, duration = ASSEMBLY.get(step.mode or "", 0), step.duration or 0.0
        yield from (Move(x, y, 0, 0.0, state.torque, state.speed) for x, y in step.rests)
        yield Move(*step.move, assembly, duration, state.torque, state.speed, *step.rounded)
    elif step.follow is not None:
        yield Follow(step.follow)
    elif step.dwell is not None:
        yield Wait(step.dwell)
    elif step.set_ is not None or step.reset is not None:
        yield SetOutput(step.set_ or step.reset or "", step.set_ is not None)
    else:
        yield Carry(state.payload)


def goal_fields_of(move: Move) -> Mapping[str, float]:
    """Return a move as the fields of a request."""
    return {
        "x": move.x,
        "y": move.y,
        "assembly_mode": float(move.assembly),
        "duration": move.duration,
        "torque_share": move.torque,
        "speed_share": move.speed,
        **via_fields(move.via, move.blend_radius),
    }
