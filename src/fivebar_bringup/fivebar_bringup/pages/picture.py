"""A finished picture of a report."""

from __future__ import annotations

import base64
from collections.abc import Iterable
from html import escape
from pathlib import Path
from typing import NamedTuple

from fivebar_bringup.runs.bag.tail import replace_file


class Picture(NamedTuple):
    """A figure as PNG, the stem of its file name, and what it shows."""

    name: str
    caption: str
    png: bytes


def figure_html(picture: Picture, instead: str | None = None) -> str:
    """Return a picture for a page, with its data in it and its caption below.

    Args:
        picture: the picture.
        instead: what is read where pictures are not shown; by default the caption.
    """
    words = escape(picture.caption if instead is None else instead, quote=True)
    data = base64.b64encode(picture.png).decode("ascii")
    return (
        f'<figure><img alt="{words}" src="data:image/png;base64,{data}">'
        f"<figcaption>{escape(picture.caption)}</figcaption></figure>"
    )


def write_pictures(folder: Path, pictures: Iterable[Picture]) -> None:
    """Write each picture as NAME.png into a folder, which is made where there is none.

    Raises:
        OSError: it cannot be made or written to.
    """
    folder.mkdir(exist_ok=True)
    for picture in pictures:
        replace_file(folder / f"{picture.name}.png", picture.png)
