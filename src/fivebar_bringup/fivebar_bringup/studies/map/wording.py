"""Modes as a person writes them."""

from __future__ import annotations


def mode_name(modes: tuple[int, int]) -> str:
    """Return the name of a working mode."""
    return "(" + ", ".join("+1" if mode > 0 else "−1" for mode in modes) + ")"


def assembly_name(assembly: int) -> str:
    """Return the name of an assembly mode."""
    return f"assembly mode det A {'>' if assembly > 0 else '<'} 0"
