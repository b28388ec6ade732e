"""A drawn figure, which a notebook shows by itself."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Drawing(NamedTuple):
    """A figure, to look at in a notebook or to save.

    Attributes:
        figure: Matplotlib's, for changes of one's own.
    """

    figure: Figure

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
