"""A finished picture of a report."""

from __future__ import annotations

import base64
from html import escape
from typing import NamedTuple


class Picture(NamedTuple):
    """A figure as PNG, the stem of its file name, and what it shows."""

    name: str
    caption: str
    png: bytes


def figure_html(picture: Picture) -> str:
    """Return a picture for a page, with its data in it and its caption below."""
    data = base64.b64encode(picture.png).decode("ascii")
    return (
        f'<figure><img alt="{escape(picture.caption, quote=True)}" src="data:image/png;base64,{data}">'
        f"<figcaption>{escape(picture.caption)}</figcaption></figure>"
    )
