# SPDX-License-Identifier: Apache-2.0
"""What a docstring says of attributes, as schemas have it."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_bringup.attributes import attribute_words


class Described(NamedTuple):
    """A point, with: a colon.

    Attributes:
        x, y: coordinates (m),
            in the plane.
        name: what it is called.

    Beyond: this.
    """

    x: float
    y: float
    name: str


def test_each_attribute_has_its_words() -> None:
    place = "coordinates (m), in the plane."
    assert attribute_words(Described) == {"x": place, "y": place, "name": "what it is called."}
    assert attribute_words(int) == {}
