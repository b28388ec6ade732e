# SPDX-License-Identifier: Apache-2.0
"""Prints what a command says: words of the user as they are, never as markup, on a stream of any encoding."""

from __future__ import annotations

import codecs
import io
import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from typing import Any, TextIO

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from fivebar_description.errors import printable

PLAIN = "fivebar-plain"
"""Error handler of an output that cannot encode a character: what stands for it in ASCII."""

IN_ASCII = {
    "±": "+-",
    "°": "deg",
    "·": "*",
    "×": "x",
    "–": "-",
    "−": "-",
    "…": "...",
    "²": "^2",
    "³": "^3",
    "µ": "u",
    "σ": "sigma",
    "→": "->",
    "≠": "!=",
}


class Printer(Console):
    """A console on which text is literal: brackets are no markup, colons no emoji, control characters are escaped.

    What is to be coloured is a `Text` with a style.
    """

    def __init__(self, stderr: bool = False, soft_wrap: bool = False) -> None:
        """Make the console, of standard output or standard error."""
        super().__init__(stderr=stderr, soft_wrap=soft_wrap, markup=False, emoji=False)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterator[Segment]:
        """Yield what is printed, piece by piece."""
        for segment in super().render(renderable, options):
            if segment.control or segment.text.isprintable():
                yield segment
            else:
                yield Segment(_escaped(segment.text), segment.style)

    def render_str(self, text: str, **options: Any) -> Text:
        """Return a string as it is printed, so that columns are as wide as that."""
        return super().render_str(_escaped(text), **options)


def _escaped(text: str) -> str:
    """Return text without control characters but for its line breaks."""
    return "\n".join(map(printable, text.split("\n")))


def say(*words: object) -> None:
    """Print one line on standard output."""
    print(printable(" ".join(map(str, words))))


def complain(message: object) -> None:
    """Print one line on standard error, with the name of the command."""
    print(f"fivebar: {printable(str(message))}", file=sys.stderr)


def open_closed_streams() -> None:
    """Let what is written to a closed standard output or error go nowhere, and not into the next file to be opened."""
    for descriptor, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        if getattr(sys, name) is None:
            with suppress(OSError):
                nowhere = os.open(os.devnull, os.O_RDWR)
                os.dup2(nowhere, descriptor)
                if nowhere != descriptor:
                    os.close(nowhere)
                # processes that are started have it, too
                os.set_inheritable(descriptor, True)
                setattr(sys, name, os.fdopen(descriptor, mode, closefd=False))


def accept_any_character() -> None:
    """Have standard output and error write any text, whatever their encoding is."""
    codecs.register_error(PLAIN, _in_ascii)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=PLAIN)


def flush(stream: TextIO) -> None:
    """Write what is buffered, which without this is done at the exit, where an error is a traceback.

    Raises:
        OSError: it cannot be written.
    """
    if not stream.closed:
        stream.flush()


def _in_ascii(error: UnicodeError) -> tuple[str | bytes, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    refused = error.object[error.start : error.end]
    words = (
        IN_ASCII.get(character) or character.encode("ascii", "backslashreplace").decode("ascii")
        for character in refused
    )
    return "".join(words), error.end
