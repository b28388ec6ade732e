# SPDX-License-Identifier: Apache-2.0
"""Straight lines in the plane of the robot."""

from __future__ import annotations

from typing import NamedTuple


class Line(NamedTuple):
    """A straight path segment: a point P_a (m) and the unit direction from start to end."""

    x: float
    y: float
    direction_x: float
    direction_y: float
