"""Errors that a user reads, in a module that loads nothing."""

from __future__ import annotations


class InputError(ValueError):
    """Invalid user input: one line that names the place, the value and what was expected."""
