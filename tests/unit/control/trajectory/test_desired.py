# SPDX-License-Identifier: Apache-2.0
"""Desired instants as rows of an array."""

from __future__ import annotations

import numpy as np
import pytest

from fivebar_control.laws.reference import Reference
from fivebar_control.model.state import Leg, State
from fivebar_control.trajectory.desired import REFERENCE_VALUES, reference_of, write_reference


@pytest.mark.parametrize("by_motors", [False, True])
def test_a_row_holds_a_desired_instant(by_motors: bool) -> None:
    count = len(Leg._fields)
    legs = Leg(*map(float, range(count))), Leg(*map(float, range(count, 2 * count)))
    state = State(*legs, 24.0, 25.0, 26.0, 27.0)
    reference = Reference(state, 28.0, 29.0, 30.0, 31.0, by_motors, 33.0, 34.0)
    row = np.full(REFERENCE_VALUES, -1.0)
    write_reference(reference, row)
    assert row.tolist() == [*map(float, range(32)), float(by_motors), 33.0, 34.0]
    assert repr(reference_of(row.tolist())) == repr(reference)
