# SPDX-License-Identifier: Apache-2.0
"""Errors that a user reads, in a module that loads nothing: one printable line, whatever the input was."""

from __future__ import annotations

from typing import Any

LONGEST_VALUE = 120
"""Characters of a refused value that are quoted; a whole section or file would bury the message."""


class InputError(ValueError):
    """Invalid user input: one line that names the place, the value and what was expected.

    Paths and values come from outside: control characters in them, such as terminal escape sequences and line breaks,
    are written as escapes.
    """

    def __init__(self, message: str) -> None:
        """Make the error."""
        super().__init__(printable(message))


def printable(text: str) -> str:
    """Return text with every character that a terminal would not show as a sign written as an escape."""
    if text.isprintable():
        return text
    return "".join(
        character if character.isprintable() else character.encode("unicode_escape").decode("ascii")
        for character in text
    )


def unwrapped(words: object) -> str:
    """Return what an error of a library says as one line, "" for nothing."""
    return " ".join(str(words).split())


def quoted(value: Any) -> str:
    """Return a value as a message quotes it: as Python writes it, shortened where it is long."""
    try:
        text = repr(value)
    except ValueError:
        # Python writes no integer of more than 4300 digits
        return "a number of thousands of digits" if isinstance(value, int) else "a value with a number too long"
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]}..."
