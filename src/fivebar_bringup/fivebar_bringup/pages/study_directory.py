# SPDX-License-Identifier: Apache-2.0
"""The directory of a study's results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fivebar_bringup.pages.content import Picture
from fivebar_bringup.recorded.results import FIGURES, json_text, write_results


@dataclass(frozen=True)
class StudyDirectory:
    """The directory of one study: a page, all results as JSON, figures, and what else the study leaves.

    Attributes:
        path: of the directory.
        name: of the study, the stem of page and JSON.
    """

    path: Path
    name: str

    @property
    def page(self) -> Path:
        """The page to look at."""
        return self.path / f"{self.name}.html"

    @property
    def content(self) -> Path:
        """All results."""
        return self.path / f"{self.name}.json"

    @property
    def figures(self) -> Path:
        """The folder of the PNG figures."""
        return self.path / FIGURES

    def write(
        self,
        page: str,
        content: Mapping[str, Any],
        pictures: Sequence[Picture],
        others: Mapping[str, str] | None = None,
    ) -> None:
        """Write results, other files (text by name), figures and page, each in one step and in this order.

        What took the longest to find is there first, should the disk have no room for the rest.

        Raises:
            InputError: the directory cannot be written to.
        """
        write_results(self.path, {self.content.name: json_text(content), **(others or {})})
        write_results(self.path, {self.page.name: page}, {picture.name: picture.png for picture in pictures})
