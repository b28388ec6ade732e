# SPDX-License-Identifier: Apache-2.0
"""The error-based adaptive gain (4.1.3)."""

from __future__ import annotations

from fivebar_control.laws.adaptive_gain import NO_MEMORY, gain_factors, gain_memory

NOMINAL = (1.0, 1.0)


class Gain:
    """The adaptive gain over some samples."""

    def __init__(self, keep_damping: bool = True) -> None:
        self._memory = NO_MEMORY
        self._keep_damping = keep_damping

    def factors(self, in_zone: bool, error_x: float, error_y: float) -> tuple[float, float]:
        self._memory = gain_memory(self._memory, in_zone, error_x, error_y)
        return gain_factors(self._memory, error_x, error_y, 2.0, 1e-4, self._keep_damping)


def test_outside_a_zone_the_gains_are_nominal_whatever_the_error() -> None:
    gain = Gain()
    assert [gain.factors(False, error, -error) for error in (0.0, 0.01, 0.05)] == [NOMINAL] * 3


def test_a_jump_of_the_error_since_the_zone_began_raises_the_gains_and_keeps_the_damping() -> None:
    gain = Gain()
    gain.factors(False, 0.003, -0.002)
    assert gain.factors(True, 0.00305, -0.00195) == NOMINAL
    assert gain.factors(True, 0.0032, -0.002) == (4.0, 2.0)
    assert gain.factors(True, 0.00305, -0.002) == NOMINAL


def test_one_coordinate_is_enough() -> None:
    """Nominal gains need both within the limit ("and"), where the thesis prints "or"."""
    gain = Gain()
    gain.factors(False, 0.0, 0.0)
    assert gain.factors(True, 0.0, -2e-4) == (4.0, 2.0)
    assert gain.factors(True, 2e-4, 0.0) == (4.0, 2.0)
    assert gain.factors(True, 1e-4, -1e-4) == NOMINAL


def test_the_printed_scaling_multiplies_both_gains_alike() -> None:
    gain = Gain(keep_damping=False)
    gain.factors(False, 0.0, 0.0)
    assert gain.factors(True, 1e-3, 0.0) == (2.0, 2.0)


def test_the_last_sample_before_each_zone_is_the_measure() -> None:
    gain = Gain()
    gain.factors(False, 0.0, 0.0)
    assert gain.factors(True, 1e-3, 0.0) == (4.0, 2.0)
    gain.factors(False, 1e-3, 0.0)
    assert gain.factors(True, 1e-3, 0.0) == NOMINAL


def test_a_run_that_begins_inside_a_zone_is_measured_from_its_first_sample() -> None:
    gain = Gain()
    assert gain.factors(True, 0.01, 0.0) == NOMINAL
    assert gain.factors(True, 0.01, 0.0) == NOMINAL
    assert gain.factors(True, 0.011, 0.0) == (4.0, 2.0)
