"""Subcommand that documents the settings of a scenario."""

from __future__ import annotations

from fivebar_bringup.cli.app import command


@command()
def settings() -> None:
    """Print every setting of a scenario with its type, unit, range and default, as Markdown.

    Example: `fivebar settings > docs/settings.md`
    """
    from fivebar_bringup.reference.settings_page import settings_page

    print(settings_page(), end="")
