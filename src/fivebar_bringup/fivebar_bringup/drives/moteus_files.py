"""Files of a run on two moteus drives."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fivebar_bringup.drives.motor_files import MotorRunFiles
from fivebar_bringup.drives.run_files import private_bus


def private_link(link: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return a bus that a run has for itself, in the place of the drives' own, and how these are set up."""
    return private_bus() | {key: value for key, value in link.items() if key == "rotor_to_output_ratio"}


RUN_FILES = MotorRunFiles(private_link, shipped="moteus")
