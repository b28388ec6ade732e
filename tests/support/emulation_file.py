# SPDX-License-Identifier: Apache-2.0
"""Reads the file of emulated drives."""

from __future__ import annotations

from fivebar_description.files import share_file, yaml_path
from fivebar_description.strict_yaml import read_yaml
from fivebar_sim.drives.configuration import EmulationFile


def load_emulation(emulation: str) -> EmulationFile:
    """A file by its shipped name ("dextar_emulated") or by its path."""
    return read_yaml(yaml_path("emulation", emulation, share_file("fivebar_sim", "config", "drives")), EmulationFile)
