# SPDX-License-Identifier: Apache-2.0
"""The unit in which somebody has written a value that is no plausible one in the unit that was expected."""

from __future__ import annotations

import math
from collections.abc import Callable

OTHERS: dict[str, tuple[tuple[str, float], ...]] = {
    "m": (("mm", 1e-3), ("cm", 1e-2), ("inches", 0.0254)),
    "rad": (("degrees", math.pi / 180.0), ("mrad", 1e-3)),
    "rad/s": (("deg/s", math.pi / 180.0), ("rpm", math.pi / 30.0)),
    "kg": (("g", 1e-3),),
    "kg m^2": (("kg cm^2", 1e-4), ("g mm^2", 1e-9)),
    "N": (("mN", 1e-3),),
    "Nm": (("mNm", 1e-3),),
    "Nm/A": (("mNm/A", 1e-3),),
    "s": (("ms", 1e-3),),
}
"""Units that are taken for another one, each with its size in that."""


def in_other_unit(unit: str, fits: Callable[[float], bool]) -> str:
    """Return the end of a message that refuses a value: the question for its unit, "" where no other one explains it.

    Args:
        unit: that was expected.
        fits: whether the value, times the size of another unit, would be accepted.
    """
    names = [name for name, size in OTHERS.get(unit, ()) if fits(size)]
    return f": is it in {', '.join(names[:-1])}{' or ' * (len(names) > 1)}{names[-1]}?" if names else ""
