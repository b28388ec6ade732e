"""Subcommand that documents the settings of a scenario."""

from __future__ import annotations

from fivebar_bringup.cli.app import Group, command


@command(Group.FILES)
def settings() -> None:
    """Print every setting of a scenario: unit, range, default.

    The list is in Markdown.

    Example: `fivebar settings > docs/settings.md`
    """
    from fivebar_bringup.reference.settings_page import settings_page

    print(settings_page(), end="")
