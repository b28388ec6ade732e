# SPDX-License-Identifier: Apache-2.0
"""Scripts and data that a page carries within itself, and the policy under which a browser runs these and no others."""

from __future__ import annotations

import base64
import hashlib
import json
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

CORE = "fivebar_bringup.pages"
"""The package whose folder `scripts` has what several pages run."""

CHARTS = ("bokeh.min.js", "bokeh-api.min.js")
"""Bokeh's bundled scripts, which draw the charts."""


class Scripts(NamedTuple):
    """Elements for the end of a page's body, and the policy that allows their scripts by their digests alone."""

    html: str
    policy: str

    def __html__(self) -> str:
        """Return the elements; templates do not escape them."""
        return self.html


def page_scripts(
    names: tuple[str, ...],
    data: Any,
    identifier: str,
    allowed: tuple[str, ...] = (),
    libraries: tuple[str, ...] = CHARTS,
    generated: tuple[str, ...] = (),
    package: str = CORE,
) -> Scripts:
    """Return Bokeh's scripts and those of a package of these names, after the data that they read.

    Args:
        names: files in `scripts` of the package or of this one, in the order in which they run.
        data: plain values; infinities and NaN are not among them.
        identifier: id of the element that holds the data as JSON.
        allowed: further files in `scripts` that pages may run which this one opens.
        libraries: of Bokeh's scripts, those that run before.
        generated: scripts that are no files, which run before the named ones.
        package: by full name.
    """
    own, opened = ([_own(name, package) for name in group] for group in (names, allowed))
    texts = [*(_library(name) for name in libraries), *map(_without_end, generated), *own]
    # a text can then neither end its element nor begin another one
    safe = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    elements = [f'<script type="application/json" id="{identifier}">{safe}</script>']
    elements += [f"<script>{text}</script>" for text in texts]
    return Scripts("\n".join(elements), " ".join(["script-src", *map(_digest, [*texts, *opened])]))


@cache
def _library(name: str) -> str:
    # Bokeh's Python side is not needed, and would take as long to load as all the rest
    return _without_end((files("bokeh") / "server" / "static" / "js" / name).read_text(encoding="utf-8"))


@cache
def _own(name: str, package: str) -> str:
    places = (files(place) / "scripts" / name for place in (package, CORE))
    return _without_end(next(place for place in places if place.is_file()).read_text(encoding="utf-8"))


def _without_end(text: str) -> str:
    """Return a script for use within a page, whose element it does not end."""
    return text.replace("</script", "<\\/script").replace("\r\n", "\n")


def _digest(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode('utf-8')).digest()).decode('ascii')}'"
