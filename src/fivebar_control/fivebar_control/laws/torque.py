# SPDX-License-Identifier: Apache-2.0
"""The torque pair that every control law returns."""

from __future__ import annotations

import math
from typing import NamedTuple


class Torque(NamedTuple):
    """Motor torques (Nm) of q11 and q21; NaN where the law that gave them is undefined."""

    tau1: float
    tau2: float


UNDEFINED = Torque(math.nan, math.nan)
ZERO = Torque(0.0, 0.0)
