"""The `fivebar` command: every module of `commands` adds its subcommands when it is imported."""

from __future__ import annotations

from fivebar_bringup.commands import compare, goto, identify, running, status, studies, sweep
from fivebar_bringup.commands.app import app

__all__ = ["compare", "goto", "identify", "main", "running", "status", "studies", "sweep"]


def main() -> None:
    """Run the command."""
    app()


if __name__ == "__main__":
    main()
