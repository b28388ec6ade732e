# SPDX-License-Identifier: Apache-2.0
"""A drawn figure, which a notebook shows by itself."""

from __future__ import annotations

import os
import sys
import webbrowser
from pathlib import Path
from tempfile import mkstemp
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY")
"""Environment variables of which one is set where there is a display."""


class Drawing(NamedTuple):
    """A figure, to look at in a notebook or to save.

    Attributes:
        figure: Matplotlib's, for changes of one's own.
        name: of the figure.
    """

    figure: Figure
    name: str = "figure"

    def __repr__(self) -> str:
        """Return what it is, and how to look at it."""
        return f"<Drawing {self.name}: show() opens it, save(path) writes it>"

    def show(self) -> Path:
        """Write the picture to a temporary file, open it where there is a display, say where it is, and return that.

        Raises:
            OSError: the file cannot be written.
        """
        handle, name = mkstemp(prefix=f"fivebar-{self.name}-", suffix=".png")
        os.close(handle)
        path = self.save(name)
        if any(map(os.environ.get, DISPLAYS)) or sys.platform != "linux":
            webbrowser.open(path.as_uri())
        print(f"figure: {path}")
        return path

    def save(self, path: str | Path) -> Path:
        """Write the picture in the format of the path's suffix, such as .png, .svg or .pdf, and return the path.

        Raises:
            OSError: the file cannot be written.
            ValueError: Matplotlib does not know the format.
        """
        from fivebar_bringup.pages.style import house_style

        with house_style():
            self.figure.savefig(path)
        return Path(path)

    def _repr_png_(self) -> bytes:
        from fivebar_bringup.pages.style import house_style, png

        with house_style():
            return png(self.figure)
