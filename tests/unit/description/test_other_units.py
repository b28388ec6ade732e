# SPDX-License-Identifier: Apache-2.0
"""The hint at the unit that a value may be in."""

from __future__ import annotations

import pytest

from fivebar_description.other_units import in_other_unit


@pytest.mark.parametrize(
    ("value", "unit", "most", "hint"),
    [
        (90.0, "m", 3.0, ": is it in mm, cm or inches?"),
        (1500.0, "m", 3.0, ": is it in mm?"),
        (537.0, "kg", 14.6, ": is it in g?"),
        (0.2, "rad", 0.1, ": is it in degrees or mrad?"),
        (1e9, "Nm", 10.0, ""),
        (5.0, "samples", 3.0, ""),
    ],
)
def test_units_that_explain_a_value_are_named(value: float, unit: str, most: float, hint: str) -> None:
    assert in_other_unit(unit, lambda size: value * size <= most) == hint
