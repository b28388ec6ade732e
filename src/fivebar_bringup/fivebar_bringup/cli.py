"""The `fivebar` command: every module of `commands` adds its subcommands when it is imported."""

from __future__ import annotations

from fivebar_bringup.commands import running, studies
from fivebar_bringup.commands.app import app

__all__ = ["main", "running", "studies"]


def main() -> None:
    """Run the command."""
    app()


if __name__ == "__main__":
    main()
