# SPDX-License-Identifier: Apache-2.0
"""The commands and nodes that the packages install, as they announce them."""

from __future__ import annotations

from importlib.metadata import EntryPoint, distribution

PACKAGES = ("fivebar_description", "fivebar_control", "fivebar_sim", "fivebar_bringup")


def console_scripts() -> dict[str, EntryPoint]:
    """Return the entry point of every installed executable by its name."""
    found = (distribution(package).entry_points.select(group="console_scripts") for package in PACKAGES)
    return {entry.name: entry for entries in found for entry in entries}
