"""The `fivebar` command: every module of this package adds its subcommands when it is imported."""

from __future__ import annotations

from fivebar_bringup.cli import (
    benchmark,
    calibrate,
    camera,
    compare,
    estimate,
    goto,
    guide,
    identify,
    migrate,
    posture,
    program,
    robustness,
    running,
    settings,
    status,
    studies,
    sweep,
    urdf,
    viewing,
)
from fivebar_bringup.cli.app import app

__all__ = [
    "benchmark",
    "calibrate",
    "camera",
    "compare",
    "estimate",
    "goto",
    "guide",
    "identify",
    "main",
    "migrate",
    "posture",
    "program",
    "robustness",
    "running",
    "settings",
    "status",
    "studies",
    "sweep",
    "urdf",
    "viewing",
]


def main() -> None:
    """Run the command."""
    app()


if __name__ == "__main__":
    main()
