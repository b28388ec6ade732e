# SPDX-License-Identifier: Apache-2.0
"""The person at the robot: what is asked of them, and who answers, at a terminal or by a file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple, Protocol

from fivebar_bringup.scenario import Scenario
from fivebar_description.strict_yaml import InputError

YES, NO = ("y", "yes", "true", "on"), ("n", "no", "false", "off")

STOP = ("q", "quit", "stop")
"""Answers by which a person leaves; the commissioning is resumed later."""

Answer = str | float | bool


class Turn(NamedTuple):
    """Turn a motor's proximal link by hand: its number, 0 on the left, and the angle (rad), counter-clockwise."""

    motor: int
    angle: float


class PutAt(NamedTuple):
    """Put the platform on a mark (m), elbows outwards."""

    x: float
    y: float


class Lead(NamedTuple):
    """Lead the platform along the waypoints of a scenario."""

    scenario: Scenario


Task = Turn | PutAt | Lead


class PersonLeft(Exception):
    """Nobody answers any more, or the answer was to stop: what has been found out is kept."""


class Person(Protocol):
    """Who answers and acts."""

    @property
    def asked(self) -> int:
        """How many questions and requests there have been."""
        ...

    def agrees(self, key: str, question: str) -> bool:
        """Answer a question by yes or no."""
        ...

    def does(self, key: str, request: str, task: Task) -> None:
        """Do something to the robot, and return when it is done."""
        ...

    def act(self, task: Task) -> None:
        """Carry out a task without a request, where no person does."""
        ...


class PersonAtTerminal:
    """Reads answers, a line each."""

    def __init__(self, read: Callable[[], str], tell: Callable[[str], None]) -> None:
        """Answer by `read`, which returns a line, "" at the end of the input; `tell` prints a line."""
        self._read, self._tell = read, tell
        self.asked = 0

    def agrees(self, key: str, question: str) -> bool:
        """Ask until the answer is yes or no."""
        self.asked += 1
        while True:
            word = self._answer(f"{question} [yes/no]")
            if word in YES or word in NO:
                return word in YES
            self._tell(f"{word!r}: expected yes, no, or stop")

    def does(self, key: str, request: str, task: Task) -> None:
        """Wait for Enter."""
        self.asked += 1
        self._answer(f"{request} [Enter when done]")

    def act(self, task: Task) -> None:
        """Do nothing: whoever gave the answers in advance has done it."""

    def _answer(self, words: str) -> str:
        self._tell(words)
        line = self._read()
        if not line:
            raise PersonLeft("no further answers")
        word = line.strip().lower()
        if word in STOP:
            raise PersonLeft("stopped by the person at the robot")
        return word


class PersonByFile:
    """Takes answers from a mapping by the questions' keys, and leaves the others to somebody else."""

    def __init__(self, answers: Mapping[str, Answer], source: str, otherwise: Person | None) -> None:
        """Take answers from a source; without somebody else each question needs one."""
        self._answers, self._source, self._otherwise = answers, source, otherwise
        self._own = 0

    @property
    def asked(self) -> int:
        """How many questions and requests there have been."""
        return self._own + (self._otherwise.asked if self._otherwise else 0)

    def agrees(self, key: str, question: str) -> bool:
        """Answer by the file."""
        if key not in self._answers and self._otherwise is not None:
            return self._otherwise.agrees(key, question)
        word = self._word(key, question)
        if word not in YES and word not in NO:
            raise InputError(f"{self._source}: {key}: {word!r}: expected yes, no or stop, as an answer to: {question}")
        self._own += 1
        return word in YES

    def does(self, key: str, request: str, task: Task) -> None:
        """Take a task for done where the file answers so; refuse any other answer."""
        if key not in self._answers and self._otherwise is not None:
            self._otherwise.does(key, request, task)
            return
        word = self._word(key, request)
        if word not in YES and word != "done":
            raise InputError(f"{self._source}: {key}: {word!r}: expected done or stop, as an answer to: {request}")
        self._own += 1
        self.act(task)

    def act(self, task: Task) -> None:
        """Leave the task to the other person."""
        if self._otherwise is not None:
            self._otherwise.act(task)

    def _word(self, key: str, question: str) -> str:
        if key not in self._answers:
            raise InputError(f"{self._source}: {key}: no answer to: {question}")
        word = str(self._answers[key]).strip().lower()
        if word in STOP:
            raise PersonLeft(f"{self._source}: {key}: stop")
        return word
