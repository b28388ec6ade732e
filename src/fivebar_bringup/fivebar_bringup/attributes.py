# SPDX-License-Identifier: Apache-2.0
"""The words of a class' docstring on its attributes, from which schemas and tables are described."""

from __future__ import annotations

import inspect
import re


def attribute_words(kind: type) -> dict[str, str]:
    """Return what the docstring of a class says of each attribute; names that share a text have it each."""
    words: dict[str, str] = {}
    part = (inspect.getdoc(kind) or "").partition("Attributes:\n")[2]
    for names, text in re.findall(r"^ {4}(\w+(?:, \w+)*): (.*(?:\n {8}.*)*)", part, re.MULTILINE):
        words |= dict.fromkeys(names.split(", "), " ".join(text.split()))
    return words
