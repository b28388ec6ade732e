# SPDX-License-Identifier: Apache-2.0
"""Zeros and minima of functions of one variable, by Brent's methods of 1973.

In plain Python, as the functions are: a library would add half a second of loading to every command and node.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable

MOST_STEPS = 100
"""Largest number of steps of the search of a zero."""

MOST_CALLS = 500
"""Largest number of calls of the function whose minimum is searched."""

RESOLUTION = 4.0 * sys.float_info.epsilon
"""Resolution of a zero, relative to it."""

FLAT = math.sqrt(2.2e-16)
"""Relative change of the variable within which a function is flat at its minimum."""

GOLDEN = 0.5 * (3.0 - math.sqrt(5.0))
"""Smaller part of an interval in the golden section."""


def zero_between(function: Callable[[float], float], low: float, high: float, tolerance: float = 2e-12) -> float:
    """Return where a function is zero between two places where it has different signs.

    Args:
        function: a continuous function.
        low, high: the two places.
        tolerance: of the result, beside four units in its last place.

    Raises:
        ValueError: the signs are equal, or the function is not a number somewhere.
        RuntimeError: it takes too many steps.
    """
    before, here, across = low, high, 0.0
    value_before, value, value_across = _number(function, low), _number(function, high), 0.0
    if value_before == 0.0:
        return low
    if value == 0.0:
        return high
    if (value_before < 0.0) == (value < 0.0):
        raise ValueError(f"a zero between {low} and {high}: expected different signs, found {value_before} and {value}")
    last = step = 0.0
    for _ in range(MOST_STEPS):
        if value_before != 0.0 and value != 0.0 and (value_before < 0.0) != (value < 0.0):
            across, value_across = before, value_before
            last = step = here - before
        if abs(value_across) < abs(value):
            before, here, across = here, across, here
            value_before, value, value_across = value, value_across, value
        least = (tolerance + RESOLUTION * abs(here)) / 2.0
        half = (across - here) / 2.0
        if value == 0.0 or abs(half) < least:
            return here
        tried = half
        if abs(last) > least and abs(value) < abs(value_before):
            if before == across:
                tried = -value * (here - before) / (value - value_before)
            else:
                slope = (value_before - value) / (before - here)
                slope_across = (value_across - value) / (across - here)
                numerator = value_across * slope_across - value_before * slope
                tried = -value * numerator / (slope_across * slope * (value_across - value_before))
            if 2.0 * abs(tried) < min(abs(last), 3.0 * abs(half) - least):
                last, step = step, tried
            else:
                last = step = half
        else:
            last = step = half
        before, value_before = here, value
        here += step if abs(step) > least else math.copysign(least, half)
        value = _number(function, here)
    raise RuntimeError(f"a zero between {low} and {high}: not found in {MOST_STEPS} steps")


def _number(function: Callable[[float], float], place: float) -> float:
    value = function(place)
    if math.isnan(value):
        raise ValueError(f"a zero: the function is not a number at {place}")
    return value


def minimum_between(
    function: Callable[[float], float], low: float, high: float, tolerance: float = 1e-5
) -> tuple[float, float]:
    """Return where a function is least between two places, one of its local minima, and its value there.

    Args:
        function: a continuous function.
        low, high: the two places, which themselves are not looked at.
        tolerance: of the place.
    """
    best = second = third = low + GOLDEN * (high - low)
    least = function(best)
    value_second = value_third = least
    step = last = 0.0
    for _ in range(MOST_CALLS - 1):
        middle = 0.5 * (low + high)
        near = FLAT * abs(best) + tolerance / 3.0
        if abs(best - middle) <= 2.0 * near - 0.5 * (high - low):
            break
        parabola = None
        if abs(last) > near:
            parabola = _vertex(best - second, best - third, least - value_second, least - value_third)
            previous, last = last, step
            if not _is_sound(parabola, previous, low - best, high - best):
                parabola = None
        if parabola is None:
            last = low - best if best >= middle else high - best
            step = GOLDEN * last
        else:
            numerator, denominator = parabola
            step = numerator / denominator
            there = best + step
            if there - low < 2.0 * near or high - there < 2.0 * near:
                step = near if middle >= best else -near
        there = best + (max(step, near) if step >= 0.0 else -max(-step, near))
        value = function(there)
        if value <= least:
            low, high = (best, high) if there >= best else (low, best)
            third, value_third, second, value_second = second, value_second, best, least
            best, least = there, value
            continue
        low, high = (there, high) if there < best else (low, there)
        if value <= value_second or second == best:
            third, value_third, second, value_second = second, value_second, there, value
        elif value <= value_third or third in (best, second):
            third, value_third = there, value
    return best, least


def _vertex(to_second: float, to_third: float, over_second: float, over_third: float) -> tuple[float, float]:
    """Return the step to the vertex of a parabola through three places, as numerator and positive denominator."""
    second_by_third, third_by_second = to_second * over_third, to_third * over_second
    numerator = to_third * third_by_second - to_second * second_by_third
    denominator = 2.0 * (third_by_second - second_by_third)
    return (-numerator, denominator) if denominator > 0.0 else (numerator, abs(denominator))


def _is_sound(parabola: tuple[float, float], previous: float, down: float, up: float) -> bool:
    """Return whether a step stays within the interval and is less than half of the one before the last."""
    numerator, denominator = parabola
    within = denominator * down < numerator < denominator * up
    return within and abs(numerator) < abs(0.5 * denominator * previous)
