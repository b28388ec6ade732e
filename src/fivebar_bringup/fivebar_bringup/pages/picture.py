"""A finished picture of a report."""

from __future__ import annotations

import base64
from typing import NamedTuple


class Picture(NamedTuple):
    """A figure as PNG, the stem of its file name, and what it shows."""

    name: str
    caption: str
    png: bytes

    @property
    def base64(self) -> str:
        """The PNG as text, as a page embeds it."""
        return base64.b64encode(self.png).decode("ascii")
